//! Phase lead on the force: `F = f + τ (f - f₋) / T`, the discrete `(1 + τ s) f` (Qi et al. 2016).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | τ | believed delay of the loop | s |
//! | f₋ | felt force of the tick before | N |
//! | T | tick of the loop | s |
//!
//! Benefit: it needs no model of the contact; stiffness does not matter, stiffening hardly. Failure: it multiplies white noise
//! of the sensor by √((1 + τ/T)² + (τ/T)²), 13.5 at τ = 9 T; it answers the edge of a contact, or of a dead band, with an impulse;
//! it leaves the second order (ω τ)²/2.

use super::{DelayCompensation, Felt};
use crate::refusal::{Refusal, not_negative};
use serde::{Deserialize, Serialize};

/// Force moved on with its own rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseLead {
    /// Believed delay τ.
    pub delay_s: f64,
}

/// The felt force of the tick before; none before the first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PhaseLeadState {
    before_n: Option<f64>,
}

impl PhaseLeadState {
    /// `(1 + τ s) f` by a backward difference.
    pub(super) fn lead_n(&mut self, force_n: f64, delay_s: f64, period_s: f64) -> f64 {
        let before_n = self.before_n.replace(force_n).unwrap_or(force_n);
        force_n + delay_s * (force_n - before_n) / period_s
    }
}

impl DelayCompensation for PhaseLead {
    type State = PhaseLeadState;

    fn start(&self, _period_s: f64) -> PhaseLeadState {
        PhaseLeadState::default()
    }

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        not_negative("delay_s", self.delay_s, "s").map(|_| ())
    }

    fn force_n(&self, state: &mut PhaseLeadState, felt: &Felt) -> f64 {
        state.lead_n(felt.force_n, self.delay_s, felt.period_s)
    }
}
