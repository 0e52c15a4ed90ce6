//! How a pose follows a command of any shape: the forms of [`super::form`], fitted sample by sample.
//!
//! Between two samples the command is a straight line `u = u₀ + s t`, as a controller draws it. A dead time then shifts it; a lag
//! answers in closed form: less the steady answer `u₀ + s t - 2 ζ s / ωₙ`, what is left decays freely,
//!
//! ```text
//! e(t) = e^{-at} (e₀ C + (v₀ + a e₀) S),   e'(t) = e^{-at} (v₀ C - (ωₙ² e₀ + a v₀) S),   a = ζ ωₙ, C = cos ω_d t, S = sin ω_d t / ω_d
//! ```
//!
//! The state at the first command is taken to be the steady answer: leave out the samples of the pose in which that could matter.

use super::excitation::Sampled;
use super::form::{Choice, Form, Lag, Way, criterion};
use super::least_squares::minimise;
use alloc::vec;
use alloc::vec::Vec;

const TAU: f64 = 2.0 * core::f64::consts::PI;
/// Delays that are tried first, up to this one. Chosen: twice the longest that a robot controller is known for (100 ms).
const DELAY_MAX_S: f64 = 0.2;
const DELAYS: usize = 101;
/// Damping of the first lags; their frequency follows from the delay.
const DAMPINGS: [f64; 3] = [0.1, 0.4, 0.8];
/// Parts of the delay that a dead time beside a lag has at first.
const DEAD_PARTS: [f64; 2] = [0.3, 0.8];
/// Fewest samples: four times what is fitted.
const SAMPLES_MIN: usize = 20;

/// Position and velocity of the answer at each sample of the command.
fn answer(command: &Sampled<'_>, lag: Option<&Lag>) -> Vec<(f64, f64)> {
    let (times, values) = (command.time_s, command.value);
    let slope = |nth: usize| (values[nth + 1] - values[nth]) / (times[nth + 1] - times[nth]);
    let Some(lag) = lag else {
        // The velocity is never asked for: between two samples of a dead time lies a straight line.
        return values.iter().map(|value| (*value, 0.0)).collect();
    };
    let omega = TAU * lag.natural_frequency_hz;
    let behind_s = 2.0 * lag.damping_ratio / omega;
    let first = slope(0);
    let (mut position, mut velocity) = (values[0] - behind_s * first, first);
    let mut states = vec![(position, velocity)];
    let (mut last_dt, mut free) = (f64::NAN, [0.0; 4]);
    for nth in 0..times.len() - 1 {
        let (dt, slope) = (times[nth + 1] - times[nth], slope(nth));
        if dt.to_bits() != last_dt.to_bits() {
            (last_dt, free) = (dt, free_motion(lag, omega, dt));
        }
        let (e, v) = (position - values[nth] + behind_s * slope, velocity - slope);
        position = values[nth + 1] - behind_s * slope + free[0] * e + free[1] * v;
        velocity = slope + free[2] * e + free[3] * v;
        states.push((position, velocity));
    }
    states
}

/// The matrix of the free motion over a time: position and velocity from position and velocity.
fn free_motion(lag: &Lag, omega: f64, dt: f64) -> [f64; 4] {
    let decay = lag.damping_ratio * omega;
    let square = omega * omega - decay * decay;
    let turn = libm::sqrt(square.abs());
    let phase = turn * dt;
    let shrink = libm::exp(-decay * dt);
    let (c, s) = if phase < 1e-4 {
        (shrink, shrink * dt)
    } else if square > 0.0 {
        (shrink * libm::cos(phase), shrink * libm::sin(phase) / turn)
    } else {
        let (slow, fast) = (libm::exp((turn - decay) * dt), libm::exp(-(turn + decay) * dt));
        (0.5 * (slow + fast), 0.5 * (slow - fast) / turn)
    };
    [c + decay * s, s, -omega * omega * s, c - decay * s]
}

/// The answer at the times of the pose, late by the dead time.
fn shape(command: &Sampled<'_>, pose: &Sampled<'_>, lag: Option<&Lag>, dead_s: f64) -> Vec<f64> {
    let states = answer(command, lag);
    let times = command.time_s;
    let mut at = 0;
    let mut value = |time_s: f64| {
        let time_s = time_s.clamp(times[0], times[times.len() - 1]);
        while at + 2 < times.len() && times[at + 1] < time_s {
            at += 1;
        }
        let dt = times[at + 1] - times[at];
        let part = (time_s - times[at]) / dt;
        let (one, other) = (states[at], states[at + 1]);
        let straight = one.0 + (other.0 - one.0) * part;
        if lag.is_none() {
            return straight;
        }
        // A cubic through both ends with their velocities.
        let (left, right) = (one.1 * dt - (other.0 - one.0), (other.0 - one.0) - other.1 * dt);
        straight + part * (1.0 - part) * (left * (1.0 - part) + right * part)
    };
    pose.time_s.iter().map(|time_s| value(time_s - dead_s)).collect()
}

/// Offset, gain and sum of squares of the best straight relation.
fn scaled(shape: &[f64], pose: &[f64]) -> (f64, f64, f64) {
    let count = pose.len() as f64;
    let (mean_s, mean_p) = (shape.iter().sum::<f64>() / count, pose.iter().sum::<f64>() / count);
    let pairs = || shape.iter().zip(pose).map(|(s, p)| (s - mean_s, p - mean_p));
    let gain = pairs().map(|(s, p)| s * p).sum::<f64>() / pairs().map(|(s, _)| s * s).sum::<f64>();
    let squares = pairs().map(|(s, p)| (p - gain * s) * (p - gain * s)).sum();
    (mean_p - gain * mean_s, gain, squares)
}

/// Fits every form and chooses. `None` if the command does not move or there are too few samples.
///
/// Both signals count their time from the same moment, and the command covers that of the pose.
pub fn follow(command: &Sampled<'_>, pose: &Sampled<'_>) -> Option<Choice> {
    if pose.value.len() < SAMPLES_MIN || command.value.len() < SAMPLES_MIN {
        return None;
    }
    let first = *command.value.first()?;
    if command.value.iter().all(|value| value.to_bits() == first.to_bits()) {
        return None;
    }
    let delays = (0..DELAYS).map(|nth| DELAY_MAX_S * nth as f64 / (DELAYS - 1) as f64);
    let squares = |delay_s: &f64| scaled(&shape(command, pose, None, *delay_s), pose.value).2;
    let delay_s = delays.map(|delay_s| (squares(&delay_s), delay_s)).min_by(|one, other| one.0.total_cmp(&other.0))?.1;
    // A robot without any delay still needs a start that can move.
    let delay_s = delay_s.max(DELAY_MAX_S / DELAYS as f64);
    let mut ways: Vec<Way> = fitted(command, pose, Form::DeadTime, None, delay_s).into_iter().collect();
    for damping_ratio in DAMPINGS {
        let lag_of = |delay_s: f64| Lag { natural_frequency_hz: 2.0 * damping_ratio / (TAU * delay_s), damping_ratio };
        ways.extend(fitted(command, pose, Form::Lag, Some(lag_of(delay_s)), 0.0));
        for part in DEAD_PARTS {
            let lag = lag_of((1.0 - part) * delay_s);
            ways.extend(fitted(command, pose, Form::Both, Some(lag), part * delay_s));
        }
    }
    Choice::of(best_of_each(ways))
}

/// Of several fits of one form the best.
fn best_of_each(ways: Vec<Way>) -> Vec<Way> {
    let forms = [Form::DeadTime, Form::Lag, Form::Both];
    let best = |form: Form| {
        let own = ways.iter().filter(|way| way.form == form);
        own.min_by(|one, other| one.criterion.total_cmp(&other.criterion)).copied()
    };
    forms.into_iter().filter_map(best).collect()
}

fn fitted(command: &Sampled<'_>, pose: &Sampled<'_>, form: Form, start: Option<Lag>, dead_s: f64) -> Option<Way> {
    let (has_lag, has_dead) = (form != Form::DeadTime, form != Form::Lag);
    let lag_of = |v: &[f64]| Lag { natural_frequency_hz: libm::exp(v[0]), damping_ratio: libm::exp(v[1]) };
    let read = |v: &[f64]| {
        let dead_s = if has_dead { v[v.len() - 3] } else { 0.0 };
        (has_lag.then(|| lag_of(v)), dead_s, v[v.len() - 2], v[v.len() - 1])
    };
    let (offset, gain, squares) = scaled(&shape(command, pose, start.as_ref(), dead_s), pose.value);
    let mut first: Vec<f64> =
        start.iter().flat_map(|lag| [libm::log(lag.natural_frequency_hz), libm::log(lag.damping_ratio)]).collect();
    let mut scales = vec![1.0; first.len()];
    if has_dead {
        first.push(dead_s);
        scales.push(0.1 * DELAY_MAX_S);
    }
    let count = pose.value.len() as f64;
    first.extend([offset, gain]);
    // The offset matters where it reaches the misfit of the start.
    scales.extend([libm::sqrt(squares / count).max(f64::MIN_POSITIVE), 1.0]);
    let residuals = |v: &[f64]| {
        let (lag, dead_s, offset, gain) = read(v);
        let shape = shape(command, pose, lag.as_ref(), dead_s);
        shape.iter().zip(pose.value).map(|(shape, pose)| pose - offset - gain * shape).collect()
    };
    let found = minimise(&residuals, &first, &scales)?;
    let (lag, dead_s, _, gain) = read(&found.values);
    let lag = lag.map(|lag| {
        let deviation = Lag {
            natural_frequency_hz: lag.natural_frequency_hz * found.deviations[0],
            damping_ratio: lag.damping_ratio * found.deviations[1],
        };
        (lag, deviation)
    });
    let dead_deviation_s = if has_dead { found.deviations[first.len() - 3] } else { 0.0 };
    Some(Way {
        form,
        lag,
        dead_time_s: (dead_s, dead_deviation_s),
        gain,
        residual_rms: libm::sqrt(found.squares / count),
        criterion: criterion(found.squares, pose.value.len(), first.len()),
    })
}
