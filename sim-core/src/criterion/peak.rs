//! Limits of what a run may reach: the largest force, the deepest penetration.
//!
//! The force is the sensor's, one sample, noise included: a limit that protects hardware counts what the hardware felt. Where no
//! sensor felt a contact and the satellites did, as in a loop that is all software, it is the net force on the satellites. Where more than one translation was observed, the force is a vector
//! and its size is judged, `√(Fx² + Fy² + Fz²)`, unless the criterion names one axis: hardware breaks sideways too. Noise makes a
//! size larger, never smaller. The depth is the interface's own where it is known, else the
//! reported position beyond the contact plane.

use super::contact::threshold_n;
use super::verdict::{Finding, Range, judged};
use super::{Along, Criterion, Estimate, Missing, Observation, ObservedAxis, Verdict};
use crate::refusal::{Refusal, positive};
use crate::time::Nanos;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

/// Largest force: the size of the vector, or one axis of either sign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PeakForce {
    /// One axis alone; about an axis the load is a torque in N m. Without it the whole force counts.
    #[serde(default)]
    pub axis: Option<ObservedAxis>,
    /// Largest that passes, in N (about an axis in N m).
    pub at_most_n: f64,
}

/// Deepest penetration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PeakDepth {
    /// Deepest that passes, in m.
    pub at_most_m: f64,
}

/// A largest value and when it was.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// The value.
    pub value: Estimate,
    /// When it was.
    pub at: Nanos,
    /// Which signal it was.
    pub about: String,
}

/// The largest load of either sign on this axis.
pub fn peak_force(run: &Observation<'_>, axis: ObservedAxis) -> Result<Peak, Missing> {
    let along = run.along(axis)?;
    if let Some(sensed) = along.sensed.as_ref().filter(|_| !felt_by_satellites_alone(run, along)) {
        return largest(sensed, &run.sensor_time, along.load_sd, "largest reading of the sensor, of either sign");
    }
    let net = along.net_load(run.mass_kg, run.tick_s()?)?;
    largest(&net, &run.loop_time, along.load_sd, "largest net force on the satellites, of either sign")
}

/// Whether the sensor felt no contact where the net force shows one: twice the threshold of either.
fn felt_by_satellites_alone(run: &Observation<'_>, along: &Along<'_>) -> bool {
    let least = 2.0 * threshold_n(along);
    let pushes = |loads: &[f64]| loads.iter().any(|load| load.is_finite() && load.abs() > least);
    let net = run.tick_s().and_then(|tick_s| along.net_load(run.mass_kg, tick_s));
    along.sensed.as_deref().is_none_or(|sensed| !pushes(sensed)) && net.is_ok_and(|net| pushes(&net))
}

/// The largest force over every translation that was observed: the size of the vector, where there is more than one.
pub fn peak_force_size(run: &Observation<'_>) -> Result<Peak, Missing> {
    let along: Vec<&Along<'_>> = run.along.iter().filter(|along| !along.axis.turns()).collect();
    if let [one] = along[..] {
        return peak_force(run, one.axis);
    }
    if along.is_empty() {
        return Err(Missing("no force was observed".into()));
    }
    let sensed: Option<Vec<&[f64]>> = along.iter().map(|along| along.sensed.as_deref()).collect();
    let touches = |along: &&Along<'_>| {
        let least = 2.0 * threshold_n(along);
        along.sensed.as_deref().unwrap_or_default().iter().any(|load| load.abs() > least)
    };
    let unfelt = !along.iter().any(touches) && along.iter().any(|along| felt_by_satellites_alone(run, along));
    if let Some(sensed) = sensed.filter(|_| !unfelt) {
        return largest_size(&along, &sensed, &run.sensor_time, "readings of the sensor");
    }
    let tick_s = run.tick_s()?;
    let net: Result<Vec<_>, Missing> = along.iter().map(|along| along.net_load(run.mass_kg, tick_s)).collect();
    let net = net?;
    let parts: Vec<&[f64]> = net.iter().map(|part| &part[..]).collect();
    largest_size(&along, &parts, &run.loop_time, "net force on the satellites")
}

/// The largest size of a vector with these parts, and how it is made up. To first order its standard deviation is that of the
/// parts, each by its share of the size.
fn largest_size(along: &[&Along<'_>], parts: &[&[f64]], time: &[Nanos], of: &str) -> Result<Peak, Missing> {
    let length = parts.iter().map(|part| part.len()).min().unwrap_or(0);
    let size = |place: usize| libm::sqrt(parts.iter().map(|part| part[place] * part[place]).sum());
    let sizes: Vec<f64> = (0..length).map(size).collect();
    let mut peak = largest(&sizes, time, None, "")?;
    let place = time.partition_point(|at| *at < peak.at);
    let squares = along.iter().zip(parts).map(|(along, part)| {
        let share = if peak.value.value > 0.0 { part[place] / peak.value.value } else { 1.0 };
        along.load_sd.map(|sd| share * sd * share * sd)
    });
    peak.value.sd = squares.sum::<Option<f64>>().map(libm::sqrt);
    let listed = along.iter().zip(parts).map(|(along, part)| format!("{} {:.3} N", along.axis.name(), part[place]));
    let listed: Vec<String> = listed.collect();
    peak.about = format!("largest size of the force vector, by the {of}: {}", listed.join(", "));
    Ok(peak)
}

/// The deepest penetration.
pub fn peak_depth(run: &Observation<'_>) -> Result<Peak, Missing> {
    if let Some(depth) = &run.depth_m {
        let positive: Vec<f64> = depth.iter().map(|depth| depth.max(0.0)).collect();
        return largest(&positive, &run.sensor_time, Some(0.0), "deepest penetration of the interface");
    }
    let along: &Along<'_> = run.along(ObservedAxis::Z)?;
    let measured = along.measured.as_ref().ok_or_else(|| along.no("measured position"))?;
    let plane_m = run.contact_plane_m.ok_or_else(|| Missing("no place of the contact plane".into()))?;
    let depth: Vec<f64> = measured.iter().map(|position| (position - plane_m).max(0.0)).collect();
    largest(&depth, &run.loop_time, along.position_sd, "deepest reported position beyond the contact plane")
}

fn largest(values: &[f64], time: &[Nanos], sd: Option<f64>, about: &'static str) -> Result<Peak, Missing> {
    let sizes = values.iter().zip(time).filter(|(value, _)| value.is_finite());
    let largest = sizes.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let (value, at) = largest.ok_or_else(|| Missing("no sample".into()))?;
    Ok(Peak { value: Estimate { value: value.abs(), sd }, at: *at, about: about.into() })
}

fn finding(peak: Peak, unit: &'static str) -> Finding {
    Finding { estimate: peak.value, unit, at: Some(peak.at), about: peak.about }
}

impl PeakForce {
    fn unit(&self) -> &'static str {
        if self.axis.is_some_and(ObservedAxis::turns) { "N m" } else { "N" }
    }

    /// Refuses a limit without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        positive("at_most_n", self.at_most_n, self.unit()).map(|_| ())
    }
}

impl PeakDepth {
    /// Refuses a limit without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        positive("at_most_m", self.at_most_m, "m").map(|_| ())
    }
}

impl Criterion for PeakForce {
    fn id(&self) -> &str {
        "peak-force"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let range = Range { at_least: None, at_most: Some(self.at_most_n) };
        let peak = self.axis.map_or_else(|| peak_force_size(run), |axis| peak_force(run, axis));
        judged(self, peak.map(|peak| finding(peak, self.unit())), self.unit(), range)
    }
}

impl Criterion for PeakDepth {
    fn id(&self) -> &str {
        "peak-depth"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let range = Range { at_least: None, at_most: Some(self.at_most_m) };
        judged(self, peak_depth(run).map(|peak| finding(peak, "m")), "m", range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criterion::Outcome;
    use alloc::borrow::Cow;

    fn felt(axis: ObservedAxis, sensed: [f64; 2]) -> Along<'static> {
        Along { axis, sensed: Some(Cow::Owned(sensed.to_vec())), load_sd: Some(0.1), ..Along::default() }
    }

    /// 3 N across and 1 N along at one sample; 2 N along at another.
    fn pushed_aside() -> Observation<'static> {
        Observation {
            sensor_time: Cow::Owned([Nanos(0), Nanos(1_000_000)].to_vec()),
            along: [
                felt(ObservedAxis::X, [3.0, 0.0]),
                felt(ObservedAxis::Z, [1.0, -2.0]),
                felt(ObservedAxis::AboutX, [9.0; 2]),
            ]
            .to_vec(),
            ..Observation::default()
        }
    }

    #[test]
    fn a_limit_on_the_force_counts_what_pushes_across() {
        let run = pushed_aside();
        let of = |axis, at_most_n| PeakForce { axis, at_most_n }.judge(&run);
        let whole = of(None, 2.5);
        assert_eq!((whole.outcome, whole.at), (Outcome::Fail, Some(Nanos(0))), "{whole:?}");
        assert!((whole.value.unwrap() - libm::sqrt(10.0)).abs() < 1e-15, "{whole:?}");
        // All parts have the same noise, and so has the size: twice 0.1 N, three roundings.
        assert!((whole.uncertainty.unwrap() - 0.2).abs() < 1e-15, "{whole:?}");
        for word in ["size of the force vector", "x 3.000 N", "z 1.000 N"] {
            assert!(whole.why.contains(word), "{}", whole.why);
        }
        let along = of(Some(ObservedAxis::Z), 2.5);
        assert_eq!((along.outcome, along.value), (Outcome::Pass, Some(2.0)), "{along:?}");
        assert_eq!(of(Some(ObservedAxis::AboutX), 10.0).unit, "N m");
        let one = Observation { along: [felt(ObservedAxis::Z, [1.0, -2.0])].to_vec(), ..run.clone() };
        let one = PeakForce { axis: None, at_most_n: 2.5 }.judge(&one);
        assert_eq!((one.value, one.why.as_str()), (Some(2.0), "largest reading of the sensor, of either sign"));
    }

    /// A loop that is all software: the sensor is empty, the satellites feel 8 N.
    #[test]
    fn an_empty_sensor_is_not_the_largest_force() {
        let time = || Cow::Owned((0..4).map(|tick| Nanos(tick * 4_000_000)).collect::<Vec<_>>());
        let along =
            Along { feedback: Some(Cow::Owned([0.0, 8.0, 3.0, 0.0].to_vec())), ..felt(ObservedAxis::Z, [0.1, -0.2]) };
        let run =
            Observation { loop_time: time(), sensor_time: time(), along: [along].to_vec(), ..Observation::default() };
        let peak = peak_force_size(&run).unwrap();
        assert_eq!((peak.value.value, peak.at), (8.0, Nanos(4_000_000)), "{peak:?}");
        assert!(peak.about.contains("net force"), "{}", peak.about);
        // Where the sensor felt a contact, it is what the hardware felt.
        let hardware = Along { sensed: Some(Cow::Owned([0.0, 5.0].to_vec())), ..run.along[0].clone() };
        let run = Observation { along: [hardware].to_vec(), ..run };
        let peak = peak_force_size(&run).unwrap();
        assert!((peak.value.value - 5.0).abs() < f64::EPSILON, "{peak:?}");
    }
}
