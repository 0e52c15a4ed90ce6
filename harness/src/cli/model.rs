//! `dockhil model`: write a nominal model, print its schema, check one.

use super::console::Console;
use super::inputs::{self, Reading};
use super::outcome::Exit;
use crate::error::Error;
use crate::files::write_whole;
use crate::model::{self, Model, RigKind, SpaceModel};
use crate::recording::{Map, read};
use crate::report::story::words::number;
use crate::stability::{Subject, assess, assess_space};
use clap::{Args, Subcommand};
use sim_core::effect::Catalog;
use sim_core::refusal::plain;
use sim_core::space::Axis;
use std::path::PathBuf;

/// Arguments of `dockhil model`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Write the nominal model of the rig that a recording's own record describes.
    Init(Init),
    /// Print the JSON schema of model files; editors complete and check with it.
    Schema(Schema),
    /// Read a model, report its first mistake, and warn of a loop whose stability cannot be told.
    Check(Check),
}

#[derive(Debug, Args)]
struct Init {
    /// The recording whose operator describes the rig.
    recording: PathBuf,
    /// The model file to write.
    #[arg(short, long, value_name = "MODEL.toml")]
    output: PathBuf,
    /// Overwrite the model file.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Debug, Args)]
struct Schema {
    /// The schema of maps instead: topics, units and conventions of recordings.
    #[arg(long)]
    map: bool,
    /// The schema of models with six axes instead.
    #[arg(long, conflicts_with = "map")]
    space: bool,
}

#[derive(Debug, Args)]
struct Check {
    /// The model file.
    model: PathBuf,
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        match &self.verb {
            Verb::Init(init) => init.run(catalog, console)?,
            Verb::Schema(Schema { map: true, .. }) => {
                console.print(&format!("{:#}\n", schemars::schema_for!(Map).to_value()));
            }
            Verb::Schema(Schema { space: true, .. }) => {
                console.print(&format!("{:#}\n", model::space_schema(catalog)));
            }
            Verb::Schema(Schema { map: false, space: false }) => {
                console.print(&format!("{:#}\n", model::schema(catalog)))
            }
            Verb::Check(check) => {
                let text = std::fs::read_to_string(&check.model).unwrap_or_default();
                let name = check.model.display();
                let (short, untold) = if SpaceModel::is_meant(&text) {
                    let model = SpaceModel::parse(&name.to_string(), &text, catalog)?;
                    (in_short_space(&model), assess_space(&model).err())
                } else {
                    let model = inputs::model(&check.model, catalog)?;
                    // What the commands that run the loop refuse is refused here.
                    let running = inputs::running_model(&check.model, catalog)?;
                    (in_short(&model), untold(running, catalog))
                };
                console.print(&format!("{name}: {short}\n"));
                if let Some(error) = untold {
                    console
                        .say(&format!("warning: {name}: the stability of its loop cannot be told: {}\n", error.what));
                }
            }
        }
        Ok(Exit::Pass)
    }
}

impl Init {
    fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<(), Error> {
        inputs::writable_new(&self.output, self.force)?;
        inputs::not_read(&self.output, [&self.recording].into_iter().chain(&self.reading.map))?;
        let session = read(&self.recording, &self.reading.options()?)?;
        let model = model::from_session(&session)?;
        let text = model.text(&format!("{} (SHA-256 {})", self.recording.display(), session.sha256))?;
        // A record may believe what no model can hold, such as a mass of zero.
        Model::parse("the model of this recording's record", &text, catalog)
            .map_err(|error| error.help("correct the record, or give the value in the map: [believed] key = value"))?;
        write_whole(&self.output, text.as_bytes())?;
        console.print(&format!("{}: written; {}\n", self.output.display(), in_short(&model)));
        Ok(())
    }
}

/// Why nobody can say whether the loop of a docking cell is stable.
fn untold(model: Model, catalog: &Catalog<Axis>) -> Option<Error> {
    if model.rig == RigKind::Drive {
        return None;
    }
    let answer = model.with_identified_robot().and_then(|model| assess(&Subject::of_model(model, catalog)?));
    answer.err()
}

fn in_short_space(model: &SpaceModel) -> String {
    format!(
        "docking cell with six axes, {} kg reduced along its axis, {} N/m, {} N s/m, effects: {}",
        // As many digits as a mass is known to; the others are kept as they were typed.
        number(model.reduced_mass_kg()),
        plain(model.contact.stiffness_n_per_m),
        plain(model.contact.damping_n_s_per_m),
        model.effects.len()
    )
}

fn in_short(model: &Model) -> String {
    let enabled = model.effects.iter().filter(|effect| effect.enabled).count();
    let rig = match model.rig {
        RigKind::Docking => "docking cell",
        RigKind::Drive => "drive",
    };
    let (mass, contact) = (model.plant.mass_kg, &model.contact);
    format!(
        "{rig}, {} kg, {} N/m, {} N s/m, effects: {enabled} enabled of {}",
        plain(mass),
        plain(contact.stiffness_n_per_m),
        plain(contact.damping_n_s_per_m),
        model.effects.len()
    )
}
