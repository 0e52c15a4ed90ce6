//! Force compensation from the response error: `F = f + k (x_c⁺ - x̂⁺)`, `x̂ = x_m + σ (x_m - x_m₋) / T` (Qi et al. 2017).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k | believed stiffness of the contact | N/m |
//! | x_c | commanded pose | m |
//! | x_m, x_m₋ | measured pose, now and a tick before | m |
//! | σ | forward shift of the measurement: its believed delay, or 0 | s |
//! | T | tick of the loop | s |
//!
//! x⁺ = max(x, 0) is a penetration. Benefit: it covers whatever the robot does, and needs no delay of it. Failure: it takes the measured pose
//! for the pose that made the force. With a report that is 16 ms late and σ = 0 it over-compensates: restitution 0.915 instead of 1.
//! A wrong k fails as with a Smith predictor. Read-out noise is multiplied by k √((1 + σ/T)² + (σ/T)²).

use super::{DelayCompensation, Felt};
use crate::refusal::{Refusal, not_negative};
use serde::{Deserialize, Serialize};

/// A spring between command and response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResponseError {
    /// Believed stiffness k.
    pub stiffness_n_per_m: f64,
    /// Forward shift σ of the measurement.
    pub forward_s: f64,
}

/// The measured pose of the tick before; none before the first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ResponseErrorState {
    before_m: Option<f64>,
}

impl ResponseErrorState {
    /// The measured pose, moved on by `forward_s`, and its rate.
    pub(super) fn forward(&mut self, felt: &Felt, forward_s: f64) -> (f64, f64) {
        let measured_m = felt.measured.position_m;
        let before_m = self.before_m.replace(measured_m);
        let rate_m_per_s =
            before_m.map_or(felt.measured.velocity_m_per_s, |before_m| (measured_m - before_m) / felt.period_s);
        (measured_m + forward_s * rate_m_per_s, rate_m_per_s)
    }
}

impl DelayCompensation for ResponseError {
    type State = ResponseErrorState;

    fn start(&self, _period_s: f64) -> ResponseErrorState {
        ResponseErrorState::default()
    }

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        not_negative("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        not_negative("forward_s", self.forward_s, "s").map(|_| ())
    }

    fn force_n(&self, state: &mut ResponseErrorState, felt: &Felt) -> f64 {
        let (response_m, _) = state.forward(felt, self.forward_s);
        let missing_m = felt.commanded.position_m.max(0.0) - response_m.max(0.0);
        felt.force_n + self.stiffness_n_per_m * missing_m
    }
}
