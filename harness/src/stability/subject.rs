//! What is asked about: one dead time given by four numbers, or the cell of a model file, along one axis or with six. Either way a
//! set of named parameters.

use crate::error::Error;
use crate::model::{Chosen, Model, RigKind, SpaceModel};
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// The textbook loop: `m s² + (b s + k) e^{-hs} = 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneDelay {
    /// Reduced mass.
    pub mass_kg: f64,
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Damping.
    pub damping_n_s_per_m: f64,
    /// Dead time, if one was given: without it only the critical one is told.
    pub delay_s: Option<f64>,
}

/// A docking cell: its model and the effects in it.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The model.
    pub model: Model,
    /// Its effects.
    pub effects: Vec<Chosen>,
}

/// What is asked about.
#[derive(Debug, Clone)]
pub enum Subject {
    /// Four numbers.
    OneDelay(OneDelay),
    /// A model along one axis.
    Cell(Box<Cell>),
    /// A model with six axes.
    Space(Box<SpaceModel>),
}

impl Subject {
    /// The cell of a model file.
    pub fn of_model(model: Model, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        if model.rig == RigKind::Drive {
            return Err(Error::new("a drive has no loop through a force sensor, so no delay can make it unstable")
                .help("give the model of a docking cell: rig = \"docking\""));
        }
        let effects = model.chosen(catalog);
        Ok(Subject::Cell(Box::new(Cell { model, effects })))
    }

    /// The names of its parameters, each with its unit.
    pub fn parameters(&self) -> Vec<(String, String)> {
        let owned = |(name, unit): &(&str, &str)| ((*name).to_owned(), (*unit).to_owned());
        match self {
            Subject::OneDelay(_) => ONE_DELAY.iter().map(owned).collect(),
            Subject::Cell(cell) => {
                let of_effect = |chosen: &Chosen| {
                    let fitted = chosen.kind.params.iter().filter(|param| !param.discrete);
                    let name = |param: &sim_core::effect::Param| {
                        (format!("{}.{}", chosen.kind.id, param.name), param.unit.to_string())
                    };
                    fitted.map(name).collect::<Vec<_>>()
                };
                CELL.iter().map(owned).chain(cell.effects.iter().flat_map(of_effect)).collect()
            }
            Subject::Space(model) => {
                let virtual_part = VIRTUAL.iter().flat_map(|(list, unit)| {
                    ["x", "y", "z"].map(|axis| (format!("virtual_contact.{list}.{axis}"), (*unit).to_owned()))
                });
                let is_there = |(name, _): &&(&str, &str)| model.target.is_some() || !name.starts_with("target.");
                SPACE.iter().filter(is_there).map(owned).chain(virtual_part).collect()
            }
        }
    }

    /// The value of a parameter; `None` for one that is unknown or not given.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.clone().place(name).map(|value| *value)
    }

    /// The same, with one parameter changed.
    #[must_use]
    pub fn with(&self, name: &str, value: f64) -> Self {
        let mut changed = self.clone();
        if let Subject::OneDelay(OneDelay { delay_s, .. }) = &mut changed
            && name == "delay_s"
        {
            *delay_s = Some(value);
        } else if let Some(place) = changed.place(name) {
            *place = value;
        }
        changed
    }

    fn place(&mut self, name: &str) -> Option<&mut f64> {
        match self {
            Subject::OneDelay(loop_) => match name {
                "mass_kg" => Some(&mut loop_.mass_kg),
                "stiffness_n_per_m" => Some(&mut loop_.stiffness_n_per_m),
                "damping_n_s_per_m" => Some(&mut loop_.damping_n_s_per_m),
                "delay_s" => loop_.delay_s.as_mut(),
                _ => None,
            },
            Subject::Cell(cell) => match name {
                "plant.mass_kg" => Some(&mut cell.model.plant.mass_kg),
                "contact.stiffness_n_per_m" => Some(&mut cell.model.contact.stiffness_n_per_m),
                "contact.damping_n_s_per_m" => Some(&mut cell.model.contact.damping_n_s_per_m),
                "virtual_contact.stiffness_n_per_m" => Some(&mut cell.model.virtual_contact.stiffness_n_per_m),
                "virtual_contact.damping_n_s_per_m" => Some(&mut cell.model.virtual_contact.damping_n_s_per_m),
                "timing.command_delay_s" => Some(&mut cell.model.timing.command_delay_s),
                "timing.measurement_delay_s" => Some(&mut cell.model.timing.measurement_delay_s),
                _ => cell.effects.iter_mut().find_map(|chosen| {
                    let param = name.strip_prefix(chosen.kind.id.as_ref())?.strip_prefix('.')?;
                    let at = chosen.kind.params.iter().position(|known| known.name == param)?;
                    chosen.values.get_mut(at)
                }),
            },
            Subject::Space(model) => match name {
                "chaser.mass_kg" => Some(&mut model.chaser.mass_kg),
                "target.mass_kg" => model.target.as_mut().map(|target| &mut target.mass_kg),
                "contact.stiffness_n_per_m" => Some(&mut model.contact.stiffness_n_per_m),
                "contact.damping_n_s_per_m" => Some(&mut model.contact.damping_n_s_per_m),
                "timing.command_delay_s" => Some(&mut model.timing.command_delay_s),
                "timing.measurement_delay_s" => Some(&mut model.timing.measurement_delay_s),
                _ => {
                    let (list, axis) = name.strip_prefix("virtual_contact.")?.split_once('.')?;
                    let software = &mut model.virtual_contact;
                    let three = match list {
                        "stiffness_n_per_m" => &mut software.stiffness_n_per_m,
                        "damping_n_s_per_m" => &mut software.damping_n_s_per_m,
                        "stiffness_n_m_per_rad" => &mut software.stiffness_n_m_per_rad,
                        "damping_n_m_s_per_rad" => &mut software.damping_n_m_s_per_rad,
                        _ => return None,
                    };
                    three.get_mut(["x", "y", "z"].iter().position(|known| *known == axis)?)
                }
            },
        }
    }
}

const ONE_DELAY: [(&str, &str); 4] =
    [("mass_kg", "kg"), ("stiffness_n_per_m", "N/m"), ("damping_n_s_per_m", "N s/m"), ("delay_s", "s")];

const CELL: [(&str, &str); 7] = [
    ("plant.mass_kg", "kg"),
    ("contact.stiffness_n_per_m", "N/m"),
    ("contact.damping_n_s_per_m", "N s/m"),
    ("virtual_contact.stiffness_n_per_m", "N/m"),
    ("virtual_contact.damping_n_s_per_m", "N s/m"),
    ("timing.command_delay_s", "s"),
    ("timing.measurement_delay_s", "s"),
];

const SPACE: [(&str, &str); 6] = [
    ("chaser.mass_kg", "kg"),
    ("target.mass_kg", "kg"),
    ("contact.stiffness_n_per_m", "N/m"),
    ("contact.damping_n_s_per_m", "N s/m"),
    ("timing.command_delay_s", "s"),
    ("timing.measurement_delay_s", "s"),
];

/// Lists of three in a model with six axes.
const VIRTUAL: [(&str, &str); 4] = [
    ("stiffness_n_per_m", "N/m"),
    ("damping_n_s_per_m", "N s/m"),
    ("stiffness_n_m_per_rad", "N m/rad"),
    ("damping_n_m_s_per_rad", "N m s/rad"),
];
