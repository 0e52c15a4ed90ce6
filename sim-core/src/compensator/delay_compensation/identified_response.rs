//! Response-error compensation with the stiffness found on line, by recursive least squares (Qi et al. 2017; He et al. 2022).
//!
//! While contact is felt at a penetration x̂ > 0: `f = φᵀθ`, φ = (x̂, x̂'), θ = (k, b),
//! `K = P φ / (λ + φᵀ P φ)`, `θ += K (f - φᵀθ)`, `P = (P - K φᵀ P) / λ`; then `F = f + k (x_c⁺ - x̂⁺)`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x̂, x̂' | measured pose moved on by σ, and its rate | m, m/s |
//! | k, b | stiffness and damping as found so far | N/m, N s/m |
//! | λ | forgetting: share of the past that is kept at each tick | |
//! | P | covariance over noise variance; 1e8 on its diagonal at the start: nothing is known. Chosen, not measured | |
//!
//! b is found so that it does not bend k, and is not used: the response error has no velocity that is not late.
//! Benefit: no stiffness need be known, and one that changes is followed. Failure: the first ticks of a contact, where k is not
//! known yet, are compensated by what was believed before; a pose that is late by D shows a false damping of k D; with λ = 1 it
//! does not follow, with λ < 1 it forgets while nothing moves.

use super::response_error::ResponseErrorState;
use super::{DelayCompensation, Felt};
use crate::refusal::{Refusal, not_negative, positive};
use serde::{Deserialize, Serialize};

/// Nothing is known.
const FIRST_COVARIANCE: f64 = 1e8;

/// A spring between command and response that is found on line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdentifiedResponse {
    /// Stiffness that is believed before the first contact.
    pub initial_stiffness_n_per_m: f64,
    /// Forgetting λ, above 0 and at most 1.
    pub forgetting: f64,
    /// Forward shift σ of the measurement.
    pub forward_s: f64,
}

/// What was found so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IdentifiedResponseState {
    response: ResponseErrorState,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    /// Covariance: stiffness, both, damping.
    covariance: [f64; 3],
}

impl IdentifiedResponseState {
    /// Stiffness as found so far.
    pub fn stiffness_n_per_m(&self) -> f64 {
        self.stiffness_n_per_m
    }

    /// Damping as found so far.
    pub fn damping_n_s_per_m(&self) -> f64 {
        self.damping_n_s_per_m
    }

    fn learn(&mut self, forgetting: f64, force_n: f64, depth_m: f64, rate_m_per_s: f64) {
        let [kk, kb, bb] = self.covariance;
        let (along_k, along_b) = (kk * depth_m + kb * rate_m_per_s, kb * depth_m + bb * rate_m_per_s);
        let spread = forgetting + depth_m * along_k + rate_m_per_s * along_b;
        let missing_n = force_n - self.stiffness_n_per_m * depth_m - self.damping_n_s_per_m * rate_m_per_s;
        self.stiffness_n_per_m += along_k / spread * missing_n;
        self.damping_n_s_per_m += along_b / spread * missing_n;
        self.covariance = [
            (kk - along_k * along_k / spread) / forgetting,
            (kb - along_k * along_b / spread) / forgetting,
            (bb - along_b * along_b / spread) / forgetting,
        ];
    }
}

impl DelayCompensation for IdentifiedResponse {
    type State = IdentifiedResponseState;

    fn start(&self, _period_s: f64) -> IdentifiedResponseState {
        IdentifiedResponseState {
            response: ResponseErrorState::default(),
            stiffness_n_per_m: self.initial_stiffness_n_per_m,
            damping_n_s_per_m: 0.0,
            covariance: [FIRST_COVARIANCE, 0.0, FIRST_COVARIANCE],
        }
    }

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        not_negative("initial_stiffness_n_per_m", self.initial_stiffness_n_per_m, "N/m")?;
        positive("forgetting", self.forgetting, "")?;
        not_negative("forward_s", self.forward_s, "s")?;
        if self.forgetting > 1.0 {
            return Err(Refusal { name: "forgetting", value: self.forgetting, unit: "", limit: "is above 1" });
        }
        Ok(())
    }

    fn force_n(&self, state: &mut IdentifiedResponseState, felt: &Felt) -> f64 {
        let (response_m, rate_m_per_s) = state.response.forward(felt, self.forward_s);
        if felt.force_n != 0.0 && response_m > 0.0 {
            state.learn(self.forgetting, felt.force_n, response_m, rate_m_per_s);
        }
        let missing_m = felt.commanded.position_m.max(0.0) - response_m.max(0.0);
        felt.force_n + state.stiffness_n_per_m * missing_m
    }
}
