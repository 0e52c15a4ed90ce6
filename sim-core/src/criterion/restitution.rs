//! Restitution from average speeds before and after contact, by either definition of the release.
//!
//! `e = v₊ / v₋`. The speed before is the average over 100 ms that end 20 ms before the first touch. The speed after depends on
//! the definition: the average over 100 ms that begin 60 ms (two delays of 16 ms and a few ticks) after
//!
//! | definition | the instant at which |
//! |---|---|
//! | release at d = 0 | the position is back where contact began |
//! | release at f = 0 | the net force on the satellites is back at nothing |
//!
//! Where the net force pulls after f = 0, no average after that instant would be one of free flight: the speed at the instant is
//! taken. There it is at its extreme, so that an instant that is a tick off costs only the second order.
//!
//! `u_e² = e² ((u₋/v₋)² + (u₊/v₊)²) + (u_n/v₋)²`, with u_n = σ √(T T_c) / m: the speed that white noise of the sensor gives
//! to the satellites during the contact.

use super::contact::{net_contact, threshold_n};
use super::verdict::{Finding, Range, judged};
use super::{Along, Criterion, Estimate, Missing, Observation, ObservedAxis, Verdict, contact, mean_velocity};
use crate::refusal::Refusal;
use crate::restitution::{Release, from_speeds};
use crate::time::Nanos;
use alloc::format;
use alloc::string::String;
use serde::{Deserialize, Serialize};

/// Length of a window of average speed. Chosen: 25 ticks of 4 ms.
const WINDOW_S: f64 = 0.100;
/// From the end of the window before to the first touch. Chosen: a threshold of five sigma is passed within it.
const GUARD_S: f64 = 0.020;
/// From the release to the window after: two delays of 16 ms and a few ticks.
const SETTLE_S: f64 = 0.060;

/// A limit of the restitution.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Restitution {
    /// Definition of the release.
    pub release: Release,
    /// Axis of travel.
    pub axis: ObservedAxis,
    /// Smallest that passes.
    pub at_least: Option<f64>,
    /// Largest that passes.
    pub at_most: Option<f64>,
}

/// Average speeds of a contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Speeds {
    /// Before, positive closing, in m/s.
    pub before: Estimate,
    /// After, positive closing, in m/s.
    pub after: Estimate,
    /// The instant of release, in s.
    pub release_s: f64,
    /// `e` with its standard deviation.
    pub restitution: Estimate,
    /// How the speeds were had.
    pub about: String,
}

/// Average speeds and restitution along this axis.
pub fn speeds(run: &Observation<'_>, axis: ObservedAxis, release: Release) -> Result<Speeds, Missing> {
    let along = run.along(axis)?;
    let touched = contact(run, along)?;
    let before = approach(run, along, touched.begin_s)?;
    if before.value <= 0.0 {
        return Err(Missing(format!("the approach speed is {:.6} m/s, not above 0", before.value)));
    }
    let depth_s = back_at_zero_depth(run, along, touched.begin_s, touched.peak_at);
    let force_s = net_contact(run, along).map(|net| net.end_s);
    let released = |instant: Result<f64, Missing>| {
        let release_s = instant?;
        let from_s = release_s + SETTLE_S;
        Ok((release_s, mean_velocity(run, along, from_s, from_s + WINDOW_S)?, "average speeds of 100 ms"))
    };
    let (release_s, after, about) = match release {
        Release::ZeroDepth => released(depth_s)?,
        Release::ZeroForce => match (&force_s, &depth_s) {
            (Ok(force_s), depth_s) if pulls(run, along, *force_s, depth_s.as_ref().ok().copied())? => {
                let about = "speed at f = 0 itself, since the net force pulls afterwards";
                (*force_s, speed_at(run, along, *force_s)?, about)
            }
            // Without the net force the sensor tells when nothing is felt.
            _ => released(force_s.or(Ok(touched.end_s)))?,
        },
    };
    let value = from_speeds(before.value, after.value);
    let noise = impulse_sd_m_per_s(run, along, touched.end_s - touched.begin_s);
    let part = |speed: Estimate| speed.sd.unwrap_or(0.0) / before.value;
    let after_part = part(after);
    let before_part = value * part(before);
    let noise_part = noise / before.value;
    let sd = libm::sqrt(after_part * after_part + before_part * before_part + noise_part * noise_part);
    let about = format!("{}, {about}", release.words());
    Ok(Speeds { before, after, release_s, restitution: Estimate { value, sd: Some(sd) }, about })
}

/// Average speed before the first touch; the very first velocity where contact comes sooner.
pub(super) fn approach(run: &Observation<'_>, along: &Along<'_>, begin_s: f64) -> Result<Estimate, Missing> {
    let window = mean_velocity(run, along, begin_s - GUARD_S - WINDOW_S, begin_s - GUARD_S);
    let first = along.before.as_ref().and_then(|before| before.first().copied());
    match (window, first) {
        (Ok(speed), _) => Ok(speed),
        (Err(_), Some(first)) => Ok(Estimate::exact(first)),
        (Err(missing), None) => Err(missing),
    }
}

/// When the position is back on the contact plane, on the side of departure.
fn back_at_zero_depth(run: &Observation<'_>, along: &Along<'_>, begin_s: f64, peak_at: Nanos) -> Result<f64, Missing> {
    let positions = along.measured.as_ref().or(along.commanded.as_ref());
    let positions = positions.ok_or_else(|| along.no("position"))?;
    let begin = run.ticks(begin_s, f64::INFINITY).start.min(positions.len().saturating_sub(1));
    let plane_m = run.contact_plane_m.unwrap_or(positions[begin]);
    let start = run.ticks(peak_at.seconds(), f64::INFINITY).start.max(1);
    // The reported pose is late: it may still be before the plane when the force peaks.
    let deepest = (start..positions.len()).max_by(|&a, &b| positions[a].total_cmp(&positions[b]));
    let deepest = deepest.ok_or_else(|| along.no("position after the peak of the force"))?;
    let out = (deepest + 1..positions.len().min(run.loop_time.len())).find(|&tick| positions[tick] <= plane_m);
    let out = out.ok_or_else(|| Missing("the position never comes back to where contact began".into()))?;
    let (low, high) = (positions[out], positions[out - 1]);
    let share = if high > low { (plane_m - low) / (high - low) } else { 0.0 };
    let (late_s, early_s) = (run.loop_time[out].seconds(), run.loop_time[out - 1].seconds());
    Ok(late_s - share * (late_s - early_s))
}

/// Whether the net force pulls between these instants by more than noise.
fn pulls(run: &Observation<'_>, along: &Along<'_>, from_s: f64, to_s: Option<f64>) -> Result<bool, Missing> {
    let net = along.net_load(run.mass_kg, run.tick_s()?)?;
    let ticks = run.ticks(from_s, to_s.unwrap_or(f64::INFINITY));
    let inside = net.get(ticks).unwrap_or_default();
    let noise = threshold_n(along);
    // Without a threshold only rounding is left: as many units in the last place as there are terms in a sum of four.
    let rounding = 4.0 * f64::EPSILON * net.iter().fold(0.0, |largest: f64, force| largest.max(force.abs()));
    Ok(inside.iter().any(|force| *force < -noise.max(rounding)))
}

/// Velocity of the satellites at an instant, on the line between two ticks.
fn speed_at(run: &Observation<'_>, along: &Along<'_>, at_s: f64) -> Result<Estimate, Missing> {
    let before = along.before.as_ref().ok_or_else(|| along.no("velocity of the satellites"))?;
    let next = run.ticks(at_s, f64::INFINITY).start;
    if next == 0 || next >= before.len() {
        return Err(Missing("the release lies outside the run".into()));
    }
    let (early_s, late_s) = (run.loop_time[next - 1].seconds(), run.loop_time[next].seconds());
    let share = (at_s - early_s) / (late_s - early_s);
    Ok(Estimate::exact(before[next - 1] + share * (before[next] - before[next - 1])))
}

/// What white noise of the sensor does to the speed during a contact: `σ √(T T_c) / m`, in m/s; nothing where a table or a
/// motion capture measured, since no sensor drives those.
fn impulse_sd_m_per_s(run: &Observation<'_>, along: &Along<'_>, duration_s: f64) -> f64 {
    match (run.mass_kg, along.load_sd, run.tick_s(), along.after.is_some()) {
        (Some(mass_kg), Some(sd), Ok(tick_s), true) => sd * libm::sqrt(tick_s * duration_s) / mass_kg,
        _ => 0.0,
    }
}

impl Restitution {
    fn range(&self) -> Range {
        Range { at_least: self.at_least, at_most: self.at_most }
    }

    /// Refuses limits without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        self.range().check(["at_least", "at_most"], "1")
    }
}

impl Criterion for Restitution {
    fn id(&self) -> &str {
        "restitution"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let found = speeds(run, self.axis, self.release).map(|speeds| Finding {
            estimate: speeds.restitution,
            unit: "1",
            at: Some(Nanos::from_seconds(speeds.release_s)),
            about: format!(
                "{}: {:.4} m/s before, {:.4} m/s after",
                speeds.about, speeds.before.value, speeds.after.value
            ),
        });
        judged(self, found, "1", self.range())
    }
}
