//! `dockhil diagnose`: which physical effect is missing.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use crate::error::Error;
use clap::Args;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::PathBuf;

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
        self.outputs.check()?;
        if let Some(path) = &self.write_model {
            inputs::writable_new(path, self.force)?;
        }
        let model = inputs::model(&self.model, catalog)?;
        let learn = self.reading.sessions(&self.learn, console)?;
        let aux = self.reading.sessions(&self.aux, console)?;
        let test = self.reading.sessions(&self.test, console)?;
        inputs::apart(&learn, &test)?;
        inputs::apart(&aux, &test)?;
        // WIRE: diagnose(model, learn, aux, test) → text, json, page, model, exit.
        let _ = (model, self.outputs.json_only());
        Err(Error::new("diagnose is not wired yet"))
    }
}
