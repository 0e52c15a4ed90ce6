//! `dockhil ladder`: how the error falls on the test recordings, effect by effect.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use crate::diagnose::score::ladder_of;
use crate::error::Error;
use crate::recording::Session;
use crate::report::{TEXT_WIDTH, html, story, text};
use clap::Args;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::PathBuf;

/// Arguments of `dockhil ladder`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The model file; each of its effects is one step.
    #[arg(long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Recordings for the score, and nothing else.
    #[arg(long, required = true, num_args = 1.., value_name = "RECORDING")]
    pub test: Vec<PathBuf>,
    /// Recordings at rest, to learn the noise floor from.
    #[arg(long, num_args = 1.., value_name = "RECORDING")]
    pub aux: Vec<PathBuf>,
    #[command(flatten)]
    pub outputs: Outputs,
    #[command(flatten)]
    pub reading: Reading,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        self.outputs.check(self.test.iter().chain(&self.aux).chain([&self.model]).chain(&self.reading.map))?;
        let model = inputs::running_model(&self.model, catalog)?;
        let aux = self.reading.sessions_along(&self.aux, console)?;
        let test = self.reading.sessions_along(&self.test, console)?;
        inputs::apart(&aux, &test)?;
        let progress = console.progress();
        progress.say("scoring the test recordings, step by step");
        let ladder = ladder_of(&model, catalog, &test, &aux)?;
        drop(progress);
        let used: Vec<&Session> = aux.iter().chain(&test).collect();
        let page = story::ladder_page(&ladder, &console.command, &inputs::provenance(&self.model, &used)?);
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{:#}\n", serde_json::json!(ladder)))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        if !self.outputs.takes_stdout() {
            console.print(&text(&page, TEXT_WIDTH));
        }
        Ok(Exit::Pass)
    }
}
