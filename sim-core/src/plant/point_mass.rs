//! The relative motion of two satellites along one axis: a point of the reduced mass.
//!
//! A force that is held for one tick is integrated exactly: `x += v T - F T²/(2m)`, `v -= F T/m`.
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

/// A point mass on one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointMass {
    /// Reduced mass.
    pub mass_kg: f64,
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
        state.position_m += state.velocity_m_per_s * tick_s - feedback * tick_s * tick_s / (2.0 * self.mass_kg);
        state.velocity_m_per_s -= feedback * tick_s / self.mass_kg;
    }
}
