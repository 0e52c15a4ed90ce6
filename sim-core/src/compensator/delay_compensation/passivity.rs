//! Time-domain passivity: an observer of the port's energy, and a controller that pays back what the port created (Hannaford and
//! Ryu 2002).
//!
//! `E += T f v`, with E > 0 absorbed. When E < 0, the controller takes it back, and E = 0:
//!
//! | side | correction |
//! |---|---|
//! | force (impedance causality) | `F = f - E / (T v)` |
//! | velocity (admittance causality) | `v += -E / (T f)`: the command moves by `-E / f` and stays there |
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | f | felt force, positive resists | N |
//! | v | commanded velocity, positive closes | m/s |
//! | T | tick of the loop | s |
//!
//! Benefit of the force side: whatever creates the energy, the port does not give back more than it took. Failure: it clamps
//! restitution to about 1 and erases real damping (0.886 becomes 1.011), since the energy that damping took is credit for the
//! delay; it bursts near v = 0; a force and a velocity that are late by D against each other show a false k D.
//! The velocity side is here as a failure to be seen: it moves the commanded pose, in a contact, against the spring that measures
//! it, and the pose never comes back.

use super::{DelayCompensation, Felt};
use crate::refusal::Refusal;
use crate::space::AxisMotion;
use serde::{Deserialize, Serialize};

/// What is corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The force on the satellites.
    Force,
    /// The velocity that the robot is told.
    Velocity,
}

/// Observer and controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Passivity {
    /// What is corrected.
    pub side: Side,
}

/// The observed energy, and how far the command was moved.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PassivityState {
    energy_j: f64,
    moved_m: f64,
}

impl PassivityState {
    /// How far the velocity side has moved the command: it never comes back.
    pub fn moved_m(&self) -> f64 {
        self.moved_m
    }
}

impl DelayCompensation for Passivity {
    type State = PassivityState;

    fn start(&self, _period_s: f64) -> PassivityState {
        PassivityState::default()
    }

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        Ok(())
    }

    fn force_n(&self, state: &mut PassivityState, felt: &Felt) -> f64 {
        let velocity_m_per_s = felt.commanded.velocity_m_per_s;
        state.energy_j += felt.period_s * felt.force_n * velocity_m_per_s;
        // Energy is created only while both are different from zero.
        if state.energy_j >= 0.0 || felt.force_n * velocity_m_per_s == 0.0 {
            return felt.force_n;
        }
        let created_j = -core::mem::take(&mut state.energy_j);
        match self.side {
            Side::Force => felt.force_n + created_j / (felt.period_s * velocity_m_per_s),
            Side::Velocity => {
                state.moved_m += created_j / felt.force_n;
                felt.force_n
            }
        }
    }

    fn command(&self, state: &mut PassivityState, asked: &AxisMotion, _period_s: f64) -> AxisMotion {
        match self.side {
            Side::Force => *asked,
            Side::Velocity => AxisMotion { position_m: asked.position_m + state.moved_m, ..*asked },
        }
    }
}
