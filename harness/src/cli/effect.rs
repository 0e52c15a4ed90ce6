//! `dockhil effect`: list, show, add, remove and fit the effects of a model.

mod change;
mod list;

use super::console::Console;
use super::inputs::Reading;
use super::outcome::Exit;
use super::progress::Progress;
use crate::diagnose::refit::refit;
use crate::error::Error;
use crate::model::{Editor, Model};
use crate::recording::Session;
use crate::report::story::words;
use clap::{Args, Subcommand};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::PathBuf;

/// Arguments of `dockhil effect`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// List every effect: its wire, its rigs, its parameters, and what it was checked against.
    List(List),
    /// Show one effect: how it looks in a residual, what isolates it, how it is written in a model.
    Show(Show),
    /// Add effects to a model, or change the values of those that are there.
    Add(Add),
    /// Take an effect out of a model.
    Remove(Remove),
    /// Fit the parameters of effects that are in a model.
    Fit(Fit),
}

#[derive(Debug, Args)]
struct List {
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// List only what can happen on the rig of this model, and mark what the model holds.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct Show {
    /// The effect, as `effect list` names it.
    id: String,
}

#[derive(Debug, Args)]
struct Add {
    /// Effects, with values or without: without, the value is one at which a fit would start, and the model says so.
    #[arg(required = true, value_name = "ID[:PARAM=VALUE,…]")]
    effects: Vec<String>,
    /// The model file.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Where the values come from; a fit says so itself.
    #[arg(long, value_name = "TEXT", conflicts_with = "fit")]
    source: Option<String>,
    /// Fit the added effects to these recordings.
    #[arg(long, num_args = 1.., value_name = "RECORDING")]
    fit: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Debug, Args)]
struct Remove {
    /// The effect.
    id: String,
    /// The model file.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
}

#[derive(Debug, Args)]
struct Fit {
    /// Effects that the model holds.
    #[arg(required = true, value_name = "ID")]
    effects: Vec<String>,
    /// The model file.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Recordings to fit to.
    #[arg(long, required = true, num_args = 1.., value_name = "RECORDING")]
    learn: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        match &self.verb {
            Verb::List(list) => list::list(list, catalog, console)?,
            Verb::Show(show) => console.print(&list::sheet(list::known(&show.id, catalog)?)),
            Verb::Add(add) => change::add(add, catalog, console)?,
            Verb::Remove(remove) => change::remove(remove, catalog, console)?,
            Verb::Fit(fit) => change::fit(fit, catalog, console)?,
        }
        Ok(Exit::Pass)
    }
}

/// Fits the parameters of these effects to recordings, and sets them in the model that is being edited, with their source.
/// Returns what to tell: every value that moved.
///
/// The caller saves: after an error the file is as it was.
fn fit_into(
    editor: &mut Editor,
    ids: &[String],
    learn: &[Session],
    catalog: &Catalog<Axis>,
    progress: &Progress,
) -> Result<String, Error> {
    progress.say("fitting the effects and the base values");
    let model = Model::parse("the model", &editor.text(), catalog)?.with_identified_robot()?;
    let refit = refit(&model, catalog, ids, learn)?;
    let files: Vec<String> = learn.iter().map(|session| session.file.display().to_string()).collect();
    let source = format!("fitted by dockhil effect fit, base values too, to {}", files.join(", "));
    editor.set_all_base(&refit.base);
    let mut said = format!("{}: fitted to {}\n", editor.path().display(), words::counted(learn.len(), "recording"));
    for one in &refit.effects {
        let params = &one.chosen.kind.params;
        let values: Vec<(String, f64)> =
            params.iter().map(|param| param.name.to_string()).zip(one.chosen.values.iter().copied()).collect();
        let doubt = one.doubt();
        let source = doubt.as_ref().map_or(source.clone(), |doubt| format!("{source}; doubtful: {doubt}"));
        editor.set(&one.chosen.kind.id, &values, &source);
        let shown = params.iter().zip(&one.chosen.values).zip(&one.deviations);
        let texts = shown
            .map(|((param, value), sd)| format!("{} = {}", param.name, words::value_with_sd(*value, *sd, &param.unit)));
        said += &format!("  {}: {}\n", one.chosen.kind.id, texts.collect::<Vec<_>>().join(", "));
        if let Some(doubt) = doubt {
            said += &format!("    doubtful: {doubt}\n");
        }
    }
    for moved in &refit.moved {
        let unit = unit_of_key(moved.key);
        let (before, after) = (words::value(moved.before, unit), words::value_with_sd(moved.after, moved.sd, unit));
        said += &format!("  moved along: {} from {before} to {after}\n", moved.key);
    }
    Ok(said)
}

/// The unit that a base value's key ends in.
fn unit_of_key(key: &str) -> &'static str {
    match key {
        "plant.mass_kg" => "kg",
        "contact.stiffness_n_per_m" => "N/m",
        "contact.damping_n_s_per_m" => "N s/m",
        _ => "N",
    }
}
