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
//! Where the net force pushes again after its first f = 0 and before the last touch, the contact was not over: its last f = 0 is the
//! release. An average that a further push falls into cannot be had.
//!
//! Where the net force pulls after f = 0, no average after that instant would be one of free flight: the speed at the instant is
//! taken. There it is at its extreme, so that an instant that is a tick off costs only the second order.
//!
//! A speed after that still closes is no rebound: whatever the limits are, such a run does not pass.
//!
//! `u_e² = e² ((u₋/v₋)² + (u₊/v₊)²) + (u_n/v₋)²`, with u_n = σ √(T T_c) / m: the speed that white noise of the sensor gives
//! to the satellites during the contact.

use super::contact::{net_contact, threshold_n};
use super::verdict::{Finding, Range, judged};
use super::{Along, Criterion, Estimate, Missing, Observation, ObservedAxis, Outcome, Verdict, contact, mean_velocity};
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

/// A speed of this many times that of the approach is no rebound. Chosen: a delay as long as a contact does not give back three times.
const RUNAWAY: f64 = 10.0;

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
    ran_away(run, along, before.value)?;
    let depth_s = back_at_zero_depth(run, along, touched.begin_s, touched.peak_at);
    let first_s = net_contact(run, along).map(|net| net.end_s);
    let resumed = first_s.as_ref().ok().map_or(Ok(None), |first_s| resumed_until(run, along, *first_s))?;
    let force_s = first_s.map(|first_s| resumed.unwrap_or(first_s));
    let released = |instant: Result<f64, Missing>| {
        let release_s = instant?;
        let from_s = release_s + SETTLE_S;
        if let Some(at_s) = pushes_at(run, along, from_s, from_s + WINDOW_S) {
            return Err(Missing(format!("it touches again at {at_s:.3} s, within 160 ms of {}", release.words())));
        }
        let about = format!("average speeds of 100 ms{}", turning(run, along, release_s, from_s));
        Ok((release_s, mean_velocity(run, along, from_s, from_s + WINDOW_S)?, about))
    };
    let (release_s, after, about) = match release {
        Release::ZeroDepth => released(depth_s)?,
        Release::ZeroForce => match (&force_s, &depth_s) {
            (Ok(force_s), depth_s) if pulls(run, along, *force_s, depth_s.as_ref().ok().copied())? => {
                let about = "speed at f = 0 itself, since the net force pulls afterwards";
                (*force_s, speed_at(run, along, *force_s)?, String::from(about))
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
    let again = match (release, resumed) {
        (Release::ZeroForce, Some(_)) => ", the last one, since the net force pushes again after the first",
        _ => "",
    };
    let about = format!("{}{again}, {about}", release.words());
    Ok(Speeds { before, after, release_s, restitution: Estimate { value, sd: Some(sd) }, about })
}

/// Refuses a run that ran away: its largest force is not that of a docking, and what it left behind is no contact's.
pub(super) fn ran_away(run: &Observation<'_>, along: &Along<'_>, approach_m_per_s: f64) -> Result<(), Missing> {
    let first = along.before.as_ref().and_then(|before| before.first().copied()).unwrap_or(0.0);
    // A rig that starts from rest has the speed of its approach.
    let usual = if first.abs() > 0.0 { first.abs() } else { approach_m_per_s.abs() };
    let speeds = along.after.as_deref().unwrap_or_default().iter().zip(run.loop_time.iter());
    let found = speeds.filter(|_| usual > 0.0).find(|(speed, _)| !speed.is_finite() || speed.abs() > RUNAWAY * usual);
    found.map_or(Ok(()), |(speed, at)| {
        Err(Missing(format!(
            "the run ran away: {speed:.3} m/s at {:.3} s, more than {RUNAWAY} times the {usual:.4} m/s of the approach",
            at.seconds()
        )))
    })
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

/// A tip that turns about the centre of its satellite changes its speed without a force: by how much from the release to the middle
/// of the average, where that is more than noise. Nothing along one axis.
fn turning(run: &Observation<'_>, along: &Along<'_>, release_s: f64, from_s: f64) -> String {
    let middle_s = from_s + 0.5 * WINDOW_S;
    let halves = (mean_velocity(run, along, from_s, middle_s), mean_velocity(run, along, middle_s, from_s + WINDOW_S));
    let (Ok(first), Ok(second)) = halves else { return String::new() };
    let change = second.value - first.value;
    let noise = 2.0 * (first.sd.unwrap_or(0.0) + second.sd.unwrap_or(0.0));
    if !run.along.iter().any(|along| along.axis.turns()) || change.abs() <= noise {
        return String::new();
    }
    let since_m_per_s = change / (0.5 * WINDOW_S) * (middle_s - release_s);
    format!(", in which the tip turns on: its speed has changed by {since_m_per_s:+.4} m/s since the release")
}

/// Where the net force pushes again after its first f = 0 and before the last touch: its last f = 0, on the line between two ticks.
fn resumed_until(run: &Observation<'_>, along: &Along<'_>, first_s: f64) -> Result<Option<f64>, Missing> {
    // Less than twice the threshold is no contact either.
    let least_n = 2.0 * threshold_n(along);
    let sensed = along.sensed.as_deref().unwrap_or_default();
    let felt_n = least_n.max(rounding_n(sensed));
    let touches = run.sensor_time.iter().zip(sensed).filter(|(_, force)| **force > felt_n);
    // What the satellites feel is late. A virtual contact is felt by them alone.
    let touched_s = touches.map(|(time, _)| time.seconds() + SETTLE_S).next_back().unwrap_or(f64::INFINITY);
    let net = along.net_load(run.mass_kg, run.tick_s()?)?;
    // From where the force at f = 0 is below noise: the line to no force leads some ticks beyond the threshold.
    let ticks = run.ticks(first_s, touched_s);
    let below = ticks.clone().find(|tick| net.get(*tick).is_some_and(|force| *force <= 0.0));
    let last = below.and_then(|below| (below..ticks.end).rev().find(|tick| net[*tick] > least_n.max(rounding_n(&net))));
    let Some(last) = last else { return Ok(None) };
    let over = || Missing(format!("the net force pushes again after {first_s:.3} s and does not end with the run"));
    let out = (last + 1..net.len().min(run.loop_time.len())).find(|tick| net[*tick] <= 0.0).ok_or_else(over)?;
    let share = net[out - 1] / (net[out - 1] - net[out]);
    let (early_s, late_s) = (run.loop_time[out - 1].seconds(), run.loop_time[out].seconds());
    Ok(Some(early_s + share * (late_s - early_s)))
}

/// When the net force pushes by more than noise within these instants, if it does.
fn pushes_at(run: &Observation<'_>, along: &Along<'_>, from_s: f64, to_s: f64) -> Option<f64> {
    let net = along.net_load(run.mass_kg, run.tick_s().ok()?).ok()?;
    let least_n = (2.0 * threshold_n(along)).max(rounding_n(&net));
    let tick = run.ticks(from_s, to_s).find(|tick| net.get(*tick).is_some_and(|force| *force > least_n))?;
    Some(run.loop_time[tick].seconds())
}

/// What rounding leaves of a force: as many units in the last place as there are terms in a sum of four.
fn rounding_n(net: &[f64]) -> f64 {
    4.0 * f64::EPSILON * net.iter().fold(0.0, |largest: f64, force| largest.max(force.abs()))
}

/// Whether the net force pulls between these instants by more than noise.
fn pulls(run: &Observation<'_>, along: &Along<'_>, from_s: f64, to_s: Option<f64>) -> Result<bool, Missing> {
    let net = along.net_load(run.mass_kg, run.tick_s()?)?;
    let ticks = run.ticks(from_s, to_s.unwrap_or(f64::INFINITY));
    let inside = net.get(ticks).unwrap_or_default();
    let noise = threshold_n(along);
    // Without a threshold only rounding is left.
    let rounding = rounding_n(&net);
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

/// No limit of a restitution is kept by a contact that had none: a value below zero, by more than noise, does not pass.
pub(super) fn leave_open_without_rebound(verdict: &mut Verdict) {
    if verdict.value.is_some_and(|value| value < -verdict.uncertainty.unwrap_or(0.0)) {
        verdict.outcome = verdict.outcome.max(Outcome::Undecided);
        verdict.why = format!("it did not rebound, and is still closing afterwards; {}", verdict.why);
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
        let mut verdict = judged(self, found, "1", self.range());
        leave_open_without_rebound(&mut verdict);
        verdict
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::borrow::Cow;
    use alloc::vec::Vec;
    use core::f64::consts::PI;

    const TICK_S: f64 = 0.004;
    const BEFORE_M_PER_S: f64 = 0.035;

    fn times() -> Vec<Nanos> {
        (0..300).map(|tick| Nanos(tick * 4_000_000)).collect()
    }

    /// A run of this net force on 31 kg; the sensor feels `sensed`.
    fn run(net: impl Fn(f64) -> f64, sensed: Option<fn(f64) -> f64>) -> Observation<'static> {
        let mass_kg = 31.0;
        let (mut velocity, mut before, mut after, mut feedback) = (BEFORE_M_PER_S, Vec::new(), Vec::new(), Vec::new());
        for time in times() {
            before.push(velocity);
            feedback.push(net(time.seconds()));
            velocity -= net(time.seconds()) * TICK_S / mass_kg;
            after.push(velocity);
        }
        let column = |values: Vec<f64>| Some(Cow::Owned(values));
        let along = Along {
            feedback: column(feedback),
            before: column(before),
            after: column(after),
            sensed: sensed.map(|sensed| times().iter().map(|time| sensed(time.seconds())).collect()),
            load_sd: Some(0.01),
            ..Along::default()
        };
        Observation {
            loop_time: Cow::Owned(times()),
            sensor_time: Cow::Owned(times()),
            mass_kg: Some(mass_kg),
            along: [along].to_vec(),
            ..Observation::default()
        }
    }

    /// Half a wave of this size between two instants.
    fn bump(size_n: f64, from_s: f64, to_s: f64, at_s: f64) -> f64 {
        if at_s < from_s || at_s > to_s { 0.0 } else { size_n * libm::sin(PI * (at_s - from_s) / (to_s - from_s)) }
    }

    /// It pushes, pulls, pushes again and pulls.
    fn twice(at_s: f64) -> f64 {
        let pushes = bump(10.0, 0.2, 0.4, at_s) + bump(8.0, 0.5, 0.7, at_s);
        pushes + bump(-2.0, 0.4, 0.5, at_s) + bump(-1.0, 0.7, 0.76, at_s)
    }

    #[test]
    fn a_contact_that_pushes_again_is_released_at_its_last_zero_of_force() {
        let whole: fn(f64) -> f64 = |at_s| bump(9.0, 0.2, 0.7, at_s);
        // By hand: the mean of a half wave is 2/π of its size.
        let first = 10.0 * 0.2 * 2.0 / PI;
        let all = (10.0 * 0.2 - 2.0 * 0.1 + 8.0 * 0.2) * 2.0 / PI;
        let e = |impulse_n_s: f64| impulse_n_s / 31.0 / BEFORE_M_PER_S - 1.0;
        for sensed in [Some(whole), None] {
            let found = speeds(&run(twice, sensed), ObservedAxis::Z, Release::ZeroForce).unwrap();
            // A sum of 50 samples leaves (π/50)²/12 of a half wave: 1.1e-3 of e + 1 = 3. A tick off the extreme of the speed costs
            // 126 N/s (4 ms)²/2 / 31 kg of 35 mm/s: 0.9e-3; at either end of two half waves 3.6e-3 at most.
            assert!((found.release_s - 0.7).abs() <= TICK_S, "{found:?}");
            assert!((found.restitution.value - e(all)).abs() < 5e-3, "{found:?} {}", e(all));
            assert!(found.about.contains("pushes again after the first"), "{}", found.about);
        }
        let once = |at_s: f64| bump(10.0, 0.2, 0.4, at_s) + bump(-2.0, 0.4, 0.5, at_s);
        let found = speeds(&run(once, Some(whole)), ObservedAxis::Z, Release::ZeroForce).unwrap();
        assert!((found.release_s - 0.4).abs() <= TICK_S, "{found:?}");
        assert!((found.restitution.value - e(first)).abs() < 5e-3, "{found:?} {}", e(first));
        assert!(!found.about.contains("again"), "{}", found.about);
    }

    #[test]
    fn an_average_that_a_push_falls_into_cannot_be_had() {
        let felt: fn(f64) -> f64 = |at_s| bump(10.0, 0.2, 0.4, at_s);
        let later = |at_s: f64| bump(10.0, 0.2, 0.4, at_s) + bump(4.0, 0.5, 0.6, at_s);
        let verdict = Restitution { at_most: Some(1.0), ..Restitution::default() }.judge(&run(later, Some(felt)));
        assert_eq!((verdict.outcome, verdict.value), (Outcome::Undecided, None), "{verdict:?}");
        assert!(verdict.why.contains("it touches again at 0.50"), "{}", verdict.why);
    }

    #[test]
    fn what_passes_through_has_no_restitution_to_pass_with() {
        let felt: fn(f64) -> f64 = |at_s| bump(1.0, 0.2, 0.4, at_s);
        let through = run(felt, Some(felt));
        for (at_least, at_most, outcome) in
            [(None, Some(1.0), Outcome::Undecided), (Some(0.3), Some(1.0), Outcome::Fail)]
        {
            let verdict = Restitution { at_least, at_most, ..Restitution::default() }.judge(&through);
            assert_eq!(verdict.outcome, outcome, "{verdict:?}");
            assert!(verdict.value.unwrap() < -0.8 && verdict.why.starts_with("it did not rebound"), "{verdict:?}");
        }
    }

    /// A net force that pulls the satellites away for good: 20 times the speed of the approach, and no rebound.
    #[test]
    fn a_run_that_ran_away_has_no_restitution() {
        let half_sine =
            |time_s: f64| if (0.3..0.5).contains(&time_s) { 17.0 * libm::sin(PI * (time_s - 0.3) / 0.2) } else { 0.0 };
        let docked = run(half_sine, Some(half_sine));
        assert!(speeds(&docked, ObservedAxis::Z, Release::ZeroForce).is_ok());
        let gone = run(|time_s| half_sine(time_s) * 25.0, Some(|_| 0.0));
        let why = speeds(&gone, ObservedAxis::Z, Release::ZeroForce).unwrap_err();
        assert!(why.0.contains("ran away"), "{why}");
        let why = crate::criterion::contact_duration(&gone, ObservedAxis::Z).unwrap_err();
        assert!(why.0.contains("ran away"), "{why}");
    }

    /// A coasting speed that falls by 0.02 m/s² in a run with angles: from the release to the middle of the average that is 2.2 mm/s.
    #[test]
    fn a_tip_that_turns_on_is_told() {
        let felt: fn(f64) -> f64 = |at_s| bump(10.0, 0.2, 0.4, at_s);
        let mut docked = run(felt, Some(felt));
        let along = docked.along[0].after.as_mut().unwrap().to_mut();
        for (speed, time) in along.iter_mut().zip(times()) {
            *speed -= 0.02 * (time.seconds() - 0.4).max(0.0);
        }
        let about = |run: &Observation<'_>| speeds(run, ObservedAxis::Z, Release::ZeroForce).unwrap().about;
        assert!(!about(&docked).contains("turns on"), "along one axis nothing turns");
        docked.along.push(Along { axis: ObservedAxis::AboutX, ..Along::default() });
        assert!(about(&docked).contains("changed by -0.0022 m/s since the release"), "{}", about(&docked));
    }
}
