//! `dockhil effect`: list, show, add, remove and fit the effects of a model.

mod change;
mod list;

use super::console::Console;
use super::inputs::Reading;
use super::outcome::Exit;
use crate::diagnose::refit::refit;
use crate::error::Error;
use crate::model::{Editor, Model};
use crate::recording::Session;
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
    /// Where the values come from.
    #[arg(long, value_name = "TEXT")]
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
///
/// The caller saves: after an error the file is as it was. `say` takes a line of progress.
fn fit_into(
    editor: &mut Editor,
    ids: &[String],
    learn: &[Session],
    catalog: &Catalog<Axis>,
    say: &(dyn Fn(&str) + Sync),
) -> Result<(), Error> {
    say("fitting the effects and the base values");
    let model = Model::parse("the model", &editor.text(), catalog)?;
    let (base, fitted) = refit(&model, catalog, ids, learn)?;
    let files: Vec<String> = learn.iter().map(|session| session.file.display().to_string()).collect();
    let source = format!("fitted by dockhil effect fit, base values too, to {}", files.join(", "));
    editor.set_all_base(&base);
    for one in &fitted {
        let names = one.chosen.kind.params.iter().map(|param| param.name.to_string());
        let values: Vec<(String, f64)> = names.zip(one.chosen.values.iter().copied()).collect();
        editor.set(&one.chosen.kind.id, &values, &source);
        let shown = one.chosen.kind.params.iter().zip(&one.chosen.values).zip(&one.deviations);
        for ((param, value), sd) in shown {
            say(&format!("{} {} = {value:.6e} ± {sd:.1e} {}", one.chosen.kind.id, param.name, param.unit));
        }
    }
    Ok(())
}
