//! `dockhil run`: one scenario, from its file to its recording and its verdicts.

use super::console::Console;
use super::inputs::{self, Extracted, Outputs};
use super::outcome::Exit;
use crate::error::Error;
use crate::files::sha256_hex;
use crate::report::{TEXT_WIDTH, html, text};
use crate::scenario::{self, Source, judge, page, run};
use clap::Args;
use serde_json::json;
use sim_core::criterion::{Outcome, Verdict};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};

/// Arguments of `dockhil run`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A scenario: a file, or the name of one inside the program.
    #[arg(value_name = "SCENARIO", required_unless_present_any = ["list", "schema"])]
    scenario: Option<PathBuf>,
    /// Save the recording of the run; `compare`, `diagnose` and `replay` read it.
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Overwrite the recording, or the files of --extract.
    #[arg(long)]
    force: bool,
    /// List the scenarios inside the program.
    #[arg(long, conflicts_with_all = ["scenario", "schema"])]
    list: bool,
    /// Print the JSON schema of scenario files; editors complete and check with it.
    #[arg(long, conflicts_with_all = ["scenario", "list"])]
    schema: bool,
    /// Save the scenario and its model to a folder, to be changed there; nothing is run.
    #[arg(long, value_name = "FOLDER", requires = "scenario", conflicts_with_all = ["output", "json", "report"])]
    extract: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        if self.schema {
            console.print(&format!("{:#}\n", scenario::schema(catalog)));
            return Ok(Exit::Pass);
        }
        let Some(named) = &self.scenario else { return list(console) };
        let source = Source::find(named)?;
        if let Some(folder) = &self.extract {
            return self.extract(&source, folder, console);
        }
        self.check(&source)?;
        let ran = run::run(&source, catalog)?;
        if !ran.idle.is_empty() {
            console.error(&did_nothing(&ran.idle, "[[effect]]").file(&source.file));
            return Ok(Exit::Idle);
        }
        let bytes = ran.mcap(&source)?;
        let sha256 = sha256_hex(&bytes);
        let written = self.output.as_ref().map(|path| (path.display().to_string(), format!("sha256 {sha256}")));
        let page = page::page(&ran, &console.command, &written.clone().into_iter().collect::<Vec<_>>());
        if let Some(path) = &self.output {
            console.write(path, &bytes)?;
        }
        if let Some(path) = &self.outputs.json {
            let mut answer = ran.answer();
            answer["recording"] = written.map_or(json!(null), |(file, _)| json!({ "file": file, "sha256": sha256 }));
            console.save(path, &format!("{answer:#}\n"))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        if !self.outputs.takes_stdout() {
            console.print(&text(&page, TEXT_WIDTH));
        }
        Ok(exit(&ran.verdicts))
    }

    /// Refuses now what could not be written later.
    fn check(&self, source: &Source) -> Result<(), Error> {
        let read = files(source);
        self.outputs.check(read.iter().copied())?;
        if let Some(path) = &self.output {
            inputs::not_read(path, read.into_iter())?;
            self.outputs.written_once(path)?;
            inputs::writable_new(path, self.force)?;
        }
        Ok(())
    }

    fn extract(&self, source: &Source, folder: &Path, console: &mut Console<'_>) -> Result<Exit, Error> {
        let name = source.file.file_name().unwrap_or_default();
        let scenario = Extracted { to: folder.join(name), text: &source.text };
        let model = Extracted { to: folder.join(source.model_named()?), text: &source.model_text };
        inputs::extract(&[scenario, model], files(source), self.force, console)?;
        Ok(Exit::Pass)
    }
}

/// The files that were read.
fn files(source: &Source) -> Vec<&PathBuf> {
    if source.is_embedded { Vec::new() } else { vec![&source.file, &source.model_file] }
}

/// One line for each scenario inside the program.
fn list(console: &mut Console<'_>) -> Result<Exit, Error> {
    let scenarios: Vec<_> = scenario::embedded().collect::<Result<_, _>>()?;
    let width = scenarios.iter().map(|scenario| scenario.name.len()).max().unwrap_or_default();
    for scenario in &scenarios {
        let about = scenario.about.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
        console.print(&format!("{:width$}  {about}\n", scenario.name));
    }
    Ok(Exit::Pass)
}

/// The error of a fault that changed nothing; `place` is where it was asked for.
pub(super) fn did_nothing(idle: &[String], place: &str) -> Error {
    let names = idle.join(", ");
    let what = match idle {
        [_] => format!("the fault {names} did nothing: without it the log would be the same to the last bit"),
        _ => format!("the faults {names} did nothing: without each of them the log would be the same to the last bit"),
    };
    Error::new(what)
        .place(place)
        .help("let it act on what happens in the run: another size, another time, or take it out")
}

/// The exit code of some verdicts.
pub(super) fn exit(verdicts: &[Verdict]) -> Exit {
    match judge::outcome(verdicts) {
        Outcome::Pass => Exit::Pass,
        Outcome::Undecided => Exit::Undecided,
        Outcome::Fail => Exit::Failed,
    }
}
