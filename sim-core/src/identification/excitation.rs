//! Frequency response from an excitation, by projection at the excited frequencies.
//!
//! 1. The frequencies are the peaks of the command's projection on sine and cosine under a Hann window.
//! 2. How the pose follows as a whole comes first ([`super::following`]): lag, dead time or both, and the equivalent delay τ.
//! 3. Command and pose are projected on each frequency, the pose under the window *shifted by τ*: what a frequency gets from its
//!    neighbours is then the same for both, and cancels in the quotient whatever the shape of the excitation.
//! 4. `H_k = Y_k / U_k`: gain |H_k|, and the delay `-arg(H_k) / ω_k` next to τ.

use super::following::follow;
use super::form::Choice;
use alloc::vec::Vec;

const TAU: f64 = 2.0 * core::f64::consts::PI;
/// A line smaller than this part of the largest one is not one that somebody meant to excite; a Hann window spills 0.9 % beyond
/// three lines.
const LINE_MIN: f64 = 0.02;
/// Two lines are at least this many times the resolution 1 / span apart: the first side lobe ends there.
const APART: usize = 3;
/// Steps of the search in one resolution.
const FINE: usize = 4;
/// Upper end of the search, in Hz: the bandwidth of a robot of this size is far below.
const FREQUENCY_MAX_HZ: f64 = 25.0;

/// A sampled signal.
#[derive(Debug, Clone, Copy)]
pub struct Sampled<'a> {
    /// Times.
    pub time_s: &'a [f64],
    /// Values.
    pub value: &'a [f64],
}

impl Sampled<'_> {
    fn first_s(&self) -> f64 {
        self.time_s.first().copied().unwrap_or(0.0)
    }

    fn span_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0) - self.first_s()
    }
}

/// One excited frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency.
    pub frequency_hz: f64,
    /// Amplitude of the command, averaged under the window.
    pub amplitude: f64,
    /// Pose over command.
    pub gain: f64,
    /// Delay of the pose behind the command.
    pub delay_s: f64,
    /// Standard deviation of the gain; that of the phase in rad is the same over the gain.
    pub gain_deviation: f64,
}

impl Line {
    /// Standard deviation of the delay.
    pub fn delay_deviation_s(&self) -> f64 {
        self.gain_deviation / (self.gain * TAU * self.frequency_hz)
    }
}

/// A frequency response.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Every excited frequency, from low to high.
    pub lines: Vec<Line>,
    /// Mean delay of the lines, each weighed by its scatter, and its standard deviation.
    pub mean_delay_s: (f64, f64),
    /// What lies between command and pose, by the fit of all samples.
    pub choice: Choice,
}

/// Where a window begins and how long it is.
#[derive(Debug, Clone, Copy)]
struct Window {
    from_s: f64,
    span_s: f64,
}

impl Window {
    /// Weight of a sample at this time: Hann, 0 outside.
    fn weight(&self, time_s: f64) -> f64 {
        let part = (time_s - self.from_s) / self.span_s;
        if (0.0..=1.0).contains(&part) { 1.0 - libm::cos(TAU * part) } else { 0.0 }
    }

    /// Mean of a signal. Taken under the window, it means the same for a pose that is late by the shift of its window.
    fn mean(&self, signal: &Sampled<'_>) -> f64 {
        let weighted = signal.time_s.iter().zip(signal.value).map(|(time_s, value)| (self.weight(*time_s), value));
        let (sum, weights) = weighted.fold((0.0, 0.0), |sum, (weight, value)| (sum.0 + weight * value, sum.1 + weight));
        sum / weights
    }
}

/// Amplitude of a line under the window, real and imaginary; and the variance of either over that of a sample, twice.
fn project(signal: &Sampled<'_>, window: Window, mean: f64, frequency_hz: f64) -> ((f64, f64), f64) {
    let (mut re, mut im, mut weights, mut squares) = (0.0, 0.0, 0.0, 0.0);
    for (time_s, value) in signal.time_s.iter().zip(signal.value) {
        let weight = window.weight(*time_s);
        let (sin, cos) = libm::sincos(TAU * frequency_hz * time_s);
        re += weight * (value - mean) * cos;
        im -= weight * (value - mean) * sin;
        weights += weight;
        squares += weight * weight;
    }
    ((2.0 * re / weights, 2.0 * im / weights), 4.0 * squares / (weights * weights))
}

/// The frequencies of an excitation, from low to high; empty if the command does not move.
pub fn frequencies(command: &Sampled<'_>) -> Vec<f64> {
    let window = Window { from_s: command.first_s(), span_s: command.span_s() };
    if command.time_s.len() < 2 * FINE || window.span_s <= 0.0 {
        return Vec::new();
    }
    let mean = window.mean(command);
    let top_hz = FREQUENCY_MAX_HZ.min(0.25 * command.time_s.len() as f64 / window.span_s);
    let step_hz = 1.0 / (FINE as f64 * window.span_s);
    let count = libm::floor(top_hz / step_hz) as usize;
    let size = |frequency_hz: f64| {
        let ((re, im), _) = project(command, window, mean, frequency_hz);
        libm::hypot(re, im)
    };
    let sizes: Vec<f64> = (0..count).map(|nth| size(step_hz * nth as f64)).collect();
    let largest = sizes.iter().skip(2 * FINE).fold(0.0_f64, |most, size| most.max(*size));
    let reach = APART * FINE;
    // Below two resolutions a line cannot be told from an offset.
    let is_peak = |nth: &usize| {
        let (from, to) = (nth.saturating_sub(reach).max(2 * FINE), (nth + reach).min(count - 1));
        let is_summit = sizes[*nth - 1] < sizes[*nth];
        is_summit && sizes[*nth] > LINE_MIN * largest && (from..=to).all(|other| sizes[other] <= sizes[*nth])
    };
    let refined = |nth: usize| {
        let [before, own, after] = [sizes[nth - 1], sizes[nth], sizes[(nth + 1).min(count - 1)]];
        let bend = before - 2.0 * own + after;
        // The summit of the parabola through three points.
        let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
        step_hz * (nth as f64 + shift)
    };
    (2 * FINE..count).filter(is_peak).map(refined).collect()
}

/// The frequency response between command and pose; `None` if the command does not move or the pose is too short.
///
/// Both count their time from the same moment, best from the middle of the record; the command begins earlier than the pose by what
/// the robot needs to swing in.
pub fn spectrum(command: &Sampled<'_>, pose: &Sampled<'_>) -> Option<Spectrum> {
    let choice = follow(command, pose)?;
    let way = choice.way();
    let late_s = way.equivalent_delay_s();
    let frequencies_hz = frequencies(command);
    // The pose under the shifted window: it must reach as far as the window does.
    let from_s = pose.first_s() - late_s.min(0.0);
    let last_s = pose.first_s() + pose.span_s() - late_s.max(0.0);
    let window = Window { from_s, span_s: last_s - from_s };
    let shifted = Window { from_s: from_s + late_s, ..window };
    let (mean_asked, mean_got) = (window.mean(command), shifted.mean(pose));
    let line = |frequency_hz: &f64| {
        let ((u_re, u_im), _) = project(command, window, mean_asked, *frequency_hz);
        let ((y_re, y_im), spread) = project(pose, shifted, mean_got, *frequency_hz);
        let amplitude = libm::hypot(u_re, u_im);
        let phase = libm::atan2(y_im, y_re) - libm::atan2(u_im, u_re);
        let period_s = 1.0 / frequency_hz;
        // The phase is known but for whole periods: the delay next to that of the whole.
        let delay_s = -phase / (TAU * frequency_hz);
        let delay_s = delay_s + period_s * libm::round((late_s - delay_s) / period_s);
        let gain_deviation = way.residual_rms * libm::sqrt(0.5 * spread) / amplitude;
        Line {
            frequency_hz: *frequency_hz,
            amplitude,
            gain: libm::hypot(y_re, y_im) / amplitude,
            delay_s,
            gain_deviation,
        }
    };
    let lines: Vec<Line> = frequencies_hz.iter().map(line).collect();
    let weigh = |line: &Line| 1.0 / (line.delay_deviation_s() * line.delay_deviation_s()).max(f64::MIN_POSITIVE);
    let weight: f64 = lines.iter().map(weigh).sum();
    let mean_delay_s = if lines.is_empty() {
        (late_s, way.dead_time_s.1)
    } else {
        (lines.iter().map(|line| weigh(line) * line.delay_s).sum::<f64>() / weight, libm::sqrt(1.0 / weight))
    };
    Some(Spectrum { lines, mean_delay_s, choice })
}
