//! The command `dockhil`: arguments in, values to standard output, progress and errors to standard error, an exit code.
//!
//! Nothing is computed here. A command reads its files, calls the function that does the work, and prints what came back.
//! [`run`] takes its arguments and its writers, so that a test calls it as a shell would.

mod calibrate;
mod cell;
mod compare;
mod console;
mod controller;
mod demo;
mod diagnose;
mod effect;
mod identify;
mod import;
mod inputs;
mod interrupt;
mod ladder;
mod model;
mod outcome;
mod progress;
mod record;
mod recorded;
mod replay;
mod run;
mod shortfall;
mod stability;
mod test;

pub use console::{Console, Look};
pub use controller::controller;
pub use outcome::Exit;
pub use progress::Progress;
pub use test::in_process;

use crate::error::Error;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::ffi::OsString;

/// What stands below the list of commands.
const AFTER_HELP: &str = "\
Exit codes: 0 pass · 1 a criterion failed · 2 wrong usage or input · 3 undecided · 4 nothing to run
            5 replay diverged · 6 a fault did nothing · 101 bug · 130 interrupted
Data goes to standard output, progress and errors to standard error. NO_COLOR is honoured.

Start with: dockhil demo";

/// Compare a docking simulator's model with measurements, learn which physical effect is missing, add it, watch the error
/// fall.
#[derive(Debug, Parser)]
#[command(name = "dockhil", version, after_help = AFTER_HELP)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write, check and describe model files.
    Model(model::Arguments),
    /// List, show, add, remove and fit the physical effects of a model.
    Effect(effect::Arguments),
    /// Run a scenario: record it, judge it.
    Run(run::Arguments),
    /// Run a recording through a model, clamped where asked, with faults put in: what would have changed?
    Replay(replay::Arguments),
    /// Compare a model with recordings: where it fails, and by how much.
    Compare(compare::Arguments),
    /// Rank the physical effects that would remove the remaining error.
    Diagnose(diagnose::Arguments),
    /// Show how the error falls on the test recordings, effect by effect.
    Ladder(ladder::Arguments),
    /// Say whether a loop is stable, how far from the edge, who contributes what, what to change.
    Stability(stability::Arguments),
    /// Calibrate a force/torque sensor and its tool from poses at rest.
    Calibrate(calibrate::Arguments),
    /// Identify what lies between a robot's command and its pose.
    Identify(identify::Arguments),
    /// Be a cell: robot controllers, sensor and facility on real sockets, in virtual or in real time.
    Cell(cell::Arguments),
    /// Test a controller against the virtual cell.
    Test(test::Arguments),
    /// Record a real cell: robots, sensor, clocks and everything unusual.
    Record(record::Arguments),
    /// Make a session of what another program recorded.
    Import(import::Arguments),
    /// Write recordings and a model to a folder, and go all the way from error to effect.
    Demo(demo::Arguments),
}

/// Runs one command line, `args[0]` being the program, with the effects of `catalog`; returns the exit code.
pub fn run(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    catalog: &Catalog<Axis>,
    console: &mut Console<'_>,
) -> u8 {
    interrupt::outlive_file_limit();
    let args: Vec<OsString> = args.into_iter().map(Into::into).collect();
    console.command = typed(&args);
    let exit = match parse(args, console) {
        Ok(command) => command.run(catalog, console).unwrap_or_else(|error| {
            console.error(&error);
            Exit::BadInput
        }),
        Err(exit) => exit,
    };
    match console.finish() {
        Ok(()) => exit.code(),
        Err(error) => {
            console.error(&error);
            Exit::BadInput.code()
        }
    }
}

/// Runs one command line inside another one: its errors are the caller's.
fn run_command(args: Vec<String>, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
    interrupt::outlive_file_limit();
    let args: Vec<OsString> = args.into_iter().map(Into::into).collect();
    console.command = typed(&args);
    match parse(args, console) {
        Ok(command) => command.run(catalog, console),
        Err(exit) => Ok(exit),
    }
}

/// A command line as it would be typed again: words with blanks are quoted.
fn typed(args: &[OsString]) -> String {
    let word = |arg: &OsString| {
        let text = arg.to_string_lossy();
        if text.is_empty() || text.contains(|c: char| c.is_whitespace() || "'\"$&;|<>*?()".contains(c)) {
            format!("'{}'", text.replace('\'', "'\\''"))
        } else {
            text.into_owned()
        }
    };
    std::iter::once("dockhil".to_string()).chain(args.iter().skip(1).map(word)).collect::<Vec<_>>().join(" ")
}

/// The command that was typed; or, after a request for help or a mistake, the exit code.
fn parse(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    console: &mut Console<'_>,
) -> Result<Command, Exit> {
    let matches = Arguments::command().try_get_matches_from(args);
    matches.and_then(|matches| Arguments::from_arg_matches(&matches)).map(|arguments| arguments.command).map_err(
        |error| {
            let styled = error.render();
            let text = if console.look.colour { styled.ansi().to_string() } else { styled.to_string() };
            if error.use_stderr() {
                console.say(&text);
                Exit::BadInput
            } else {
                console.print(&text);
                Exit::Pass
            }
        },
    )
}

impl Command {
    fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        match self {
            Command::Model(arguments) => arguments.run(catalog, console),
            Command::Effect(arguments) => arguments.run(catalog, console),
            Command::Run(arguments) => arguments.run(catalog, console),
            Command::Replay(arguments) => arguments.run(catalog, console),
            Command::Compare(arguments) => arguments.run(catalog, console),
            Command::Diagnose(arguments) => arguments.run(catalog, console),
            Command::Ladder(arguments) => arguments.run(catalog, console),
            Command::Stability(arguments) => arguments.run(catalog, console),
            Command::Calibrate(arguments) => arguments.run(catalog, console),
            Command::Identify(arguments) => arguments.run(catalog, console),
            Command::Cell(arguments) => arguments.run(catalog, console),
            Command::Test(arguments) => arguments.run(catalog, console),
            Command::Record(arguments) => arguments.run(catalog, console),
            Command::Import(arguments) => arguments.run(catalog, console),
            Command::Demo(arguments) => arguments.run(catalog, console),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        super::Arguments::command().debug_assert();
    }
}
