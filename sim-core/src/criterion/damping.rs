//! Damping from the observed energy, with its interval: `b_obs = ΔE / Σ v² Δt` (thesis Fig. 4.11).
//!
//! It is the damping that a dashpot would have had to have to absorb the same at the same velocities. At the satellites' port it
//! is what is left of the contact's damping after the delays took their part, `b - k τ`: below zero the loop creates energy.
//! `u_b = u_E / Σ v² Δt`; the noise of the velocities themselves is of second order and left out.

use super::verdict::{Finding, Range, judged};
use super::{
    Criterion, Energy, Estimate, Missing, Observation, ObservedAxis, ObservedEnergy, Verdict, observed_energy,
};
use crate::energy::Pairing;
use crate::refusal::Refusal;
use alloc::format;
use serde::{Deserialize, Serialize};

/// A limit of the observed damping.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Damping {
    /// Which force with which velocity.
    pub pairing: Pairing,
    /// Axis.
    pub axis: ObservedAxis,
    /// Smallest that passes, in N s/m.
    pub at_least_n_s_per_m: Option<f64>,
    /// Largest that passes, in N s/m.
    pub at_most_n_s_per_m: Option<f64>,
}

/// Damping from an observed energy.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedDamping {
    /// In N s/m.
    pub damping: Estimate,
    /// The energy it was made from.
    pub energy: Energy,
}

/// Damping of this pairing over the contact.
pub fn observed_damping(
    run: &Observation<'_>,
    axis: ObservedAxis,
    pairing: Pairing,
) -> Result<ObservedDamping, Missing> {
    let energy = observed_energy(run, &ObservedEnergy { pairing, axis, ..ObservedEnergy::default() })?;
    if energy.motion_m2_per_s <= 0.0 {
        return Err(Missing("nothing moves".into()));
    }
    let value = energy.value_j / energy.motion_m2_per_s;
    let damping = Estimate { value, sd: energy.sd_j.map(|sd| sd / energy.motion_m2_per_s) };
    Ok(ObservedDamping { damping, energy })
}

impl Damping {
    fn range(&self) -> Range {
        Range { at_least: self.at_least_n_s_per_m, at_most: self.at_most_n_s_per_m }
    }

    /// Refuses limits without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        self.range().check(["at_least_n_s_per_m", "at_most_n_s_per_m"], "N s/m")
    }
}

impl Criterion for Damping {
    fn id(&self) -> &str {
        "damping"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let found = observed_damping(run, self.axis, self.pairing).map(|found| Finding {
            estimate: found.damping,
            unit: "N s/m",
            at: found.energy.lowest_at,
            about: format!(
                "{:.3} mJ over contact and 60 ms on either side; {}",
                found.energy.value_j * 1e3,
                self.pairing.words()
            ),
        });
        judged(self, found, "N s/m", self.range())
    }
}
