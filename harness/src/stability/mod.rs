//! Is this loop stable, how far from the edge, and who is to blame: an operator's questions, answered by `sim_core::stability`.
//!
//! | file | what |
//! |---|---|
//! | `subject` | what is asked about: four numbers, or the cell of a model |
//! | `cell` | the linear loop of a cell, and its delay budget |
//! | `answer` | the answer as data |
//! | `space` | a cell with six axes |
//! | `domain` | the stable domain over two parameters |

mod answer;
mod cell;
mod domain;
mod space;
mod subject;

pub use answer::{Answer, Budgeted, Edges, Margin, OneSided, Sampled, assess};
pub use domain::{Domain, Side, sides};
pub use space::{RootAnswer, SpaceAnswer, assess_space};
pub use subject::{Cell, OneDelay, Subject};

use cell::Linear;
use nalgebra::DMatrix;
use sim_core::refusal::Refusal;
use sim_core::stability::exact;
use sim_core::stability::spectral::{DelayedForce, DelayedSystem};

/// The rate at which the slowest motion of the loop grows, in 1/s; below 0 it is stable. `None` where it cannot be told: input
/// without meaning, such as a line to a command that is not known yet, or a delay of more ticks than the prediction holds.
fn growth_per_s(subject: &Subject) -> Option<f64> {
    growth(subject).ok()
}

fn growth(subject: &Subject) -> Result<f64, Refusal> {
    match subject {
        Subject::OneDelay(one) => {
            let matrix = |value: f64| DMatrix::from_element(1, 1, value);
            let force = DelayedForce::spring_dashpot(
                one.delay_s.unwrap_or(0.0),
                matrix(one.stiffness_n_per_m),
                matrix(one.damping_n_s_per_m),
            );
            let spectrum = DelayedSystem::mechanical(&matrix(one.mass_kg), &[force])?.rightmost(1)?;
            Ok(spectrum.roots.first().map_or(0.0, |root| root.growth_per_s))
        }
        Subject::Cell(cell) => {
            let linear = Linear::of(cell);
            if linear.tool_mass_kg >= cell.model.plant.mass_kg {
                return Ok(f64::INFINITY);
            }
            Ok(libm::log(linear.sampled.growth_per_tick()?) / linear.sampled.tick_s)
        }
        Subject::Space(model) => space::growth_per_s(model),
    }
}

/// Whether the loop is stable: by the closed form where there is one. `None` where it cannot be told.
fn is_stable(subject: &Subject) -> Option<bool> {
    match subject {
        Subject::OneDelay(one) => {
            let delay_s = one.delay_s.unwrap_or(0.0);
            if one.stiffness_n_per_m < 0.0 {
                return growth_per_s(subject).map(|_| false);
            }
            if one.stiffness_n_per_m == 0.0 {
                // A damper alone: see `answer`.
                let turn = one.damping_n_s_per_m * delay_s / one.mass_kg;
                return Some(one.damping_n_s_per_m > 0.0 && turn < std::f64::consts::FRAC_PI_2);
            }
            let found = exact::assess(one.mass_kg, one.stiffness_n_per_m, one.damping_n_s_per_m, delay_s);
            found.ok().map(|assessment| assessment.stable)
        }
        Subject::Cell(_) | Subject::Space(_) => growth_per_s(subject).map(|growth| growth < 0.0),
    }
}
