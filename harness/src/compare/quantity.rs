//! Quantities of interest, taken from a recording and from a free run by the same estimator.
//!
//! | quantity | how |
//! |---|---|
//! | peak force | largest value of a parabola fitted through ±20 ms: noise does not lift a maximum that is averaged |
//! | contact time | between the crossings of a threshold before and after the peak, of the mean over ±4 ms |
//! | rebound speed | mean velocity of the satellites from 60 to 160 ms after contact, positive leaving |
//! | observed energy | net force on the satellites times their mean velocity of each tick, over contact and 60 ms on either side |
//!
//! Uncertainty: `u² = u_data² + u_input² + u_numerical²`. The path is drawn exactly at every instant and the laws have no
//! memory, so that u_numerical is 0 unless an effect of the model integrates.
//!
//! The energy needs no force sample: `F = -m (v₊ - v₋) / T` is the force that acted, and `Σ F (v₊ + v₋)/2 T` is exact.

use super::log::Log;
use super::result::{Quantity, Verdict};
use crate::diagnose::noise::Noise;
use sim_core::energy::{Pairing, observed_j};
use sim_core::force_sensor::SensorNoise;

/// Half width of the parabola at the peak. Chosen: a twentieth of a contact of 0.8 s, where it is wrong by 1e-4 of the peak.
const PEAK_HALF_S: f64 = 0.020;
/// Half width of the mean that crosses the threshold. Chosen: one tick of the loop.
const EDGE_HALF_S: f64 = 0.004;
/// The threshold in multiples of the noise floor: the mean over ±4 ms crosses it by chance less than once in 10¹⁰.
const THRESHOLD_SIGMA: f64 = 5.0;
/// Least threshold, for a sensor that is believed to be without noise.
const THRESHOLD_MIN_N: f64 = 0.1;
/// What the satellites still feel after the sensor lost contact: two delays of 16 ms and a few ticks.
const SETTLE_S: f64 = 0.060;
/// Length of the window for the rebound speed.
const REBOUND_S: f64 = 0.100;
/// Fewer ticks than this are no rebound speed.
const REBOUND_TICKS_MIN: usize = 5;

/// Names, units and estimators, in the order of [`Seen::values`].
const QUANTITIES: [(&str, &str); 5] = [
    ("peak_force_n", "N"),
    ("contact_time_s", "s"),
    ("rebound_speed_m_per_s", "m/s"),
    ("restitution", "1"),
    ("observed_energy_j", "J"),
];

/// What was seen of one run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seen {
    /// One value for each quantity, if it could be had.
    pub values: [Option<f64>; 5],
    /// Slope of the force at begin and end of contact, in N/s.
    pub slopes_n_per_s: Option<(f64, f64)>,
    /// Begin and end of contact, in s.
    pub contact_s: Option<(f64, f64)>,
}

/// White and slow part of a learned noise, as a sensor makes it.
pub fn sensor_noise(noise: &Noise) -> SensorNoise {
    // Autocovariance of lag 1 of e + θ e₋₁ is θ σ², and that of the whitened sum is -φ W.
    let innovation = noise.innovation_n * noise.innovation_n;
    let total = noise.force_floor_n * noise.force_floor_n;
    let white = if noise.slow_memory > 0.0 { -noise.average * innovation / noise.slow_memory } else { total };
    let white = white.clamp(0.0, total);
    SensorNoise {
        white_n: libm::sqrt(white),
        slow_n: libm::sqrt(total - white),
        memory: noise.slow_memory,
        // Recorded forces are whole mN.
        quantum_n: 0.001,
    }
}

/// The threshold of contact for this noise, in N.
pub fn threshold_n(noise: &SensorNoise) -> f64 {
    (THRESHOLD_SIGMA * libm::sqrt(autocovariance(noise, 0))).max(THRESHOLD_MIN_N)
}

/// Takes the quantities from a run.
pub fn seen(log: &Log, threshold_n: f64) -> Seen {
    let mut seen = Seen::default();
    let half = samples(EDGE_HALF_S, log.sensor_period_s);
    let smooth = smoothed(&log.force_n, half);
    let Some(peak) = (0..smooth.len()).max_by(|&a, &b| smooth[a].total_cmp(&smooth[b])) else { return seen };
    if smooth[peak].is_nan() || smooth[peak] < 2.0 * threshold_n {
        return seen;
    }
    let before = (1..=peak).rev().find(|&i| smooth[i - 1] < threshold_n);
    let after = (peak..smooth.len() - 1).find(|&i| smooth[i + 1] < threshold_n);
    // A run that begins or ends in contact has no contact time, and neither speed nor energy of a whole contact.
    let (Some(begin), Some(end)) = (before, after) else { return seen };
    let crossing = |low: usize, high: usize| {
        let share = (threshold_n - smooth[low]) / (smooth[high] - smooth[low]);
        log.sensor_time_s(low as f64 + share * (high as f64 - low as f64))
    };
    let (first_s, last_s) = (crossing(begin - 1, begin), crossing(end + 1, end));
    if is_recorded(log, begin, end) {
        seen.values[0] = peak_n(log, begin, end);
        seen.values[1] = Some(last_s - first_s);
    }
    seen.slopes_n_per_s = Some((
        slope_n_per_s(&smooth, begin, half, log.sensor_period_s),
        slope_n_per_s(&smooth, end, half, log.sensor_period_s),
    ));
    seen.contact_s = Some((first_s, last_s));
    let rebound = log.ticks(last_s + SETTLE_S, last_s + SETTLE_S + REBOUND_S);
    if rebound.len() >= REBOUND_TICKS_MIN {
        let speed = -log.after_m_per_s[rebound.clone()].iter().sum::<f64>() / rebound.len() as f64;
        let approach = approach_speed_m_per_s(log, first_s);
        seen.values[2] = Some(speed);
        seen.values[3] = approach.map(|approach| speed / approach);
        seen.values[4] = Some(energy_j(log, first_s - SETTLE_S, last_s + SETTLE_S));
    }
    seen
}

fn samples(half_s: f64, period_s: f64) -> usize {
    (libm::round(half_s / period_s) as usize).max(1)
}

/// Gaps of more than one sample in a hundred make a peak a guess.
fn is_recorded(log: &Log, begin: usize, end: usize) -> bool {
    let lost = log.force_known[begin..=end].iter().filter(|known| !**known).count();
    100 * lost <= end - begin
}

/// Mean over `2 half + 1` samples; fewer at the ends.
fn smoothed(values: &[f64], half: usize) -> Vec<f64> {
    let mean = |i: usize| {
        let window = &values[i.saturating_sub(half)..(i + half + 1).min(values.len())];
        window.iter().sum::<f64>() / window.len() as f64
    };
    (0..values.len()).map(mean).collect()
}

fn slope_n_per_s(smooth: &[f64], at: usize, half: usize, period_s: f64) -> f64 {
    let (low, high) = (at.saturating_sub(half), (at + half).min(smooth.len() - 1));
    (smooth[high] - smooth[low]) / ((high - low) as f64 * period_s)
}

/// Weights of the value in the middle of a parabola through `2 half + 1` points (Savitzky and Golay 1964).
fn parabola_weights(half: usize) -> Vec<f64> {
    let m = half as f64;
    let scale = (2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0);
    let weight = |j: f64| 3.0 * (3.0 * m * m + 3.0 * m - 1.0 - 5.0 * j * j) / scale;
    (0..=2 * half).map(|i| weight(i as f64 - m)).collect()
}

fn peak_n(log: &Log, begin: usize, end: usize) -> Option<f64> {
    let half = samples(PEAK_HALF_S, log.sensor_period_s);
    let weights = parabola_weights(half);
    let inside = log.force_n.get(begin..=end)?;
    let values = inside.windows(weights.len()).map(|window| dot(window, &weights));
    values.max_by(f64::total_cmp)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Mean velocity of the 100 ms that end 60 ms before contact; the first velocity where contact comes sooner.
fn approach_speed_m_per_s(log: &Log, first_s: f64) -> Option<f64> {
    let ticks = log.ticks(first_s - SETTLE_S - REBOUND_S, first_s - SETTLE_S);
    let speed = if ticks.is_empty() {
        log.before_m_per_s.first().copied()?
    } else {
        log.before_m_per_s[ticks.clone()].iter().sum::<f64>() / ticks.len() as f64
    };
    (speed > 0.0).then_some(speed)
}

fn energy_j(log: &Log, from_s: f64, to_s: f64) -> f64 {
    let ticks = log.ticks(from_s, to_s);
    let pairs = || log.before_m_per_s[ticks.clone()].iter().zip(&log.after_m_per_s[ticks.clone()]);
    let force_n: Vec<f64> =
        pairs().map(|(before, after)| -log.mass_kg * (after - before) / log.loop_period_s).collect();
    let mean: Vec<f64> = pairs().map(|(before, after)| 0.5 * (before + after)).collect();
    observed_j(&force_n, &mean, log.loop_period_s)
}

/// How each quantity was had, for people.
fn about(index: usize, threshold_n: f64) -> String {
    match index {
        0 => "largest value of a parabola through ±20 ms, bias and weight taken out".into(),
        1 => format!("between crossings of {threshold_n:.2} N by the mean over ±4 ms"),
        2 => "mean velocity of the satellites 60 to 160 ms after contact, positive leaving".into(),
        3 => "mean rebound speed over mean approach speed".into(),
        _ => format!(
            "{}, over contact and 60 ms on either side; above 0 is absorbed",
            Pairing::FeedbackWithSatelliteMean.words()
        ),
    }
}

/// Standard deviation of each measured value from the sensor's noise in the record. What the satellites did is recorded
/// exactly: their speed and energy have none.
fn data_sd(seen: &Seen, noise: &SensorNoise, period_s: f64) -> [f64; 5] {
    let peak = weighted_sd(&parabola_weights(samples(PEAK_HALF_S, period_s)), noise);
    let edge_count = 2 * samples(EDGE_HALF_S, period_s) + 1;
    let edge = weighted_sd(&vec![1.0 / edge_count as f64; edge_count], noise);
    let time = seen.slopes_n_per_s.map_or(0.0, |(rise, fall)| {
        let (rise, fall) = (edge / rise.abs().max(1e-9), edge / fall.abs().max(1e-9));
        libm::sqrt(rise * rise + fall * fall)
    });
    [peak, time, 0.0, 0.0, 0.0]
}

/// Standard deviation of a weighted sum of samples of this noise.
pub fn weighted_sd(weights: &[f64], noise: &SensorNoise) -> f64 {
    let mut sum = 0.0;
    for lag in 0..weights.len() {
        let product = dot(weights, &weights[lag..]);
        let twice = if lag == 0 { 1.0 } else { 2.0 };
        sum += twice * product * autocovariance(noise, lag);
    }
    libm::sqrt(sum.max(0.0))
}

/// Autocovariance of the sensor's noise, in N².
pub fn autocovariance(noise: &SensorNoise, lag: usize) -> f64 {
    let white = if lag == 0 { noise.white_n * noise.white_n } else { 0.0 };
    white + noise.slow_n * noise.slow_n * libm::pow(noise.memory, lag as f64)
}

/// Everything that the quantities of one recording are judged by.
pub struct Sides<'a> {
    /// From the recording.
    pub recorded: &'a Seen,
    /// From each free run that did not diverge.
    pub free: &'a [Seen],
    /// How many free runs were made.
    pub samples: usize,
    /// Without noise or scatter, at the model's physics step and at half of it.
    pub coarse_and_fine: (&'a Seen, &'a Seen),
    /// Noise of the sensor.
    pub noise: SensorNoise,
    /// Period of the sensor, in s.
    pub sensor_period_s: f64,
    /// Threshold of contact, in N.
    pub threshold_n: f64,
}

/// Difference ± uncertainty of every quantity.
pub fn quantities(sides: &Sides<'_>) -> Vec<Quantity> {
    let data = data_sd(sides.recorded, &sides.noise, sides.sensor_period_s);
    (0..QUANTITIES.len()).map(|index| quantity(index, sides, data[index])).collect()
}

fn quantity(index: usize, sides: &Sides<'_>, u_data: f64) -> Quantity {
    let (name, unit) = QUANTITIES[index];
    let values: Vec<f64> = sides.free.iter().filter_map(|seen| seen.values[index]).collect();
    let measured = sides.recorded.values[index];
    // Where one free run in five has no such number, the rest is no fair sample.
    let enough = values.len() >= 2 && 5 * values.len() >= 4 * sides.samples;
    let moments = enough.then(|| moments(&values));
    let (coarse, fine) = sides.coarse_and_fine;
    let u_numerical = match (coarse.values[index], fine.values[index]) {
        (Some(coarse), Some(fine)) => (coarse - fine).abs(),
        _ => 0.0,
    };
    // The free runs are read through the same noisy sensor, so their spread holds u_data already.
    let u_input = moments.map_or(0.0, |(_, variance)| {
        let mean_too = variance * (1.0 + 1.0 / values.len() as f64);
        libm::sqrt((mean_too - u_data * u_data).max(0.0))
    });
    let uncertainty = 2.0 * libm::sqrt(u_data * u_data + u_input * u_input + u_numerical * u_numerical);
    let model = moments.map(|(mean, _)| mean);
    let difference = model.zip(measured).map(|(model, measured)| model - measured);
    let size = measured.unwrap_or(0.0).abs().max(model.unwrap_or(0.0).abs());
    let verdict = match difference {
        Some(difference) if difference.abs() > uncertainty => Verdict::Outside,
        Some(_) if uncertainty <= size => Verdict::InsideNoise,
        _ => Verdict::CannotSay,
    };
    Quantity {
        name: name.into(),
        unit: unit.into(),
        about: about(index, sides.threshold_n),
        measured,
        model,
        difference,
        uncertainty: difference.map(|_| uncertainty),
        u_data,
        u_input,
        u_numerical,
        verdict,
    }
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
    (mean, variance)
}
