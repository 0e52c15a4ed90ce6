//! `dockhil demo`: from an error to the missing effect, on recordings that are inside the program.
//!
//! It does what a user would type, in the order in which a user would type it, and prints each line before it runs it. Nothing
//! is prepared: the folder that it leaves behind can be worked on with the same commands.

use super::console::Console;
use super::outcome::Exit;
use super::run_command;
use crate::error::Error;
use crate::files::write_whole;
use clap::Args;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};

/// Arguments of `dockhil demo`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The folder to write to; files of the same names are overwritten.
    #[arg(short, long, value_name = "FOLDER", default_value = "dockhil-demo")]
    output: PathBuf,
}

/// One step of the story: what it is for, and what is typed.
struct Step {
    heading: &'static str,
    words: Vec<String>,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let folder = &self.output;
        std::fs::create_dir_all(folder).map_err(|error| {
            Error::new(format!("cannot make the folder: {error}")).file(folder).help("name another one with -o FOLDER")
        })?;
        if fixtures::DEMO.is_empty() {
            return Err(
                Error::new("the program holds no recordings").help("build it with the files of fixtures/sessions")
            );
        }
        for recording in fixtures::DEMO {
            write_whole(&folder.join(recording.name), recording.bytes)?;
        }
        console.print(&format!(
            "Eleven recordings of a docking cell are now in {}. Something in the cell is not in its model.\n",
            folder.display()
        ));
        for step in story(folder) {
            console.print(&format!("\n── {} ──\n$ dockhil {}\n\n", step.heading, step.words.join(" ")));
            let typed: Vec<String> = std::iter::once("dockhil".to_string()).chain(step.words).collect();
            let exit = run_command(typed, catalog, console)?;
            console.print(&format!("(exit code {})\n", exit.code()));
        }
        console.print(&format!("\nThe whole story is one page: {}\n", folder.join("report.html").display()));
        Ok(Exit::Pass)
    }
}

fn story(folder: &Path) -> Vec<Step> {
    let path = |name: &str| folder.join(name).display().to_string();
    let all = |names: &[&str]| names.iter().map(|name| path(name)).collect::<Vec<_>>();
    let words = |text: &str| text.split(' ').map(str::to_string).collect::<Vec<_>>();
    let model = path("nominal.toml");
    let found = path("found.toml");
    let join = |parts: Vec<Vec<String>>| parts.concat();
    vec![
        Step {
            heading: "Write the nominal model: what the operator believes",
            words: join(vec![words("model init"), all(&["learn_01.mcap"]), words("--force -o"), vec![model.clone()]]),
        },
        Step {
            heading: "Compare it with a measurement, and see where it fails",
            words: join(vec![words("compare --model"), vec![model.clone()], all(&["learn_03.mcap", "static.mcap"])]),
        },
        Step {
            heading: "Learn which physical effect is missing, and add it",
            words: join(vec![
                words("diagnose --model"),
                vec![model],
                words("--learn"),
                all(&fixtures::LEARN),
                words("--aux"),
                all(&fixtures::AUX),
                words("--test"),
                all(&fixtures::TEST),
                words("--force --write-model"),
                vec![found.clone()],
                words("--json"),
                vec![path("diagnosis.json")],
                words("--report"),
                vec![path("report.html")],
            ]),
        },
        Step {
            heading: "Watch the error fall, on recordings that were used for nothing else",
            words: join(vec![
                words("ladder --model"),
                vec![found.clone()],
                words("--aux"),
                all(&["static.mcap"]),
                words("--test"),
                all(&fixtures::TEST),
            ]),
        },
        Step {
            heading: "Compare again: the model is now inside the noise",
            words: join(vec![words("compare --model"), vec![found], all(&["test_08.mcap", "static.mcap"])]),
        },
    ]
}
