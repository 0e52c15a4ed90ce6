//! The fit of a whole step response.
//!
//! The command changes by Δᵢ at tᵢ and is held; the response is the sum of the answers to each change,
//! `y(t) = a + K Σ Δᵢ s(t - tᵢ - T)`, with the unit step response of the lag in closed form:
//!
//! ```text
//! s(t) = 1 - e^{-ζ ωₙ t} (cos ω_d t + ζ ωₙ sin(ω_d t) / ω_d),   ω_d² = ωₙ² (1 - ζ²)        (cosh, sinh beyond ζ = 1)
//! ```
//!
//! Offset a and gain K belong to the fit, so that a scale error of the tracker is no damping.

use super::form::{Choice, Form, Lag, Way, criterion};
use super::least_squares::{Solution, minimise};
use super::step::{StepTest, classical};
use alloc::vec;
use alloc::vec::Vec;

const TAU: f64 = 2.0 * core::f64::consts::PI;
/// Starts of the search: natural frequencies are spread over what the record can hold, damping over what robots have.
const FREQUENCIES: usize = 14;
const DAMPINGS: [f64; 5] = [0.05, 0.15, 0.35, 0.6, 0.9];
/// Starts of the dead time beside a lag, as parts of the time until half the step is done.
const DEAD_PARTS: [f64; 3] = [0.1, 0.4, 0.7];
/// Fewest samples: four times what is fitted.
const SAMPLES_MIN: usize = 20;

/// Unit step response of the lag, 0 before the step.
pub fn unit_response(lag: &Lag, time_s: f64) -> f64 {
    if time_s <= 0.0 {
        return 0.0;
    }
    let omega = TAU * lag.natural_frequency_hz;
    let decay = lag.damping_ratio * omega;
    let square = omega * omega * (1.0 - lag.damping_ratio * lag.damping_ratio);
    let turn = libm::sqrt(square.abs());
    let phase = turn * time_s;
    // Near ζ = 1 the quotient is t (1 ∓ φ²/6); beyond, e^{-at} and e^{bt} are taken together, or the second would overflow.
    if phase < 1e-4 {
        return 1.0 - libm::exp(-decay * time_s) * (1.0 + decay * time_s);
    }
    if square > 0.0 {
        let (sin, cos) = libm::sincos(phase);
        return 1.0 - libm::exp(-decay * time_s) * (cos + decay * sin / turn);
    }
    let (slow, fast) = (libm::exp((turn - decay) * time_s), libm::exp(-(turn + decay) * time_s));
    1.0 - 0.5 * ((slow + fast) + decay * (slow - fast) / turn)
}

/// Sum of the answers to every change of the command.
fn shape(test: &StepTest, lag: Option<&Lag>, dead_s: f64) -> Vec<f64> {
    let answer = |time_s: f64| match lag {
        Some(lag) => unit_response(lag, time_s),
        None => f64::from(u8::from(time_s >= 0.0)),
    };
    let at = |time: &f64| test.changes.iter().map(|(begin, size)| size * answer(time - begin - dead_s)).sum();
    test.time_s.iter().map(at).collect()
}

/// Offset, gain and sum of squares of the best straight relation between shape and pose.
fn scaled(shape: &[f64], pose: &[f64]) -> Option<(f64, f64, f64)> {
    let count = pose.len() as f64;
    let (mean_s, mean_p) = (shape.iter().sum::<f64>() / count, pose.iter().sum::<f64>() / count);
    let products = shape.iter().zip(pose).map(|(s, p)| ((s - mean_s) * (p - mean_p), (s - mean_s) * (s - mean_s)));
    let (cross, own) = products.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
    let gain = cross / own;
    let offset = mean_p - gain * mean_s;
    let left = |(s, p): (&f64, &f64)| (p - offset - gain * s) * (p - offset - gain * s);
    let squares: f64 = shape.iter().zip(pose).map(left).sum();
    squares.is_finite().then_some((offset, gain, squares))
}

/// Fits every form to a step and chooses; `None` if the record holds no step, or no form fits at all.
pub fn fit_step(test: &StepTest) -> Option<Choice> {
    let size = test.size();
    if test.pose.len() < SAMPLES_MIN || !(size.is_finite() && size.abs() > 0.0) {
        return None;
    }
    let ways = [lag_alone(test), dead_alone(test), both(test)];
    Choice::of(ways.into_iter().flatten().collect())
}

/// Starts of natural frequency and damping.
fn starts(test: &StepTest) -> Vec<Lag> {
    let span_s = test.time_s.last().copied().unwrap_or(0.0) - test.begin_s();
    let period_s = span_s / test.time_s.len() as f64;
    // From one period in the record up to eight samples a period.
    let (low, high) = (1.0 / span_s, 0.125 / period_s);
    let ratio = libm::pow(high / low, 1.0 / (FREQUENCIES - 1) as f64);
    let mut starts = Vec::new();
    let mut natural_frequency_hz = low;
    for _ in 0..FREQUENCIES {
        starts.extend(DAMPINGS.map(|damping_ratio| Lag { natural_frequency_hz, damping_ratio }));
        natural_frequency_hz *= ratio;
    }
    let read = classical(test).and_then(|read| {
        let damping_ratio = read.damping_from_decay.unwrap_or(read.damping_from_overshoot).clamp(0.01, 0.95);
        Some(Lag { natural_frequency_hz: read.natural_frequency_hz?, damping_ratio })
    });
    starts.extend(read);
    starts
}

/// The start with the least sum of squares, with its dead time.
fn best_start(test: &StepTest, dead_s: &[f64]) -> Option<(Lag, f64)> {
    let mut best: Option<(f64, Lag, f64)> = None;
    for lag in starts(test) {
        for dead_s in dead_s {
            let Some((_, _, squares)) = scaled(&shape(test, Some(&lag), *dead_s), &test.pose) else { continue };
            if best.is_none_or(|best| squares < best.0) {
                best = Some((squares, lag, *dead_s));
            }
        }
    }
    best.map(|(_, lag, dead_s)| (lag, dead_s))
}

/// ln fₙ, ln ζ and T from the numbers of the search.
fn lag_of(values: &[f64]) -> Lag {
    Lag { natural_frequency_hz: libm::exp(values[0]), damping_ratio: libm::exp(values[1]) }
}

/// Residuals of the form whose first numbers are those of the search, then offset and gain.
fn left(test: &StepTest, lag: Option<&Lag>, dead_s: f64, offset: f64, gain: f64) -> Vec<f64> {
    let shape = shape(test, lag, dead_s);
    test.pose.iter().zip(&shape).map(|(pose, shape)| pose - offset - gain * shape).collect()
}

fn lag_alone(test: &StepTest) -> Option<Way> {
    let (start, _) = best_start(test, &[0.0])?;
    let (offset, gain, _) = scaled(&shape(test, Some(&start), 0.0), &test.pose)?;
    let first = [libm::log(start.natural_frequency_hz), libm::log(start.damping_ratio), offset, gain];
    let residuals = |v: &[f64]| left(test, Some(&lag_of(v)), 0.0, v[2], v[3]);
    let found = minimise(&residuals, &first, &[1.0, 1.0, test.size().abs(), 1.0])?;
    Some(way(test, Form::Lag, &found, Some(0), None, found.values[3]))
}

fn both(test: &StepTest) -> Option<Way> {
    let half_s = half_time_s(test)?;
    let dead: Vec<f64> = DEAD_PARTS.iter().map(|part| part * half_s).collect();
    let (start, dead_s) = best_start(test, &dead)?;
    let (offset, gain, _) = scaled(&shape(test, Some(&start), dead_s), &test.pose)?;
    let first = [libm::log(start.natural_frequency_hz), libm::log(start.damping_ratio), dead_s, offset, gain];
    let residuals = |v: &[f64]| left(test, Some(&lag_of(v)), v[2], v[3], v[4]);
    let found = minimise(&residuals, &first, &[1.0, 1.0, half_s, test.size().abs(), 1.0])?;
    Some(way(test, Form::Both, &found, Some(0), Some(2), found.values[4]))
}

/// A jump has no derivative: every place between two samples is the same, so the samples themselves are tried.
fn dead_alone(test: &StepTest) -> Option<Way> {
    let begin_s = test.begin_s();
    let mut best: Option<(f64, f64, f64)> = None;
    let mut last_s = begin_s;
    for time_s in test.time_s.iter().filter(|time| **time > begin_s) {
        // Midway between two samples.
        let dead_s = 0.5 * (last_s + time_s) - begin_s;
        last_s = *time_s;
        let Some((_, gain, squares)) = scaled(&shape(test, None, dead_s), &test.pose) else { continue };
        if best.is_none_or(|best| squares < best.0) {
            best = Some((squares, dead_s, gain));
        }
    }
    let (squares, dead_s, gain) = best?;
    let period_s = (last_s - begin_s) / test.time_s.iter().filter(|time| **time > begin_s).count() as f64;
    // Uniform between two samples.
    let deviation_s = period_s / libm::sqrt(12.0);
    let found = Solution { values: vec![dead_s, 0.0, gain], deviations: vec![deviation_s, 0.0, 0.0], squares };
    Some(way(test, Form::DeadTime, &found, None, Some(0), gain))
}

fn way(test: &StepTest, form: Form, found: &Solution, lag_at: Option<usize>, dead_at: Option<usize>, gain: f64) -> Way {
    let lag = lag_at.map(|at| {
        let lag = lag_of(&found.values[at..]);
        let deviation = Lag {
            natural_frequency_hz: lag.natural_frequency_hz * found.deviations[at],
            damping_ratio: lag.damping_ratio * found.deviations[at + 1],
        };
        (lag, deviation)
    });
    let dead_time_s = dead_at.map_or((0.0, 0.0), |at| (found.values[at], found.deviations[at]));
    let count = test.pose.len();
    let residual_rms = libm::sqrt(found.squares / count as f64);
    Way { form, lag, dead_time_s, gain, residual_rms, criterion: criterion(found.squares, count, found.values.len()) }
}

/// Time from the first change of the command until half the step is done.
fn half_time_s(test: &StepTest) -> Option<f64> {
    let first = test.pose.first()?;
    let half = 0.5 * test.size();
    let done = |pose: &f64| (pose - first) * half.signum() >= half.abs();
    let at = test.pose.iter().zip(&test.time_s).find(|(pose, time)| **time > test.begin_s() && done(pose))?;
    Some(at.1 - test.begin_s())
}
