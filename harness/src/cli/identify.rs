//! `dockhil identify`: what lies between a robot's command and its pose.

use super::console::Console;
use super::inputs::{self, Reading};
use super::outcome::Exit;
use crate::error::Error;
use crate::identify::{RobotIdentification, identify_robot, text, write_robot};
use crate::model::{Editor, Model};
use crate::recording::{Kind, Session};
use crate::report::story::words::number;
use clap::{Args, Subcommand};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};

/// The axis along which the loop runs.
const TRAVEL: &str = "z";

/// Arguments of `dockhil identify`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Natural frequency and damping, or dead time, of each axis, from steps or from an excitation in free flight.
    Robot(Robot),
}

#[derive(Debug, Args)]
struct Robot {
    /// Recordings in which single axes make steps, or are excited at several frequencies.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Write each axis that is decided into this model file, as [robot.AXIS]; its comments stay.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Replace what the model holds of these axes already; without it they are left as they are.
    #[arg(long, requires = "model")]
    force: bool,
    /// Save the numbers as JSON; `-` prints them instead of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        match &self.verb {
            Verb::Robot(robot) => robot.run(catalog, console),
        }
    }
}

impl Robot {
    fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let read = || self.recordings.iter().chain(&self.model).chain(&self.reading.map);
        self.json.iter().try_for_each(|path| inputs::result(path, read()))?;
        let editor = self.model.as_ref().map(|path| inputs::editor_along(path, catalog)).transpose()?;
        let sessions = self.reading.sessions_as(Kind::FreeFlight, &[], &self.recordings, console)?;
        inputs::each_once(&sessions.iter().collect::<Vec<_>>())?;
        let progress = console.progress();
        progress.say("fitting a lag, a dead time, and both");
        let robot = identify_robot(&sessions)?;
        drop(progress);
        let said = text(&robot);
        let mut about_model = String::new();
        let mut is_usable = true;
        if let (Some(path), Some(mut editor)) = (&self.model, editor) {
            keeps_old(&editor, &robot, path, self.force)?;
            about_model += &left_out(path, &robot);
            let mut kept = robot.clone();
            write_robot(&mut editor, &kept, &source(&sessions));
            let written_model = |editor: &Editor| Model::parse(&path.display().to_string(), &editor.text(), catalog);
            if let Err(error) = written_model(&editor)?.with_identified_robot() {
                about_model += &refused(path, &error);
                is_usable = false;
                kept.axes.retain(|axis| axis.axis != TRAVEL);
                editor = inputs::editor_along(path, catalog)?;
                write_robot(&mut editor, &kept, &source(&sessions));
            }
            if kept.axes.iter().any(|axis| axis.is_decided) {
                editor.save(catalog)?;
                about_model += &written(path, &kept, &written_model(&editor)?);
            }
        }
        if let Some(path) = &self.json {
            console.save(path, &format!("{:#}\n", serde_json::json!(robot)))?;
        }
        if self.json.as_deref() == Some(Path::new("-")) {
            console.say(&about_model);
        } else {
            console.print(&(said + &about_model));
        }
        Ok(if is_usable && robot.axes.iter().all(|axis| axis.is_decided) { Exit::Pass } else { Exit::Undecided })
    }
}

/// An axis that the model holds already is left alone unless `force` is given.
fn keeps_old(editor: &Editor, robot: &RobotIdentification, path: &Path, force: bool) -> Result<(), Error> {
    match robot.axes.iter().filter(|axis| axis.is_decided).find(|axis| editor.has(&["robot", axis.axis])) {
        Some(axis) if !force => Err(Error::new("holds this axis already and was left as it is")
            .file(path)
            .place(format!("[robot.{}]", axis.axis))
            .help("replace it with --force")),
        _ => Ok(()),
    }
}

/// Places of the axes that are decided, or of those that are not.
fn places(robot: &RobotIdentification, are_decided: bool) -> String {
    let axes = robot.axes.iter().filter(|axis| axis.is_decided == are_decided);
    axes.map(|axis| format!("[robot.{}]", axis.axis)).collect::<Vec<_>>().join(", ")
}

/// What the commands make of what was written, and what it is.
fn written(path: &Path, robot: &RobotIdentification, model: &Model) -> String {
    let written = format!("{} written to {}\n", places(robot, true), path.display());
    if !robot.axes.iter().any(|axis| axis.is_decided && axis.axis == TRAVEL) {
        return format!("no command that runs the loop uses these axes: it runs along z\n{written}");
    }
    let stated_ms = number(1e3 * (model.timing.command_delay_s + model.timing.measurement_delay_s));
    format!(
        "compare, diagnose, ladder, replay, run and stability use [robot.z] in place of the {stated_ms} ms of [timing], not beside \
         them\n{written}"
    )
}

/// Why the axis of travel was not written.
fn refused(path: &Path, error: &Error) -> String {
    format!(
        "[robot.{TRAVEL}] not written to {}: compare, diagnose, ladder, replay, run and stability would refuse the model, since it {}; \
         {}\n",
        path.display(),
        error.what,
        error.help.as_deref().unwrap_or_default()
    )
}

/// What was not written, and why.
fn left_out(path: &Path, robot: &RobotIdentification) -> String {
    let open = places(robot, false);
    if open.is_empty() { open } else { format!("{open} not written to {}: not decided\n", path.display()) }
}

/// Where the numbers come from, short enough for a line of the model.
fn source(sessions: &[Session]) -> String {
    let files: Vec<String> = sessions.iter().map(|session| session.file.display().to_string()).collect();
    format!("dockhil identify robot, from {}", files.join(", "))
}
