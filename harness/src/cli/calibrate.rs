//! `dockhil calibrate`: a force/torque sensor and its tool from poses at rest.

use super::console::Console;
use super::inputs::{self, Reading};
use super::outcome::Exit;
use crate::calibrate::{FtRequest, calibrate_ft, text, write_calibration};
use crate::error::Error;
use crate::model::Editor;
use crate::recording::{Kind, Role, Session};
use clap::{Args, Subcommand};
use sim_core::calibration::{Noise, Terms};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};

/// Arguments of `dockhil calibrate`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Bias, mass, centre of mass and misalignment of a force/torque sensor and its tool, from poses at rest.
    Ft(Ft),
}

#[derive(Debug, Args)]
struct Ft {
    /// Recordings in which the robot stands in several attitudes, for a second or longer in each.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Write the result into this model file, if the poses decide it; its comments stay.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Replace the calibration that the model holds.
    #[arg(long, requires = "model")]
    force: bool,
    /// Save the numbers as JSON; `-` prints them instead of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Noise of a pose's mean force; without it, the residuals tell.
    #[arg(long, value_name = "N", requires = "torque_sigma_n_m")]
    force_sigma_n: Option<f64>,
    /// Noise of a pose's mean torque.
    #[arg(long, value_name = "N_M", requires = "force_sigma_n")]
    torque_sigma_n_m: Option<f64>,
    /// Take the sensor's axes as they are given.
    #[arg(long)]
    no_misalignment: bool,
    /// Estimate the part of the crosstalk that a weight can show.
    #[arg(long)]
    crosstalk: bool,
    /// Estimate the drift of the bias with temperature: `ft_temperature_c` of each recording.
    #[arg(long)]
    temperature: bool,
    #[command(flatten)]
    reading: Reading,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        match &self.verb {
            Verb::Ft(ft) => ft.run(catalog, console),
        }
    }
}

impl Ft {
    fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        let read = || self.recordings.iter().chain(&self.model).chain(&self.reading.map);
        self.json.iter().try_for_each(|path| inputs::result(path, read()))?;
        let editor = self.model.as_ref().map(|path| open(path, self.force, catalog)).transpose()?;
        let options = self.reading.options()?;
        let sessions = self.reading.sessions_as(Kind::Static, &[Role::Commanded], &self.recordings, console)?;
        inputs::each_once(&sessions.iter().collect::<Vec<_>>())?;
        let noise = self.force_sigma_n.zip(self.torque_sigma_n_m);
        let found = calibrate_ft(&FtRequest {
            sessions: &sessions,
            sensor: &options.map.sensor,
            terms: Terms {
                misalignment: !self.no_misalignment,
                crosstalk: self.crosstalk,
                temperature: self.temperature,
            },
            noise: noise.map(|(force_sigma_n, torque_sigma_n_m)| Noise { force_sigma_n, torque_sigma_n_m }),
        })?;
        let said = text(&found);
        let is_decided = found.observability.is_enough && found.is_steady;
        let mut about_model = String::new();
        if let (Some(path), Some(mut editor)) = (&self.model, editor) {
            if is_decided {
                let section = found.section(&source(&sessions, found.poses.len()), options.map.axis.travel);
                write_calibration(&mut editor, &section);
                editor.save(catalog)?;
                about_model +=
                    &format!("[sensor.calibration], tool_mass_kg and bias_n written to {}\n", path.display());
            } else {
                about_model += &format!("[sensor.calibration] not written to {}: not decided\n", path.display());
            }
        }
        if let Some(path) = &self.json {
            console.save(path, &format!("{:#}\n", serde_json::json!(found)))?;
        }
        if self.json.as_deref() == Some(Path::new("-")) {
            console.say(&about_model);
        } else {
            console.print(&(said + &about_model));
        }
        Ok(if is_decided { Exit::Pass } else { Exit::Undecided })
    }
}

/// The model to write to; one that holds a calibration is left alone unless `force` is given.
fn open(path: &Path, force: bool, catalog: &Catalog<Axis>) -> Result<Editor, Error> {
    let editor = inputs::editor_along(path, catalog)?;
    if editor.has(&["sensor", "calibration"]) && !force {
        return Err(Error::new("holds a calibration already and was left as it is")
            .file(path)
            .place("[sensor.calibration]")
            .help("replace it with --force"));
    }
    Ok(editor)
}

/// Where the numbers come from, short enough for a line of the model.
fn source(sessions: &[Session], poses: usize) -> String {
    let first = sessions.first().map_or_else(String::new, |session| session.file.display().to_string());
    let more = sessions.len().saturating_sub(1);
    let others = if more == 0 { String::new() } else { format!(" and {more} more") };
    format!("dockhil calibrate ft, {poses} poses at rest in {first}{others}")
}
