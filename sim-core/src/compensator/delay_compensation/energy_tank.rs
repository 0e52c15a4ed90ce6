//! An energy tank: what the port absorbs fills it, what the port gives back drains it, and an empty tank gives nothing.
//!
//! `p = T f v`; if p < 0 and the level S < -p, the force is scaled to `F = f S / (-p)`; then `S += T F v`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | f | felt force, positive resists | N |
//! | v | commanded velocity, positive closes | m/s |
//! | S | level | J |
//!
//! Benefit: the force is never more than what was felt, unlike the bursts of a passivity controller. Failure: the initial level
//! is arbitrary, and each joule of it is a joule that the delay may create before anything acts (10 mJ: restitution 1.136, 1 mJ: 1.028);
//! real damping fills the tank and is given back, as with a passivity controller.

use super::{DelayCompensation, Felt};
use crate::refusal::{Refusal, not_negative};
use serde::{Deserialize, Serialize};

/// A tank with a first level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyTank {
    /// Level S before the first contact.
    pub initial_j: f64,
}

/// The level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyTankState {
    level_j: f64,
}

impl DelayCompensation for EnergyTank {
    type State = EnergyTankState;

    fn start(&self, _period_s: f64) -> EnergyTankState {
        EnergyTankState { level_j: self.initial_j }
    }

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        not_negative("initial_j", self.initial_j, "J").map(|_| ())
    }

    fn force_n(&self, state: &mut EnergyTankState, felt: &Felt) -> f64 {
        let absorbed_j = felt.period_s * felt.force_n * felt.commanded.velocity_m_per_s;
        if state.level_j + absorbed_j >= 0.0 {
            state.level_j += absorbed_j;
            return felt.force_n;
        }
        let share = state.level_j / -absorbed_j;
        state.level_j = 0.0;
        felt.force_n * share
    }
}
