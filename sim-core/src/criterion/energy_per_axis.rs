//! Energy of each axis by itself (thesis Fig. 5.11): an axis that creates energy shows even where the sum is passive.
//!
//! Each axis' net load is paired with the mean of the satellites' velocity on that axis, over the whole run. A contact may move
//! energy from one axis to another (a cone turns travel into sideways motion), so that a single axis may rightly be active.
//! Without a list of axes the sum over all observed ones is judged, and the axes are told. With a list each named axis is judged
//! by itself. Either way an energy inside the noise band leaves it open: nothing can be said of it.

use super::verdict::cannot;
use super::{
    Bound, Criterion, Missing, Observation, ObservedAxis, ObservedEnergy, Outcome, Verdict, Window, observed_energy,
};
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
    /// The axes that are judged, each by itself; when the list is empty, the sum over all observed ones.
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
    /// Part of the band that is rounding, in J.
    pub rounding_j: f64,
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
        Ok(AxisEnergy { axis: *axis, value_j: energy.value_j, band_j, rounding_j: energy.rounding_j, activity })
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
        if energies.is_empty() {
            return cannot(self, "J", &Missing("no axis was observed".into()));
        }
        let Found { value_j, band_j, outcome, head } =
            if self.axes.is_empty() { found_in_sum(&energies) } else { found_in_each(&energies) };
        let listed: Vec<String> = energies.iter().map(listed).collect();
        Verdict {
            criterion: self.id().to_string(),
            outcome,
            value: Some(value_j),
            uncertainty: Some(band_j),
            limit: Some(0.0),
            bound: Some(Bound::AtLeast),
            margin: Some(value_j),
            unit: "J",
            at: None,
            why: format!("{head}: {}; {}", listed.join(", "), Pairing::FeedbackWithSatelliteMean.words()),
        }
    }
}

/// What is judged, and how.
struct Found {
    value_j: f64,
    band_j: f64,
    outcome: Outcome,
    head: String,
}

fn outcome(activity: Activity) -> Outcome {
    match activity {
        Activity::Passive => Outcome::Pass,
        Activity::Neutral => Outcome::Undecided,
        Activity::Active => Outcome::Fail,
    }
}

/// The sum: an exchange between axes cancels in it. The noise of the axes is independent, their rounding adds up.
fn found_in_sum(energies: &[AxisEnergy]) -> Found {
    let value_j = energies.iter().map(|energy| energy.value_j).sum();
    let noise = |energy: &AxisEnergy| energy.band_j - energy.rounding_j;
    let squares: f64 = energies.iter().map(|energy| noise(energy) * noise(energy)).sum();
    let rounding_j: f64 = energies.iter().map(|energy| energy.rounding_j).sum();
    let band_j = libm::sqrt(squares) + rounding_j;
    let activity = Activity::of(value_j, band_j);
    let what = match activity {
        Activity::Passive => "the axes together absorb energy",
        Activity::Neutral => "the axes together are inside the noise band, neither passive nor active",
        Activity::Active => "the axes together create energy",
    };
    let head =
        format!("{what}, {:.3} ± {:.3} mJ; an axis alone may gain what another loses", value_j * 1e3, band_j * 1e3);
    Found { value_j, band_j, outcome: outcome(activity), head }
}

/// The worst of the named axes: an active one, else a neutral one; of equals the one with the least above its band.
fn found_in_each(energies: &[AxisEnergy]) -> Found {
    let rank = |energy: &AxisEnergy| outcome(energy.activity);
    let worst = energies.iter().fold(energies[0], |worst, energy| {
        let is_lower = energy.value_j - energy.band_j < worst.value_j - worst.band_j;
        if (rank(energy), is_lower) > (rank(&worst), false) { *energy } else { worst }
    });
    let head = match worst.activity {
        Activity::Passive => "every named axis absorbs energy".to_string(),
        Activity::Neutral => format!("inside the noise band: {}", named(energies, Activity::Neutral).join(", ")),
        Activity::Active => {
            let axes = named(energies, Activity::Active).join(", ");
            format!("energy comes out of {axes}: created, or taken from another axis")
        }
    };
    Found { value_j: worst.value_j, band_j: worst.band_j, outcome: rank(&worst), head }
}

fn named(energies: &[AxisEnergy], activity: Activity) -> Vec<&'static str> {
    energies.iter().filter(|energy| energy.activity == activity).map(|energy| energy.axis.name()).collect()
}

fn listed(energy: &AxisEnergy) -> String {
    format!("{} {:.3} mJ ({})", energy.axis.name(), energy.value_j * 1e3, energy.activity.word())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criterion::Along;
    use crate::time::Nanos;
    use alloc::borrow::Cow;

    /// Two ticks of 1 s at 1 m/s: each axis absorbs twice its force. The noise is 0.1 N, the band of an axis 0.2 √2 J.
    fn run(forces_n: [f64; 3]) -> Observation<'static> {
        let ones = || Some(Cow::Owned([1.0; 2].to_vec()));
        let along = ObservedAxis::ALL.iter().zip(forces_n).map(|(axis, force_n)| Along {
            axis: *axis,
            feedback: Some(Cow::Owned([force_n; 2].to_vec())),
            before: ones(),
            after: ones(),
            load_sd: Some(0.1),
            ..Along::default()
        });
        let loop_time = Cow::Owned([Nanos(0), Nanos(1_000_000_000)].to_vec());
        Observation { loop_time, along: along.collect(), ..Observation::default() }
    }

    fn judged(forces_n: [f64; 3], axes: &[ObservedAxis]) -> Verdict {
        EnergyPerAxis { axes: axes.to_vec() }.judge(&run(forces_n))
    }

    #[test]
    fn an_exchange_between_axes_is_not_creation() {
        let found = judged([-1.0, -1.0, 3.0], &[]);
        assert_eq!(found.outcome, Outcome::Pass, "{found:?}");
        // Rounding of six products and their sums.
        assert!((found.value.unwrap() - 2.0).abs() < 1e-14, "{found:?}");
        // Three axes of 0.2 √2 J.
        assert!((found.uncertainty.unwrap() - 0.2 * libm::sqrt(6.0)).abs() < 1e-13, "{found:?}");
        assert!(
            found.why.contains("x -2000.000 mJ (active)") && found.why.contains("together absorb"),
            "{}",
            found.why
        );
        assert_eq!(judged([-1.0, -1.0, 1.0], &[]).outcome, Outcome::Fail);
        let named = judged([-1.0, 1.0, 3.0], &[ObservedAxis::X, ObservedAxis::Y]);
        assert_eq!((named.outcome, named.value), (Outcome::Fail, Some(-2.0)), "{named:?}");
        assert!(named.why.contains("comes out of x: created, or taken from another axis"), "{}", named.why);
    }

    #[test]
    fn an_energy_below_the_noise_leaves_it_open() {
        for axes in [&[][..], &[ObservedAxis::Z], &[ObservedAxis::X, ObservedAxis::Z]] {
            let open = judged([0.0, 0.0, -0.1], axes);
            assert_eq!((open.outcome, open.value), (Outcome::Undecided, Some(-0.2)), "{open:?}");
            assert!(open.why.contains("inside the noise band"), "{}", open.why);
        }
        let mixed = judged([0.1, 0.0, 3.0], &[ObservedAxis::Z, ObservedAxis::X]);
        assert_eq!((mixed.outcome, mixed.value), (Outcome::Undecided, Some(0.2)), "the neutral one decides: {mixed:?}");
        assert_eq!(judged([1.0, 0.0, 3.0], &[ObservedAxis::Z, ObservedAxis::X]).outcome, Outcome::Pass);
    }
}
