//! What a replay changed, stream by stream.

use super::Request;
use super::made::Made;
use crate::case::Case;
use crate::diagnose::software::CLOSED_M;
use crate::recording::{Role, Series};
use serde::Serialize;

/// One number that is not the same.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct First {
    /// Sample of the stream, from 0.
    pub sample: usize,
    /// Its time from the first command, in s.
    pub time_s: f64,
    /// The value before.
    pub old: f64,
    /// The value after.
    pub new: f64,
}

/// A stream of the recording, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stream {
    /// Its topic.
    pub topic: String,
    /// What is compared, along the axis of approach.
    pub quantity: String,
    /// Unit of the numbers.
    pub unit: &'static str,
    /// Whether the model made it; what is clamped, or is no output of the clamp, keeps its bytes.
    pub made: bool,
    /// How many samples the recording has.
    pub samples: usize,
    /// How many samples keep their bytes: they agree to rounding.
    pub kept: usize,
    /// A difference up to this is rounding or noise: rounding for what our own software makes, four standard deviations of the
    /// model's declared noise for what a sensor tells, nothing for a run of our own.
    pub resolution: f64,
    /// Root mean square of replay minus recording.
    pub rms: f64,
    /// Largest difference.
    pub largest: f64,
    /// The first sample that differs from the recording by more than the resolution.
    pub first: Option<First>,
    /// The first sample that differs from the same replay without the injected faults, by its bits.
    pub first_by_faults: Option<First>,
}

/// Standard deviations of noise that a difference must exceed: one sample in 16 000 does by chance.
const NOISE_SIGMAS: f64 = 4.0;
/// The streams that are compared.
pub(super) const ROLES: [(Role, &str, &str); 4] = [
    (Role::Commanded, "commanded position", "m"),
    (Role::Measured, "reported position", "m"),
    (Role::Twist, "velocity of the satellites", "m/s"),
    (Role::Sensed, "force", "N"),
];

/// The recorded values of a stream along the axis, with their times in ns from the first command.
pub(super) fn recorded(request: &Request<'_>, role: Role) -> Option<(Vec<i64>, Vec<f64>)> {
    let session = request.session;
    let start_ns = session.commanded.as_ref()?.time_ns.first().copied()?;
    fn of<T>(series: &Series<T>, start_ns: i64, value: fn(&T) -> f64) -> (Vec<i64>, Vec<f64>) {
        (series.time_ns.iter().map(|time| time - start_ns).collect(), series.value.iter().map(value).collect())
    }
    Some(match role {
        Role::Commanded => of(session.commanded.as_ref()?, start_ns, |pose| pose.position_m[2]),
        Role::Measured => of(session.measured.as_ref()?, start_ns, |pose| pose.position_m[2]),
        Role::Twist => of(session.twist.as_ref()?, start_ns, |twist| twist.linear_m_per_s[2]),
        Role::Sensed => of(session.sensed.as_ref()?, start_ns, |wrench| wrench.force_n[2]),
        Role::Applied => return None,
    })
}

/// A recorded sample: its stream, its place in it, and its time in ns from the first command.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub role: Role,
    pub index: usize,
    pub time_ns: i64,
}

/// The tick of the model that this sample belongs to. A run of our own has one sample for each tick, whatever its stamps say.
fn tick(request: &Request<'_>, case: &Case, sample: Sample) -> Option<usize> {
    let Sample { role, index, time_ns } = sample;
    if request.is_again() {
        return Some(index);
    }
    let (phase, period) = match role {
        Role::Sensed => (case.rates.sensor_phase.0, case.rates.sensor_period.0),
        _ => (case.rates.loop_phase.0, case.rates.loop_period.0),
    };
    usize::try_from((time_ns - phase + period / 2).div_euclid(period)).ok()
}

/// The new value of a recorded sample, if the model made one that does not agree with it to rounding.
pub(super) fn replacement(request: &Request<'_>, case: &Case, made: &Made, sample: Sample, old: f64) -> Option<f64> {
    if !request.clamp.makes(sample.role) {
        return None;
    }
    let new = *made.of(sample.role).get(tick(request, case, sample)?)?;
    let agrees = new.to_bits() == old.to_bits() || (new - old).abs() <= rounding(request, sample.role);
    (!agrees).then_some(new)
}

/// Our own software agrees with itself to rounding, and a run of our own to the last bit.
fn rounding(request: &Request<'_>, role: Role) -> f64 {
    match role {
        Role::Commanded | Role::Twist if !request.is_again() => CLOSED_M,
        _ => 0.0,
    }
}

fn resolution(request: &Request<'_>, role: Role) -> f64 {
    let sensor = &request.model.sensor;
    let noise = match role {
        _ if request.is_again() => 0.0,
        Role::Measured => request.model.readout.position_sigma_m,
        Role::Sensed => libm::hypot(sensor.white_sigma_n, sensor.slow_sigma_n),
        _ => 0.0,
    };
    (NOISE_SIGMAS * noise).max(rounding(request, role))
}

/// What became of each stream. `plain` is the same replay without the faults, if there are any.
pub(super) fn streams(request: &Request<'_>, case: &Case, made: &Made, plain: Option<&Made>) -> Vec<Stream> {
    let topics = &request.map.topics;
    let topic = |role: Role| match role {
        Role::Commanded => topics.commanded.clone(),
        Role::Measured => topics.measured.clone(),
        Role::Twist => topics.twist.clone(),
        Role::Sensed => topics.sensed.clone(),
        Role::Applied => None,
    };
    let one = |(role, quantity, unit): (Role, &str, &'static str)| {
        let (time_ns, value) = recorded(request, role)?;
        let mut stream = Stream {
            topic: topic(role)?,
            quantity: quantity.to_owned(),
            unit,
            made: request.clamp.makes(role),
            samples: value.len(),
            kept: value.len(),
            resolution: resolution(request, role),
            rms: 0.0,
            largest: 0.0,
            first: None,
            first_by_faults: None,
        };
        if stream.made {
            fill(&mut stream, request, case, (role, &time_ns, &value), made, plain);
        }
        Some(stream)
    };
    ROLES.into_iter().filter_map(one).collect()
}

fn fill(
    stream: &mut Stream,
    request: &Request<'_>,
    case: &Case,
    (role, time_ns, value): (Role, &[i64], &[f64]),
    made: &Made,
    plain: Option<&Made>,
) {
    let (mut squares, mut count) = (0.0, 0_usize);
    for (index, (time_ns, old)) in time_ns.iter().zip(value).enumerate() {
        let sample = Sample { role, index, time_ns: *time_ns };
        let Some(tick) = tick(request, case, sample) else { continue };
        let Some(new) = made.of(role).get(tick).copied() else { continue };
        let place = |old: f64| First { sample: index, time_s: *time_ns as f64 * 1e-9, old, new };
        let difference = new - old;
        squares += difference * difference;
        count += 1;
        stream.largest = stream.largest.max(difference.abs());
        stream.kept -= usize::from(replacement(request, case, made, sample, *old).is_some());
        let differs = new.to_bits() != old.to_bits() && difference.abs() > stream.resolution;
        if differs && stream.first.is_none() {
            stream.first = Some(place(*old));
        }
        if let Some(without) = plain.and_then(|plain| plain.of(role).get(tick).copied())
            && without.to_bits() != new.to_bits()
            && stream.first_by_faults.is_none()
        {
            stream.first_by_faults = Some(place(without));
        }
    }
    stream.rms = libm::sqrt(squares / count.max(1) as f64);
}
