//! Smith predictor and phase lead in one, without a model of the contact (Qi 2018; Li et al. 2026, eq. 13-15):
//!
//! `F = (F_lead + F_smith) / 2`, `F_lead = (1 + τ s) f`, `F_smith = [1 + τ s / (1 + τ s / 2) · (1 + τ s)] f`.
//!
//! F_smith is the predictor `f + G (1 - e^{-τ s}) u` with the undelayed force `G u` taken from the lead and `1 - e^{-τ s}` by Padé.
//! The lag `1 / (1 + τ s / 2)` is discretised as the lead is, by backward differences: `y = y₋ + T (g - y₋) / (T + τ/2)`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | τ | believed delay of the loop | s |
//! | T | tick of the loop | s |
//!
//! Benefit: the lead alone compensates too little, this predictor compensates to the second order in ω τ; no stiffness is needed.
//! Failure: noise is multiplied by 19.1 at τ = 9 T, more than by a lead, and the edges of a dead band are answered with impulses
//! (published: 1.015 and 0.653 instead of 1 and 0.729).

use super::phase_lead::PhaseLeadState;
use super::{DelayCompensation, Felt};
use crate::refusal::{Refusal, not_negative};
use serde::{Deserialize, Serialize};

/// The mean of a lead and of a predictor made from it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmithLead {
    /// Believed delay τ.
    pub delay_s: f64,
}

/// The lead's memory, and the lagged lead.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SmithLeadState {
    lead: PhaseLeadState,
    lagged_n: f64,
}

impl DelayCompensation for SmithLead {
    type State = SmithLeadState;

    fn start(&self, _period_s: f64) -> SmithLeadState {
        SmithLeadState::default()
    }

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        not_negative("delay_s", self.delay_s, "s").map(|_| ())
    }

    fn force_n(&self, state: &mut SmithLeadState, felt: &Felt) -> f64 {
        let lead_n = state.lead.lead_n(felt.force_n, self.delay_s, felt.period_s);
        let share = felt.period_s / (felt.period_s + 0.5 * self.delay_s);
        state.lagged_n += share * (lead_n - state.lagged_n);
        // τ s / (1 + τ s / 2) = 2 (1 - 1 / (1 + τ s / 2)).
        let smith_n = felt.force_n + 2.0 * (lead_n - state.lagged_n);
        0.5 * (lead_n + smith_n)
    }
}
