//! `dockhil compare`: where a model fails, and by how much.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use crate::error::Error;
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
    #[command(flatten)]
    pub outputs: Outputs,
    #[command(flatten)]
    pub reading: Reading,
}

/// The largest error of a channel that still passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// The channel, as the report names it.
    pub channel: String,
    /// The limit, in the channel's unit.
    pub value: f64,
}

fn limit(text: &str) -> Result<Limit, String> {
    let (channel, value) = text.split_once('=').ok_or("expected CHANNEL=VALUE, such as force=0.35")?;
    let value: f64 = value.parse().map_err(|_| format!("{value:?} is not a number"))?;
    if !(value.is_finite() && value > 0.0) {
        return Err(format!("{value} is not above 0"));
    }
    Ok(Limit { channel: channel.to_owned(), value })
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        self.outputs.check()?;
        let model = inputs::model(&self.model, catalog)?;
        let sessions = self.reading.sessions(&self.recordings, console)?;
        // WIRE: compare(model, sessions, limits) → text, json, page, exit.
        let _ = (model, sessions, self.outputs.json_only());
        Err(Error::new("compare is not wired yet"))
    }
}
