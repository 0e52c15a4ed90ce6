//! Energy of each axis by itself (thesis Fig. 5.11): an axis that creates energy shows even where the sum is passive.
//!
//! Each axis' net load is paired with the mean of the satellites' velocity on that axis, over the whole run. A contact may move
//! energy from one axis to another (a cone turns travel into sideways motion), so that a single axis may rightly be active: only
//! the axes that the criterion names are judged.

use super::verdict::cannot;
use super::{Criterion, Missing, Observation, ObservedAxis, ObservedEnergy, Outcome, Verdict, Window, observed_energy};
use crate::energy::{Activity, Pairing};
use crate::refusal::Refusal;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

/// Axes that must not create energy.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnergyPerAxis {
    /// The axes that are judged; every observed one when the list is empty.
    pub axes: Vec<ObservedAxis>,
}

/// What one axis absorbed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisEnergy {
    /// The axis.
    pub axis: ObservedAxis,
    /// Absorbed energy, in J.
    pub value_j: f64,
    /// Half width of the noise band, in J.
    pub band_j: f64,
    /// What it did.
    pub activity: Activity,
}

/// The energy of each axis.
pub fn energy_per_axis(run: &Observation<'_>, axes: &[ObservedAxis]) -> Result<Vec<AxisEnergy>, Missing> {
    let observed: Vec<ObservedAxis> = run.along.iter().map(|along| along.axis).collect();
    let axes = if axes.is_empty() { &observed[..] } else { axes };
    let one = |axis: &ObservedAxis| {
        let pairing = Pairing::FeedbackWithSatelliteMean;
        let what = ObservedEnergy { pairing, axis: *axis, window: Window::Run, ..ObservedEnergy::default() };
        let energy = observed_energy(run, &what)?;
        let no_noise = || Missing(format!("no noise figure for axis {}", axis.name()));
        let band_j = 2.0 * energy.sd_j.ok_or_else(no_noise)? + energy.rounding_j;
        let activity = Activity::of(energy.value_j, band_j);
        Ok(AxisEnergy { axis: *axis, value_j: energy.value_j, band_j, activity })
    };
    axes.iter().map(one).collect()
}

impl EnergyPerAxis {
    /// Refuses an axis that is named twice.
    pub fn check(&self) -> Result<(), Refusal> {
        for (place, axis) in self.axes.iter().enumerate() {
            if self.axes[..place].contains(axis) {
                let limit = "is named twice";
                return Err(Refusal { name: "axes", value: place as f64 + 1.0, unit: "(place in the list)", limit });
            }
        }
        Ok(())
    }
}

impl Criterion for EnergyPerAxis {
    fn id(&self) -> &str {
        "energy-per-axis"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let energies = match energy_per_axis(run, &self.axes) {
            Ok(energies) => energies,
            Err(missing) => return cannot(self, "J", &missing),
        };
        let worst = energies.iter().min_by(|a, b| (a.value_j + a.band_j).total_cmp(&(b.value_j + b.band_j)));
        let Some(worst) = worst else { return cannot(self, "J", &Missing("no axis was observed".into())) };
        let active: Vec<&str> = named(&energies, Activity::Active);
        let listed: Vec<String> = energies.iter().map(listed).collect();
        let (outcome, head) = if active.is_empty() {
            (Outcome::Pass, "no axis creates energy".to_string())
        } else {
            (Outcome::Fail, format!("energy is created on {}", active.join(", ")))
        };
        Verdict {
            criterion: self.id().to_string(),
            outcome,
            value: Some(worst.value_j),
            uncertainty: Some(worst.band_j),
            limit: Some(0.0),
            margin: Some(worst.value_j),
            unit: "J",
            at: None,
            why: format!("{head}: {}; {}", listed.join(", "), Pairing::FeedbackWithSatelliteMean.words()),
        }
    }
}

fn named(energies: &[AxisEnergy], activity: Activity) -> Vec<&'static str> {
    energies.iter().filter(|energy| energy.activity == activity).map(|energy| energy.axis.name()).collect()
}

fn listed(energy: &AxisEnergy) -> String {
    format!("{} {:.3} mJ ({})", energy.axis.name(), energy.value_j * 1e3, energy.activity.word())
}
