//! Smith predictor: `F = f + k (x⁺(t) - x⁺(t - τ))`, with x⁺ = max(x, 0) the commanded penetration.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k | believed stiffness of the contact | N/m |
//! | τ | believed delay of the loop | s |
//!
//! Benefit: with the right model the delayed force is exchanged for an undelayed one exactly, and noise of the sensor passes
//! unmultiplied. Failure: what the model has wrong stays delayed or counts twice (k wrong by 30 %: restitution 1.086 or 0.945; a
//! spring that stiffens: 1.122), and a contact that is not where the model has it appears at the wrong tick.

use super::ring::{Ring, within_reach};
use super::{DelayCompensation, Felt};
use crate::delay;
use crate::refusal::{Refusal, not_negative};
use serde::{Deserialize, Serialize};

/// A spring on the commanded pose, now minus then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmithPredictor {
    /// Believed stiffness k.
    pub stiffness_n_per_m: f64,
    /// Believed delay τ.
    pub delay_s: f64,
}

/// The commanded poses of the recent past.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SmithPredictorState {
    commanded: Ring,
}

impl DelayCompensation for SmithPredictor {
    type State = SmithPredictorState;

    fn start(&self, _period_s: f64) -> SmithPredictorState {
        SmithPredictorState::default()
    }

    fn check(&self, period_s: f64) -> Result<(), Refusal> {
        not_negative("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        not_negative("delay_s", self.delay_s, "s")?;
        within_reach("delay_s", self.delay_s, period_s)
    }

    fn force_n(&self, state: &mut SmithPredictorState, felt: &Felt) -> f64 {
        state.commanded.push(&felt.commanded, felt.period_s);
        let delayed_m = state.commanded.at(delay::steps(self.delay_s, felt.period_s));
        let missing_m = felt.commanded.position_m.max(0.0) - delayed_m.max(0.0);
        felt.force_n + self.stiffness_n_per_m * missing_m
    }
}
