//! `dockhil diagnose`: which physical effect is missing.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use crate::diagnose::search::Rules;
use crate::diagnose::{Outcome, Request, diagnose};
use crate::error::Error;
use crate::model::Editor;
use crate::recording::Session;
use crate::report::{TEXT_WIDTH, html, story, text};
use clap::Args;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};

/// Arguments of `dockhil diagnose`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The model file.
    #[arg(long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Recordings to learn from.
    #[arg(long, required = true, num_args = 1.., value_name = "RECORDING")]
    pub learn: Vec<PathBuf>,
    /// Recordings at rest and in free flight, to learn noise and timing from.
    #[arg(long, num_args = 1.., value_name = "RECORDING")]
    pub aux: Vec<PathBuf>,
    /// Recordings for the final score, and nothing else.
    #[arg(long, required = true, num_args = 1.., value_name = "RECORDING")]
    pub test: Vec<PathBuf>,
    /// Save the model with what was found.
    #[arg(long, value_name = "MODEL.toml")]
    pub write_model: Option<PathBuf>,
    /// Overwrite the model that --write-model names.
    #[arg(long, requires = "write_model")]
    pub force: bool,
    #[command(flatten)]
    pub outputs: Outputs,
    #[command(flatten)]
    pub reading: Reading,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let read = self.learn.iter().chain(&self.aux).chain(&self.test).chain(&self.reading.map);
        self.outputs.check(read.clone().chain([&self.model]))?;
        if let Some(path) = &self.write_model {
            // The model itself may be written over, with --force.
            inputs::not_read(path, read)?;
            self.outputs.written_once(path)?;
            inputs::writable_new(path, self.force)?;
        }
        let model = inputs::running_model(&self.model, catalog)?;
        let learn = self.reading.sessions_along(&self.learn, console)?;
        let aux = self.reading.sessions_along(&self.aux, console)?;
        let test = self.reading.sessions_along(&self.test, console)?;
        inputs::each_once(&learn.iter().chain(&aux).collect::<Vec<_>>())?;
        let progress = console.progress();
        let outcome = diagnose(&Request {
            model: &model,
            catalog,
            learn: &learn,
            aux: &aux,
            test: &test,
            rules: Rules::default(),
            progress: &|text| progress.say(text),
        })?;
        drop(progress);
        if let Some(path) = &self.write_model {
            found(&self.model, &outcome, &learn, catalog)?.save_as(path, catalog)?;
            console.say(&format!("{}: written\n", path.display()));
        }
        let used: Vec<&Session> = learn.iter().chain(&aux).chain(&test).collect();
        let page = story::diagnosis(
            &outcome.diagnosis,
            &outcome.curves,
            Some(&outcome.ladder),
            catalog,
            &console.command,
            &inputs::provenance(&self.model, &used)?,
        );
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{:#}\n", serde_json::json!(outcome.diagnosis)))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        if !self.outputs.takes_stdout() {
            console.print(&text(&page, TEXT_WIDTH));
        }
        Ok(if outcome.diagnosis.verdict.answers() { Exit::Pass } else { Exit::Undecided })
    }
}

/// The model with the effects and base values that were found; its comments stay.
fn found(path: &Path, outcome: &Outcome, learn: &[Session], catalog: &Catalog<Axis>) -> Result<Editor, Error> {
    let mut editor = Editor::open(path, catalog)?;
    editor.set_all_base(&outcome.base);
    let files: Vec<String> = learn.iter().map(|session| session.file.display().to_string()).collect();
    let source = format!("fitted by dockhil diagnose, base values too, to {}", files.join(", "));
    // A lag that was identified stands in its own table.
    let robot = inputs::model(path, catalog)?.robot.and_then(|robot| robot.z);
    let identified = robot.is_some_and(|axis| axis.natural_frequency_hz.is_some());
    for chosen in outcome.found.iter().filter(|chosen| !identified || chosen.kind.id != "robot-second-order") {
        let names = chosen.kind.params.iter().map(|param| param.name.to_string());
        let values: Vec<(String, f64)> = names.zip(chosen.values.iter().copied()).collect();
        editor.set(&chosen.kind.id, &values, &source);
    }
    Ok(editor)
}
