//! Limits of what a run may reach: the largest force, the deepest penetration.
//!
//! The force is the sensor's, one sample, noise included: a limit that protects hardware counts what the hardware felt. Where no
//! sensor felt anything, it is the net force on the satellites. The depth is the interface's own where it is known, else the
//! reported position beyond the contact plane.

use super::verdict::{Finding, Range, judged};
use super::{Along, Criterion, Estimate, Missing, Observation, ObservedAxis, Verdict};
use crate::refusal::{Refusal, positive};
use crate::time::Nanos;
use alloc::string::String;
use serde::{Deserialize, Serialize};

/// Largest load of either sign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PeakForce {
    /// Axis; about an axis the load is a torque in N m.
    #[serde(default)]
    pub axis: ObservedAxis,
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
    pub about: &'static str,
}

/// The largest load of either sign on this axis.
pub fn peak_force(run: &Observation<'_>, axis: ObservedAxis) -> Result<Peak, Missing> {
    let along = run.along(axis)?;
    if let Some(sensed) = &along.sensed {
        return largest(sensed, &run.sensor_time, along.load_sd, "largest reading of the sensor, of either sign");
    }
    let net = along.net_load(run.mass_kg, run.tick_s()?)?;
    largest(&net, &run.loop_time, along.load_sd, "largest net force on the satellites, of either sign")
}

/// The deepest penetration.
pub fn peak_depth(run: &Observation<'_>) -> Result<Peak, Missing> {
    if let Some(depth) = &run.depth_m {
        let positive: alloc::vec::Vec<f64> = depth.iter().map(|depth| depth.max(0.0)).collect();
        return largest(&positive, &run.sensor_time, Some(0.0), "deepest penetration of the interface");
    }
    let along: &Along<'_> = run.along(ObservedAxis::Z)?;
    let measured = along.measured.as_ref().ok_or_else(|| along.no("measured position"))?;
    let plane_m = run.contact_plane_m.ok_or_else(|| Missing("no place of the contact plane".into()))?;
    let depth: alloc::vec::Vec<f64> = measured.iter().map(|position| (position - plane_m).max(0.0)).collect();
    largest(&depth, &run.loop_time, along.position_sd, "deepest reported position beyond the contact plane")
}

fn largest(values: &[f64], time: &[Nanos], sd: Option<f64>, about: &'static str) -> Result<Peak, Missing> {
    let sizes = values.iter().zip(time).filter(|(value, _)| value.is_finite());
    let largest = sizes.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let (value, at) = largest.ok_or_else(|| Missing("no sample".into()))?;
    Ok(Peak { value: Estimate { value: value.abs(), sd }, at: *at, about })
}

fn finding(peak: Peak, unit: &'static str) -> Finding {
    Finding { estimate: peak.value, unit, at: Some(peak.at), about: String::from(peak.about) }
}

impl PeakForce {
    fn unit(&self) -> &'static str {
        if self.axis.turns() { "N m" } else { "N" }
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
        judged(self, peak_force(run, self.axis).map(|peak| finding(peak, self.unit())), self.unit(), range)
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
