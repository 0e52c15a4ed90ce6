//! `dockhil demo`: from an error to the missing effect, on recordings that are inside the program.

use super::console::Console;
use super::outcome::Exit;
use crate::error::Error;
use crate::files::write_whole;
use crate::model;
use crate::recording::{ReadOptions, Session, from_bytes};
use clap::Args;
use fixtures::Recording;
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

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let folder = &self.output;
        std::fs::create_dir_all(folder).map_err(|error| {
            Error::new(format!("cannot make the folder: {error}")).file(folder).help("name another one with -o FOLDER")
        })?;
        let sessions = unpack(folder)?;
        let (name, first) = sessions.iter().find(|(name, _)| name.starts_with("learn")).ok_or_else(empty)?;
        let nominal = model::from_session(first)?;
        let model_path = folder.join("nominal.toml");
        let text = nominal.text(&format!("{} (SHA-256 {})", folder.join(name).display(), first.sha256))?;
        model::Model::parse(&model_path.display().to_string(), &text, catalog)?;
        write_whole(&model_path, text.as_bytes())?;
        // WIRE: compare, diagnose, ladder and the report on these sessions; print the command lines that do the same.
        let _ = console;
        Err(Error::new("demo is not wired yet"))
    }
}

fn empty() -> Error {
    Error::new("the program holds no recordings").help("build it with the files of fixtures/sessions")
}

/// Writes the recordings to the folder, and reads them from memory.
fn unpack(folder: &Path) -> Result<Vec<(&'static str, Session)>, Error> {
    let one = |recording: &Recording| {
        let path = folder.join(recording.name);
        write_whole(&path, recording.bytes)?;
        let session = from_bytes(&path.display().to_string(), recording.bytes, &ReadOptions::default())?;
        Ok((recording.name, session))
    };
    fixtures::DEMO.iter().map(one).collect()
}
