//! Distortion: how far the simulator's docking is from the ideal one without delay (thesis section 3.1).
//!
//! Two ratios, 1 being none: restitution of the rig over that of space, `e_HIL / e_space`, and the ratio of the largest forces.
//! The ideal is a spring and a dashpot without delay, in closed form ([`crate::restitution`]), at the mass and the approach
//! speed of the run itself.

use super::restitution::leave_open_without_rebound;
use super::verdict::{Finding, Range, judged};
use super::{Criterion, Estimate, Missing, Observation, ObservedAxis, Verdict, peak_force, speeds};
use crate::refusal::{Refusal, not_negative, positive};
use crate::restitution::{Release, peak_force_n, rebound};
use alloc::format;
use serde::{Deserialize, Serialize};

/// Which ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DistortionOf {
    /// `e_HIL / e_space`.
    #[default]
    Restitution,
    /// Ratio of the largest forces.
    PeakForce,
}

/// A limit of the distortion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Distortion {
    /// Which ratio.
    #[serde(default)]
    pub of: DistortionOf,
    /// Stiffness of the contact in space, in N/m.
    pub stiffness_n_per_m: f64,
    /// Damping of the contact in space, in N s/m.
    pub damping_n_s_per_m: f64,
    /// Definition of the release.
    #[serde(default)]
    pub release: Release,
    /// Smallest ratio that passes.
    #[serde(default)]
    pub at_least: Option<f64>,
    /// Largest ratio that passes.
    #[serde(default)]
    pub at_most: Option<f64>,
}

/// The ratio of a run to the ideal.
pub fn distortion(run: &Observation<'_>, what: &Distortion) -> Result<Estimate, Missing> {
    let mass_kg = run.mass_kg.ok_or_else(|| Missing("no mass".into()))?;
    let (stiffness, damping) = (what.stiffness_n_per_m, what.damping_n_s_per_m);
    let speeds = speeds(run, ObservedAxis::Z, what.release)?;
    let over = |found: Estimate, ideal: f64| Estimate { value: found.value / ideal, sd: found.sd.map(|sd| sd / ideal) };
    match what.of {
        DistortionOf::Restitution => {
            let ideal = rebound(what.release, mass_kg, stiffness, damping);
            let ideal = ideal.ok_or_else(|| Missing("in space the probe would not come back to d = 0".into()))?;
            Ok(over(speeds.restitution, ideal.restitution))
        }
        DistortionOf::PeakForce => {
            let ideal_n = peak_force_n(mass_kg, stiffness, damping, speeds.before.value);
            Ok(over(peak_force(run, ObservedAxis::Z)?.value, ideal_n))
        }
    }
}

impl Distortion {
    fn range(&self) -> Range {
        Range { at_least: self.at_least, at_most: self.at_most }
    }

    /// Refuses numbers without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        positive("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        not_negative("damping_n_s_per_m", self.damping_n_s_per_m, "N s/m")?;
        self.range().check(["at_least", "at_most"], "1")
    }
}

impl Criterion for Distortion {
    fn id(&self) -> &str {
        "distortion"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let what = match self.of {
            DistortionOf::Restitution => "restitution over that of the ideal docking without delay",
            DistortionOf::PeakForce => "largest force over that of the ideal docking without delay",
        };
        let found = distortion(run, self).map(|estimate| Finding {
            estimate,
            unit: "1",
            at: None,
            about: format!("{what}, {}", self.release.words()),
        });
        let mut verdict = judged(self, found, "1", self.range());
        if self.of == DistortionOf::Restitution {
            leave_open_without_rebound(&mut verdict);
        }
        verdict
    }
}
