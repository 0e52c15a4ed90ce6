//! `dockhil stability`: is this loop stable, how far from the edge, who contributes what, what to change.

use super::console::Console;
use super::inputs::{self, Outputs};
use super::outcome::Exit;
use crate::error::Error;
use crate::model::SpaceModel;
use crate::report::{TEXT_WIDTH, html, story, text};
use crate::stability::{Answer, Domain, OneDelay, SpaceAnswer, Subject, assess, assess_space, sides};
use clap::Args;
use serde::Serialize;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::PathBuf;

/// Arguments of `dockhil stability`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The model of a docking cell, along one axis or with six; or give mass, stiffness and damping.
    #[arg(value_name = "MODEL.toml", required_unless_present = "mass_kg", conflicts_with = "mass_kg")]
    model: Option<PathBuf>,
    /// Reduced mass of the satellites.
    #[arg(long, requires_all = ["stiffness_n_per_m", "damping_n_s_per_m"], allow_negative_numbers = true)]
    mass_kg: Option<f64>,
    /// Stiffness of the contact, hardware and virtual together.
    #[arg(long, requires = "mass_kg", allow_negative_numbers = true)]
    stiffness_n_per_m: Option<f64>,
    /// Damping of the contact, hardware and virtual together.
    #[arg(long, requires = "mass_kg", allow_negative_numbers = true)]
    damping_n_s_per_m: Option<f64>,
    /// Dead time of the loop; without it only the critical one is told.
    #[arg(long, requires = "mass_kg", allow_negative_numbers = true)]
    delay_s: Option<f64>,
    /// Draw the stable domain over two parameters in the report.
    #[arg(long, value_name = "X[=LOW..HIGH],Y[=LOW..HIGH]")]
    chart: Option<String>,
    /// Save the domain of the chart as comma-separated values; `-` prints them instead of the text.
    #[arg(long, value_name = "FILE.csv", requires = "chart")]
    sweep: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
}

/// The answer for a loop along one axis, or for a cell with six.
#[derive(Serialize)]
#[serde(untagged)]
enum Answered {
    Along(Box<Answer>),
    Space(Box<SpaceAnswer>),
}

impl Arguments {
    /// Does what was asked for. Exit 1 for an unstable loop, 3 for a model with parts that are not in the prediction and may turn it
    /// round.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        self.outputs.check(self.model.iter())?;
        if let Some(path) = self.sweep.as_ref().filter(|path| path.as_os_str() != "-") {
            inputs::writable(path)?;
            inputs::not_read(path, self.model.iter().chain(&self.outputs.json).chain(&self.outputs.report))?;
        }
        inputs::one_on_stdout(self.outputs.json.iter().chain(&self.outputs.report).chain(&self.sweep))?;
        if self.chart.is_some() && self.outputs.report.is_none() && self.sweep.is_none() {
            return Err(Error::new("a chart needs a page to stand on, or a file for its data")
                .place("--chart")
                .help("add --report FILE.html, or --sweep FILE.csv"));
        }
        let subject = self.subject(catalog)?;
        let sides = self.chart.as_ref().map(|chart| sides(chart, &subject)).transpose()?;
        let answer = match &subject {
            Subject::Space(model) => assess_space(model).map(|answer| Answered::Space(Box::new(answer))),
            along => assess(along).map(|answer| Answered::Along(Box::new(answer))),
        };
        let answer = answer.map_err(|error| match &self.model {
            Some(path) => error.file(path),
            None => error,
        })?;
        let progress = console.progress();
        progress.say("looking at the domain");
        let domain = sides.clone().filter(|_| self.outputs.report.is_some());
        let domain = domain.map(|(x, y)| Domain::of(&subject, x, y));
        let sweep = sides.filter(|_| self.sweep.is_some()).map(|(x, y)| Domain::sweep(&subject, &x, &y));
        drop(progress);
        let (title, provenance) = self.about()?;
        let (page, exit) = match &answer {
            Answered::Along(answer) => {
                let page = story::stability_page(&title, answer, domain.as_ref(), &console.command, &provenance);
                (page, exit(answer.stable, &answer.undecided_by))
            }
            Answered::Space(answer) => {
                let page = story::stability_space_page(&title, answer, domain.as_ref(), &console.command, &provenance);
                (page, exit(Some(answer.stable), &answer.undecided_by))
            }
        };
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{:#}\n", serde_json::json!(answer)))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        if let (Some(path), Some(sweep)) = (&self.sweep, &sweep) {
            console.save(path, sweep)?;
        }
        if !self.outputs.takes_stdout() && self.sweep.as_ref().is_none_or(|path| path.as_os_str() != "-") {
            console.print(&text(&page, TEXT_WIDTH));
        }
        Ok(exit)
    }

    /// The model, if it is one with six axes.
    fn space_model(&self, catalog: &Catalog<Axis>) -> Result<Option<SpaceModel>, Error> {
        let Some(path) = &self.model else { return Ok(None) };
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let is_meant = SpaceModel::is_meant(&text);
        is_meant.then(|| SpaceModel::parse(&path.display().to_string(), &text, catalog)).transpose()
    }

    fn subject(&self, catalog: &Catalog<Axis>) -> Result<Subject, Error> {
        match (&self.model, self.mass_kg, self.stiffness_n_per_m, self.damping_n_s_per_m) {
            (Some(path), ..) => {
                if let Some(model) = self.space_model(catalog)? {
                    return Ok(Subject::Space(Box::new(model)));
                }
                let model = inputs::running_model(path, catalog)?;
                Subject::of_model(model, catalog).map_err(|error| error.file(path))
            }
            (None, Some(mass_kg), Some(stiffness_n_per_m), Some(damping_n_s_per_m)) => {
                let delay_s = self.delay_s;
                Ok(Subject::OneDelay(OneDelay { mass_kg, stiffness_n_per_m, damping_n_s_per_m, delay_s }))
            }
            _ => Err(Error::new("neither a model nor mass, stiffness and damping were given")
                .help("dockhil stability --mass-kg 60 --stiffness-n-per-m 1000 --damping-n-s-per-m 50")),
        }
    }

    fn about(&self) -> Result<(String, Vec<(String, String)>), Error> {
        match &self.model {
            Some(path) => Ok((format!("Stability of {}", path.display()), inputs::provenance(path, &[])?)),
            None => {
                let program = ("program".to_owned(), format!("dockhil {}", env!("CARGO_PKG_VERSION")));
                Ok(("Stability of a loop with one dead time".to_owned(), vec![program]))
            }
        }
    }
}

fn exit(stable: Option<bool>, undecided_by: &[String]) -> Exit {
    match stable {
        _ if !undecided_by.is_empty() => Exit::Undecided,
        Some(false) => Exit::Failed,
        _ => Exit::Pass,
    }
}
