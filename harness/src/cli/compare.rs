//! `dockhil compare`: where a model fails, and by how much; or, with `--reference`, what two measurements differ in.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use crate::clamp::Clamp;
use crate::compare::{CompareVerdict, FreeRun, Limit, Request, compare, compare_measurements, exit_code_of};
use crate::error::Error;
use crate::recording::Session;
use crate::report::{Page, TEXT_WIDTH, html, story, text};
use clap::Args;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};

/// Arguments of `dockhil compare`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The model file.
    #[arg(long, value_name = "MODEL.toml", required_unless_present = "reference")]
    pub model: Option<PathBuf>,
    /// Compare with this recording instead of a model: facility against air-bearing table, say.
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["model", "clamp", "samples", "seed"])]
    pub reference: Option<PathBuf>,
    /// Topics, units and conventions of the reference, if they are not those of the recordings.
    #[arg(long, value_name = "MAP.toml", requires = "reference", conflicts_with = "model")]
    pub reference_map: Option<PathBuf>,
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
    #[arg(long, value_name = "N", default_value_t = 40, allow_negative_numbers = true)]
    pub samples: i64,
    /// Seed of the free runs; without it, one is made from the SHA-256 of the first recording.
    #[arg(long, value_name = "SEED", allow_negative_numbers = true, value_parser = inputs::seed)]
    pub seed: Option<u64>,
    #[command(flatten)]
    pub outputs: Outputs,
    #[command(flatten)]
    pub reading: Reading,
}

/// Free runs that can be asked for: one has no spread, and the force and the command of each stay in memory: 5000 numbers,
/// 40 kB, for 4 s. Chosen.
const SAMPLES: std::ops::RangeInclusive<usize> = 2..=10_000;

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
        let read = self.recordings.iter().chain(&self.model).chain(&self.reference);
        self.outputs.check(read.chain(&self.reading.map).chain(&self.reference_map))?;
        match (&self.reference, &self.model) {
            (Some(reference), _) => self.against_measurement(reference, console),
            (None, Some(model)) => self.against_model(model, catalog, console),
            (None, None) => Err(Error::new("nothing to compare with").help("give --model or --reference")),
        }
    }

    fn against_measurement(&self, reference: &PathBuf, console: &mut Console<'_>) -> Result<Exit, Error> {
        let map = self.reference_map.as_ref().or(self.reading.map.as_ref()).cloned();
        let reading = Reading { map, ..self.reading.clone() };
        let mut all = reading.sessions_along(std::slice::from_ref(reference), console)?;
        all.extend(self.reading.sessions_along(&self.recordings, console)?);
        let used: Vec<&Session> = all.iter().collect();
        inputs::each_once(&used)?;
        let answer = compare_measurements(&all[0], &all[1..], &self.limits)?;
        let page = story::measurements(&answer, &console.command, &inputs::provenance_of(&used));
        self.hand_over(console, &serde_json::json!(answer), &page)?;
        Ok(exit(answer.verdict))
    }

    fn against_model(&self, path: &Path, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let samples = usize::try_from(self.samples).unwrap_or_default();
        if !SAMPLES.contains(&samples) {
            let (least, most) = (SAMPLES.start(), SAMPLES.end());
            let why =
                if samples < *least { "few free runs have no spread" } else { "many free runs do not fit into memory" };
            let what = format!("{} is outside [{least}, {most}]: so {why}", self.samples);
            return Err(Error::new(what).place("--samples").help("40 make the usual bands"));
        }
        let model = inputs::running_model(path, catalog)?;
        let sessions = self.reading.sessions_along(&self.recordings, console)?;
        inputs::each_once(&sessions.iter().collect::<Vec<_>>())?;
        let progress = console.progress();
        progress.say("comparing: software block, blocks with clamped inputs, free runs");
        let free_run = FreeRun { samples, seed: self.seed.unwrap_or_else(|| seed_of(&sessions)) };
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
        let page = story::comparison(&comparison, &console.command, &inputs::provenance(path, &used)?);
        self.hand_over(console, &serde_json::json!(comparison), &page)?;
        Ok(exit(comparison.verdict))
    }

    /// Saves what is to be saved, and prints the text.
    fn hand_over(&self, console: &mut Console<'_>, numbers: &serde_json::Value, page: &Page) -> Result<(), Error> {
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{numbers:#}\n"))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(page))?;
        }
        if !self.outputs.takes_stdout() {
            console.print(&text(page, TEXT_WIDTH));
        }
        Ok(())
    }
}

fn exit(verdict: CompareVerdict) -> Exit {
    match exit_code_of(verdict) {
        0 => Exit::Pass,
        1 => Exit::Failed,
        _ => Exit::Undecided,
    }
}
