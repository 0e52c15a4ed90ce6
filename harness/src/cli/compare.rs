//! `dockhil compare`: where a model fails, and by how much.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use crate::clamp::Clamp;
use crate::compare::{FreeRun, Limit, Request, compare, exit_code};
use crate::error::Error;
use crate::recording::Session;
use crate::report::{TEXT_WIDTH, html, story, text};
use clap::Args;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::PathBuf;

/// Arguments of `dockhil compare`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The model file.
    #[arg(long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Recordings to compare with.
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// The largest error of a channel that still passes, in the channel's unit; may be given again.
    #[arg(long = "limit", value_name = "CHANNEL=VALUE", value_parser = limit)]
    pub limits: Vec<Limit>,
    /// The recorded wire that the blocks start from.
    #[arg(long, value_enum, default_value_t)]
    pub clamp: Clamp,
    /// How many free runs make the bands.
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub samples: usize,
    /// Seed of the free runs; without it, one is made from the SHA-256 of the first recording.
    #[arg(long, value_name = "SEED")]
    pub seed: Option<u64>,
    #[command(flatten)]
    pub outputs: Outputs,
    #[command(flatten)]
    pub reading: Reading,
}

fn limit(text: &str) -> Result<Limit, String> {
    Limit::parse(text).map_err(|error| match error.help {
        Some(help) => format!("{}; {help}", error.what),
        None => error.what,
    })
}

/// A seed that the recordings decide: the same files give the same bands.
fn seed_of(sessions: &[Session]) -> u64 {
    let digits = sessions.first().and_then(|session| session.sha256.get(..16)).unwrap_or_default();
    u64::from_str_radix(digits, 16).unwrap_or_default()
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        self.outputs.check(self.recordings.iter().chain([&self.model]).chain(&self.reading.map))?;
        if self.samples < 2 {
            let what = format!("{} free runs have no spread", self.samples);
            return Err(Error::new(what).place("--samples").help("give at least 2; 40 make the usual bands"));
        }
        let model = inputs::model(&self.model, catalog)?;
        let sessions = self.reading.sessions(&self.recordings, console)?;
        inputs::each_once(&sessions.iter().collect::<Vec<_>>())?;
        let progress = console.progress();
        progress.say("comparing: software block, blocks with clamped inputs, free runs");
        let free_run = FreeRun { samples: self.samples, seed: self.seed.unwrap_or_else(|| seed_of(&sessions)) };
        let comparison = compare(Request {
            model: &model,
            catalog,
            sessions: &sessions,
            limits: &self.limits,
            free_run,
            clamp: self.clamp,
        })?;
        drop(progress);
        let used: Vec<&Session> = sessions.iter().collect();
        let page = story::comparison(&comparison, &console.command, &inputs::provenance(&self.model, &used)?);
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{:#}\n", serde_json::json!(comparison)))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        if !self.outputs.json_only() {
            console.print(&text(&page, TEXT_WIDTH));
        }
        Ok(match exit_code(&comparison) {
            0 => Exit::Pass,
            1 => Exit::Failed,
            _ => Exit::Undecided,
        })
    }
}
