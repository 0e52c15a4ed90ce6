//! Observed energy of a run: passive, neutral or active.
//!
//! One port: what the contact absorbed from the satellites, `E = Σ f v Δt`. Two ports: what the robots in between absorbed,
//! `E = Σ (fr vr - fm vm) Δt`, with fr, vr at the satellites and fm, vm at the hardware. The pairing stands in every verdict;
//! [`crate::energy`] says what a wrong one shows. The two disagree by design: with the measured pose D late, a two-port
//! energy shows a false `-k D` of damping while the rebound itself is right, so look at both.
//!
//! The noise band is two standard deviations of the sum from white noise of the sensor and of the reported position, plus
//! rounding. An energy inside it is neutral.

use super::contact::{threshold_n, within};
use super::verdict::cannot;
use super::{Along, Bound, Criterion, Missing, Observation, ObservedAxis, Outcome, Verdict, contact};
use crate::energy::{Activity, Pairing, observed_j, observed_sd_j, observed_sd_of_position_j};
use crate::refusal::{Refusal, positive};
use crate::time::Nanos;
use alloc::format;
use alloc::string::ToString;
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

/// What the satellites still feel after the sensor lost contact: two delays of 16 ms and a few ticks.
const SETTLE_S: f64 = 0.060;

/// Which ticks are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Window {
    /// The contact and 60 ms on either side; the whole run where nothing touched.
    #[default]
    Contact,
    /// The whole run.
    Run,
}

/// What the observed energy has to be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservedEnergy {
    /// Which force with which velocity.
    pub pairing: Pairing,
    /// Axis.
    pub axis: ObservedAxis,
    /// Which ticks.
    pub window: Window,
    /// Take the velocity of the measured pose from this much later, in s: 0.016 undoes a read-out of 16 ms.
    pub measured_late_s: f64,
    /// What it has to be.
    pub expect: Activity,
    /// Half width of the neutral band in J, instead of the one from the noise.
    pub band_j: Option<f64>,
}

impl Default for ObservedEnergy {
    fn default() -> Self {
        ObservedEnergy {
            pairing: Pairing::default(),
            axis: ObservedAxis::default(),
            window: Window::default(),
            measured_late_s: 0.0,
            expect: Activity::Passive,
            band_j: None,
        }
    }
}

/// An observed energy with what it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Energy {
    /// Absorbed energy, in J.
    pub value_j: f64,
    /// Standard deviation from noise, in J; none if the noise is not known.
    pub sd_j: Option<f64>,
    /// `Σ v² Δt` of the pairing's first velocity, from first to last touch by its own force, in m²/s.
    pub motion_m2_per_s: f64,
    /// The tick after which the running sum of the first port was lowest.
    pub lowest_at: Option<Nanos>,
    /// What rounding can do to the sum, in J.
    pub rounding_j: f64,
}

/// Forces and velocities of one port, with the standard deviations of a force and of a position.
struct Port {
    time: Vec<Nanos>,
    load: Vec<f64>,
    rate: Vec<f64>,
    load_sd: Option<f64>,
    position_sd: Option<f64>,
}

impl Port {
    fn sd_j(&self, tick_s: f64) -> Option<f64> {
        let load = observed_sd_j(self.load_sd?, &self.rate, tick_s);
        let position = observed_sd_of_position_j(self.position_sd?, &self.load);
        Some(libm::sqrt(load * load + position * position))
    }

    /// `Σ v² Δt` from first to last touch, and wherever else the load exceeds the threshold, since a damper may pull at the end.
    /// Free flight on either side has motion, and nothing to damp.
    fn motion_m2_per_s(&self, tick_s: f64, threshold_n: f64) -> f64 {
        let touch = within(&self.load, &self.time, threshold_n, "load");
        let touch_s = touch.map_or(0.0..=0.0, |touch| touch.begin_s..=touch.end_s);
        let ticks = self.time.iter().zip(&self.load).zip(&self.rate);
        let counts = |time: &Nanos, load: &f64| touch_s.contains(&time.seconds()) || load.abs() > threshold_n;
        ticks.filter(|((time, load), _)| counts(time, load)).map(|(_, rate)| rate * rate * tick_s).sum()
    }

    /// The tick after which the running sum was lowest.
    fn lowest_at(&self) -> Option<Nanos> {
        let mut sum = 0.0;
        let sums = self.load.iter().zip(&self.rate).map(|(load, rate)| {
            sum += load * rate;
            sum
        });
        let (place, _) = sums.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        self.time.get(place).copied()
    }
}

/// The observed energy of this pairing, with the default band.
pub fn observed_energy(run: &Observation<'_>, what: &ObservedEnergy) -> Result<Energy, Missing> {
    let along = run.along(what.axis)?;
    let tick_s = run.tick_s()?;
    let threshold_n = threshold_n(along);
    let loop_port = |ports: &[(f64, Port)]| summed(ports, tick_s, threshold_n);
    match what.pairing {
        Pairing::FeedbackWithSatelliteMean => Ok(loop_port(&[(1.0, satellites(run, along, what)?)])),
        Pairing::SensedWithMeasured => Ok(loop_port(&[(1.0, hardware(run, along, what)?)])),
        Pairing::FeedbackMinusSensed => {
            Ok(loop_port(&[(1.0, satellites(run, along, what)?), (-1.0, hardware(run, along, what)?)]))
        }
        Pairing::InterfaceWithAchieved => {
            Ok(summed(&[(1.0, interface(run, along)?)], run.sensor_tick_s()?, threshold_n))
        }
    }
}

/// The ticks of the loop that count.
fn ticks(run: &Observation<'_>, what: &ObservedEnergy) -> Result<core::ops::Range<usize>, Missing> {
    let along = run.along(what.axis)?;
    match what.window {
        Window::Run => Ok(0..run.loop_time.len()),
        Window::Contact => Ok(contact(run, along)
            .map_or(0..run.loop_time.len(), |contact| run.ticks(contact.begin_s - SETTLE_S, contact.end_s + SETTLE_S))),
    }
}

/// The satellites' port: exact for a held force, so that the recorded positions add no noise.
fn satellites(run: &Observation<'_>, along: &Along<'_>, what: &ObservedEnergy) -> Result<Port, Missing> {
    let load = along.net_load(run.mass_kg, run.tick_s()?)?;
    let rate = along.mean_velocity()?;
    let ticks = ticks(run, what)?;
    let cut = |values: &[f64]| values.get(ticks.clone()).map(<[f64]>::to_vec);
    let both = cut(&load).zip(cut(&rate)).ok_or_else(|| along.no("force at every tick"))?;
    let time = run.loop_time[ticks].to_vec();
    Ok(Port { time, load: both.0, rate: both.1, load_sd: along.load_sd, position_sd: Some(0.0) })
}

/// The hardware's port as a log holds it.
fn hardware(run: &Observation<'_>, along: &Along<'_>, what: &ObservedEnergy) -> Result<Port, Missing> {
    let tick_s = run.tick_s()?;
    let sensed = along.sensed.as_ref().ok_or_else(|| along.no("reading of the sensor"))?;
    let measured = along.measured.as_ref().ok_or_else(|| along.no("measured position"))?;
    let late = what.measured_late_s / tick_s;
    let whole = libm::floor(late) as usize;
    let share = late - whole as f64;
    let at = |tick: usize| {
        let get = |place: usize| measured.get(place).copied();
        let here = get(tick + whole)?;
        Some(if share == 0.0 { here } else { here + share * (get(tick + whole + 1)? - here) })
    };
    let (mut time, mut load, mut rate) = (Vec::new(), Vec::new(), Vec::new());
    for tick in ticks(run, what)? {
        let newest = run.sensor_time.partition_point(|time| *time <= run.loop_time[tick]).checked_sub(1);
        let reading = newest.and_then(|newest| sensed.get(newest));
        if let (Some(reading), Some(before), Some(here)) = (reading, tick.checked_sub(1).and_then(at), at(tick)) {
            time.push(run.loop_time[tick]);
            load.push(*reading);
            rate.push((here - before) / tick_s);
        }
    }
    Ok(Port { time, load, rate, load_sd: along.load_sd, position_sd: along.position_sd })
}

/// The interface itself, which only a simulation knows.
fn interface(run: &Observation<'_>, along: &Along<'_>) -> Result<Port, Missing> {
    let load = along.interface.as_ref().ok_or_else(|| along.no("force at the interface"))?;
    let rate = run.depth_rate_m_per_s.as_ref().filter(|_| along.axis == ObservedAxis::Z);
    let rate = rate.ok_or_else(|| along.no("achieved velocity"))?;
    let time = run.sensor_time.to_vec();
    Ok(Port { time, load: load.to_vec(), rate: rate.to_vec(), load_sd: Some(0.0), position_sd: Some(0.0) })
}

fn summed(ports: &[(f64, Port)], tick_s: f64, threshold_n: f64) -> Energy {
    let value_j = ports.iter().map(|(sign, port)| sign * observed_j(&port.load, &port.rate, tick_s)).sum();
    let variance = ports.iter().try_fold(0.0, |sum, (_, port)| port.sd_j(tick_s).map(|sd| sum + sd * sd));
    let terms = ports.iter().flat_map(|(_, port)| port.load.iter().zip(&port.rate));
    let (count, size) =
        terms.fold((0.0, 0.0), |(count, size), (load, rate)| (count + 1.0, size + (load * rate * tick_s).abs()));
    Energy {
        value_j,
        sd_j: variance.map(libm::sqrt),
        motion_m2_per_s: ports[0].1.motion_m2_per_s(tick_s, threshold_n),
        lowest_at: ports[0].1.lowest_at(),
        rounding_j: count * f64::EPSILON * size,
    }
}

impl ObservedEnergy {
    /// Refuses numbers without meaning.
    pub fn check(&self) -> Result<(), Refusal> {
        crate::refusal::not_negative("measured_late_s", self.measured_late_s, "s")?;
        self.band_j.map_or(Ok(()), |band_j| positive("band_j", band_j, "J").map(|_| ()))
    }
}

impl Criterion for ObservedEnergy {
    fn id(&self) -> &str {
        "observed-energy"
    }

    fn judge(&self, run: &Observation<'_>) -> Verdict {
        let energy = match observed_energy(run, self) {
            Ok(energy) => energy,
            Err(missing) => return cannot(self, "J", &missing),
        };
        let Some(band_j) = self.band_j.or(energy.sd_j.map(|sd| 2.0 * sd + energy.rounding_j)) else {
            let what = format!("{:.3} mJ, and no noise figure to tell it from zero", energy.value_j * 1e3);
            return cannot(self, "J", &Missing(what));
        };
        verdict(self, &energy, band_j)
    }
}

/// Holds an energy against what is expected of it.
fn verdict(what: &ObservedEnergy, energy: &Energy, band_j: f64) -> Verdict {
    let activity = Activity::of(energy.value_j, band_j);
    let value_j = energy.value_j;
    let (limit_j, margin_j, outcome) = match (what.expect, activity) {
        (Activity::Neutral, _) => {
            let margin_j = band_j - value_j.abs();
            let outcome = if activity == Activity::Neutral { Outcome::Pass } else { Outcome::Fail };
            (if value_j < 0.0 { -band_j } else { band_j }, margin_j, outcome)
        }
        (expect, found) => {
            let sign = if expect == Activity::Passive { 1.0 } else { -1.0 };
            let outcome = match found {
                Activity::Neutral => Outcome::Undecided,
                found if found == expect => Outcome::Pass,
                _ => Outcome::Fail,
            };
            (0.0, sign * value_j, outcome)
        }
    };
    let bound = match what.expect {
        Activity::Passive => Bound::AtLeast,
        Activity::Active => Bound::AtMost,
        Activity::Neutral if value_j < 0.0 => Bound::AtLeast,
        Activity::Neutral => Bound::AtMost,
    };
    let (is, wanted) = (activity.word(), what.expect.word());
    Verdict {
        criterion: what.id().to_string(),
        outcome,
        value: Some(value_j),
        uncertainty: Some(band_j),
        limit: Some(limit_j),
        bound: Some(bound),
        margin: Some(margin_j),
        unit: "J",
        at: energy.lowest_at,
        why: format!(
            "{is}, expected {wanted}: {:.3} mJ absorbed along {}, noise band ±{:.3} mJ; {}{}",
            value_j * 1e3,
            what.axis.name(),
            band_j * 1e3,
            what.pairing.words(),
            if what.measured_late_s > 0.0 {
                format!(", measured pose taken {:.1} ms later", what.measured_late_s * 1e3)
            } else {
                alloc::string::String::new()
            }
        ),
    }
}
