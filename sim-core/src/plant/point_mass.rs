//! The relative motion of two satellites along one axis: a point of the reduced mass.
//!
//! With `v' = v - F T/m`, a force F that is held for one tick moves the point by one of three rules:
//!
//! | integrator | rule | lag that it adds to the loop |
//! |---|---|---|
//! | exact hold | `x += v T - F T²/(2m)` | T/2, that of the hold itself |
//! | semi-implicit | `x += v' T` | none |
//! | explicit | `x += v T` | T |
//!
//! The lag acts on the stiffness path: it injects energy like a damping of -k T/2 or -k T (`reference/PHYSICS.md`, section 2.2).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass m_C m_T / (m_C + m_T) | kg |
//! | T | tick of the satellite computer | s |
//! | F | net force, positive resists closing | N |
//!
//! Not modelled: rotation, orbital motion.

use super::Plant;
use crate::space::{Axis, AxisMotion};
use crate::time::Step;
use serde::{Deserialize, Serialize};

/// How the position follows from a force that is held for one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Exact for a force that is held.
    #[default]
    ExactHold,
    /// The new velocity moves the point.
    SemiImplicit,
    /// The old velocity moves the point.
    Explicit,
}

/// A point mass on one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointMass {
    /// Reduced mass.
    pub mass_kg: f64,
    /// How it is integrated; files that do not say hold exactly.
    #[serde(default)]
    pub integrator: Integrator,
}

impl PointMass {
    /// A point of this reduced mass, integrated exactly.
    pub fn of_mass(mass_kg: f64) -> Self {
        PointMass { mass_kg, integrator: Integrator::ExactHold }
    }
}

/// Where it is and how fast it moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointMassState {
    /// Position; positive z closes the gap.
    pub position_m: f64,
    /// Its rate.
    pub velocity_m_per_s: f64,
}

impl Plant<Axis> for PointMass {
    type State = PointMassState;

    fn start(&self, first: &AxisMotion) -> PointMassState {
        PointMassState { position_m: first.position_m, velocity_m_per_s: first.velocity_m_per_s }
    }

    fn motion(&self, state: &PointMassState) -> AxisMotion {
        AxisMotion::moving(state.position_m, state.velocity_m_per_s)
    }

    fn step(&self, state: &mut PointMassState, step: Step, feedback: &f64) {
        let tick_s = step.dt.seconds();
        let change_m_per_s = feedback * tick_s / self.mass_kg;
        state.position_m += match self.integrator {
            Integrator::ExactHold => {
                state.velocity_m_per_s * tick_s - feedback * tick_s * tick_s / (2.0 * self.mass_kg)
            }
            Integrator::SemiImplicit => (state.velocity_m_per_s - change_m_per_s) * tick_s,
            Integrator::Explicit => state.velocity_m_per_s * tick_s,
        };
        state.velocity_m_per_s -= change_m_per_s;
    }
}
