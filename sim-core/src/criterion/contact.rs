//! When the interfaces touched, by the force that was felt.
//!
//! From the largest force outward to the first sample on either side that does not exceed the threshold, and a straight line
//! between that sample and its neighbour; the same at three times the threshold (at least 0.1, at most 0.9 of the largest
//! force). The line through the two crossings, down to no force, is the touch: a threshold alone would make a soft contact short
//! by what the force needs to reach it. On a half sine three thresholds high by 0.4 the line is 0.005 rad early, 1.3 ms of
//! 765 ms.
//!
//! The threshold is five standard deviations of the reading (a sample at rest exceeds it once in 3 million); 0.1 N where nobody
//! knows the noise; nothing where there is none. Of several contacts the one with the largest force counts.

use super::{Along, Missing, Observation};
use crate::time::Nanos;
use alloc::format;

/// Threshold in standard deviations of the reading.
const THRESHOLD_SIGMAS: f64 = 5.0;
/// Threshold where the noise is not known, in N. Chosen: below the sensor's error of 0.25 N nothing is a contact, and a
/// contact of 1 kN/m at 35 mm/s passes it in 3 ms.
const THRESHOLD_UNKNOWN_N: f64 = 0.1;

/// One contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// First touch, in s.
    pub begin_s: f64,
    /// Last touch, in s.
    pub end_s: f64,
    /// When the force was largest.
    pub peak_at: Nanos,
    /// The largest force: one sample, noise included, in N.
    pub peak_n: f64,
    /// What the force had to exceed, in N.
    pub threshold_n: f64,
    /// How steeply the force rises from the threshold at the begin, and falls to it at the end, in N/s; both positive.
    pub slopes_n_per_s: [f64; 2],
    /// Which force it was.
    pub by: &'static str,
}

/// The threshold of contact on this axis.
pub(super) fn threshold_n(along: &Along<'_>) -> f64 {
    along.load_sd.map_or(THRESHOLD_UNKNOWN_N, |sd| THRESHOLD_SIGMAS * sd)
}

/// The contact along this axis: by the sensor where it felt one, else by the net force on the satellites.
pub fn contact(run: &Observation<'_>, along: &Along<'_>) -> Result<Contact, Missing> {
    let threshold_n = threshold_n(along);
    let sensed =
        along.sensed.as_ref().map(|force| within(force, &run.sensor_time, threshold_n, "reading of the sensor"));
    match sensed {
        Some(Ok(contact)) => Ok(contact),
        // A virtual contact is felt by the satellites alone.
        _ => match run.tick_s().and_then(|tick_s| along.net_load(run.mass_kg, tick_s)) {
            Ok(force) => within(&force, &run.loop_time, threshold_n, "net force on the satellites"),
            Err(missing) => Err(sensed.and_then(Result::err).unwrap_or(missing)),
        },
    }
}

/// The net force's own contact: what the satellites felt, delays and virtual contact included.
pub(super) fn net_contact(run: &Observation<'_>, along: &Along<'_>) -> Result<Contact, Missing> {
    let force = along.net_load(run.mass_kg, run.tick_s()?)?;
    within(&force, &run.loop_time, threshold_n(along), "net force on the satellites")
}

/// The contact in these samples.
pub(super) fn within(force: &[f64], time: &[Nanos], threshold_n: f64, by: &'static str) -> Result<Contact, Missing> {
    let length = force.len().min(time.len());
    let force = &force[..length];
    let none = || Missing(format!("no contact: the {by} never exceeds {threshold_n:.3} N"));
    let peak = (0..length).max_by(|&a, &b| force[a].total_cmp(&force[b])).ok_or_else(none)?;
    let is_peak = force[peak].is_finite() && force[peak] > 2.0 * threshold_n;
    if !is_peak {
        return Err(none());
    }
    let far_n = (3.0 * threshold_n).clamp(0.1 * force[peak], 0.9 * force[peak]);
    let crossing = |level_n: f64| {
        let before = (0..peak).rev().find(|&i| force[i] <= level_n)?;
        let after = (peak + 1..length).find(|&i| force[i] <= level_n)?;
        let at = |low: usize, high: usize| {
            let share = (level_n - force[low]) / (force[high] - force[low]);
            let (low_s, high_s) = (time[low].seconds(), time[high].seconds());
            low_s + share * (high_s - low_s)
        };
        Some([at(before, before + 1), at(after, after - 1)])
    };
    let outside = || Missing(format!("the run begins or ends in contact, by the {by}"));
    let (near, far) = (crossing(threshold_n).ok_or_else(outside)?, crossing(far_n).ok_or_else(outside)?);
    // From the threshold outward as far as the line takes to lose the rest.
    let rest = threshold_n / (far_n - threshold_n);
    let slope = |edge: usize| (far_n - threshold_n) / (far[edge] - near[edge]).abs();
    Ok(Contact {
        begin_s: near[0] - rest * (far[0] - near[0]),
        end_s: near[1] - rest * (far[1] - near[1]),
        peak_at: time[peak],
        peak_n: force[peak],
        threshold_n,
        slopes_n_per_s: [slope(0), slope(1)],
        by,
    })
}
