//! No compensation: `F = f`. The loop creates the energy that its delay gives it.

use super::{DelayCompensation, Felt};
use crate::refusal::Refusal;
use serde::{Deserialize, Serialize};

/// Feels what the sensor feels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Uncompensated;

impl DelayCompensation for Uncompensated {
    type State = ();

    fn start(&self, _period_s: f64) {}

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        Ok(())
    }

    fn force_n(&self, _state: &mut (), felt: &Felt) -> f64 {
        felt.force_n
    }
}
