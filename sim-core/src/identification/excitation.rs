//! Frequency response from an excitation at several frequencies, by projection.
//!
//! 1. The frequencies are read from the command: the largest peak of its projection on sine and cosine under a Hann window, then
//!    the next one in what is left, each time with all frequencies refined together by least squares.
//! 2. Command and pose are projected on these frequencies, each at its own sampling times:
//!    `x(t) = a + b t + Σ Re(X_k e^{jω_k t})`.
//! 3. `H_k = Y_k / U_k`: gain |H_k|, and the delay `-arg(H_k) / ω_k` with the phase unwrapped from the lowest frequency up.
//!
//! The equivalent delay is the mean of the delays, each weighed by its scatter; lag and dead time compete as for a step
//! ([`super::form`]), here on the H_k.

use super::form::{Choice, Form, Lag, Way};
use super::least_squares::minimise;
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::{Complex, DMatrix, DVector};

const TAU: f64 = 2.0 * core::f64::consts::PI;
/// Most frequencies that are looked for.
const LINES_MAX: usize = 16;
/// A line smaller than this part of the largest one is not one that somebody meant to excite.
const LINE_MIN: f64 = 0.01;
/// Refinements of the frequencies after each new one: each squares the relative error.
const REFINEMENTS: usize = 4;
/// Upper end of the search, in Hz: the bandwidth of a robot of this size is far below.
const FREQUENCY_MAX_HZ: f64 = 25.0;

/// One excited frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency.
    pub frequency_hz: f64,
    /// Amplitude of the command.
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
    /// Mean delay, each line weighed by its scatter, and its standard deviation.
    pub equivalent_delay_s: (f64, f64),
    /// What lies between command and pose; `None` with fewer than two lines.
    pub choice: Option<Choice>,
}

/// A sampled signal.
#[derive(Debug, Clone, Copy)]
pub struct Sampled<'a> {
    /// Times.
    pub time_s: &'a [f64],
    /// Values.
    pub value: &'a [f64],
}

impl Sampled<'_> {
    fn span_s(&self) -> f64 {
        self.time_s.last().unwrap_or(&0.0) - self.time_s.first().unwrap_or(&0.0)
    }
}

/// Amplitude of each line, with offset and slope, by least squares; and the root of the mean squared residual.
struct Projection {
    lines: Vec<Complex<f64>>,
    left: Vec<f64>,
    /// Variance of an amplitude over the variance of a sample.
    leverage: Vec<f64>,
}

/// Columns 1, t, cos, sin, … at the sampling times; time counts from the middle, so that offset and slope do not mix.
fn columns(signal: &Sampled<'_>, frequencies_hz: &[f64]) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(signal.time_s.len(), 2 + 2 * frequencies_hz.len());
    for (nth, time_s) in signal.time_s.iter().enumerate() {
        rows[(nth, 0)] = 1.0;
        rows[(nth, 1)] = *time_s;
        for (line, frequency_hz) in frequencies_hz.iter().enumerate() {
            let (sin, cos) = libm::sincos(TAU * frequency_hz * time_s);
            rows[(nth, 2 + 2 * line)] = cos;
            rows[(nth, 3 + 2 * line)] = sin;
        }
    }
    rows
}

fn project(signal: &Sampled<'_>, frequencies_hz: &[f64]) -> Option<Projection> {
    let rows = columns(signal, frequencies_hz);
    let values = DVector::from_column_slice(signal.value);
    let inverse = (rows.transpose() * &rows).cholesky()?.inverse();
    let solution = &inverse * (rows.transpose() * &values);
    let left = (values - rows * &solution).iter().copied().collect();
    let line = |nth: usize| Complex::new(solution[2 + 2 * nth], -solution[3 + 2 * nth]);
    let count = frequencies_hz.len();
    let leverage = (0..count).map(|nth| inverse[(2 + 2 * nth, 2 + 2 * nth)]).collect();
    Some(Projection { lines: (0..count).map(line).collect(), left, leverage })
}

/// The frequencies of an excitation, from low to high; empty if the command does not move.
pub fn frequencies(command: &Sampled<'_>) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    let mut largest = 0.0_f64;
    let Some(mut projection) = project(command, &found) else { return found };
    while found.len() < LINES_MAX {
        let Some((frequency_hz, amplitude)) = peak(command, &projection.left) else { break };
        largest = largest.max(amplitude);
        if amplitude <= LINE_MIN * largest {
            break;
        }
        let mut more = found.clone();
        more.push(frequency_hz);
        let refined = refine(command, &mut more).and_then(|()| project(command, &more));
        // Two lines that cannot be told apart in this record end the search.
        let Some(new) = refined else { break };
        (found, projection) = (more, new);
    }
    found.sort_by(f64::total_cmp);
    found
}

/// The largest line of a signal under a Hann window: frequency and amplitude.
fn peak(signal: &Sampled<'_>, values: &[f64]) -> Option<(f64, f64)> {
    let (span_s, first_s) = (signal.span_s(), *signal.time_s.first()?);
    let samples = signal.time_s.len() as f64;
    let top = FREQUENCY_MAX_HZ.min(0.25 * samples / span_s);
    let window: Vec<f64> = signal
        .time_s
        .iter()
        .zip(values)
        .map(|(time, value)| value * (1.0 - libm::cos(TAU * (time - first_s) / span_s)))
        .collect();
    let amplitude = |frequency_hz: f64| {
        let sum = signal.time_s.iter().zip(&window).fold((0.0, 0.0), |sum, (time, value)| {
            let (sin, cos) = libm::sincos(TAU * frequency_hz * time);
            (sum.0 + value * cos, sum.1 + value * sin)
        });
        2.0 * libm::hypot(sum.0, sum.1) / samples
    };
    let mut best = (0.0, 0.0);
    let mut frequency_hz = 1.0 / span_s;
    while frequency_hz <= top {
        let size = amplitude(frequency_hz);
        if size > best.1 {
            best = (frequency_hz, size);
        }
        frequency_hz += 0.5 / span_s;
    }
    (best.1 > 0.0).then_some(best)
}

/// All frequencies a little better: the derivative of a line by its frequency joins the columns.
fn refine(signal: &Sampled<'_>, frequencies_hz: &mut [f64]) -> Option<()> {
    for _ in 0..REFINEMENTS {
        let rows = columns(signal, frequencies_hz);
        let (wide, lines) = (rows.ncols(), frequencies_hz.len());
        let values = DVector::from_column_slice(signal.value);
        let solution = (rows.transpose() * &rows).cholesky()?.solve(&(rows.transpose() * &values));
        let mut all = rows.clone().resize_horizontally(wide + lines, 0.0);
        for nth in 0..rows.nrows() {
            for line in 0..lines {
                let (cos, sin) = (rows[(nth, 2 + 2 * line)], rows[(nth, 3 + 2 * line)]);
                let slope = -solution[2 + 2 * line] * sin + solution[3 + 2 * line] * cos;
                all[(nth, wide + line)] = TAU * signal.time_s[nth] * slope;
            }
        }
        let better = (all.transpose() * &all).cholesky()?.solve(&(all.transpose() * values));
        let limit_hz = 0.5 / signal.span_s();
        for (line, frequency_hz) in frequencies_hz.iter_mut().enumerate() {
            *frequency_hz += better[wide + line].clamp(-limit_hz, limit_hz);
        }
    }
    Some(())
}

/// The frequency response between command and pose; `None` if the command does not move or the pose is too short.
///
/// Both must count their time from the same moment, best from the middle of the record.
pub fn spectrum(command: &Sampled<'_>, pose: &Sampled<'_>) -> Option<Spectrum> {
    let frequencies_hz = frequencies(command);
    if frequencies_hz.is_empty() || pose.time_s.len() <= 2 + 2 * frequencies_hz.len() {
        return None;
    }
    let (asked, answered) = (project(command, &frequencies_hz)?, project(pose, &frequencies_hz)?);
    let free = (pose.time_s.len() - 2 - 2 * frequencies_hz.len()) as f64;
    let scatter2 = answered.left.iter().map(|left| left * left).sum::<f64>() / free;
    let mut lines = Vec::new();
    let mut last_delay_s = 0.0;
    for (nth, frequency_hz) in frequencies_hz.iter().enumerate() {
        let ratio = answered.lines[nth] / asked.lines[nth];
        let amplitude = libm::hypot(asked.lines[nth].re, asked.lines[nth].im);
        let period_s = 1.0 / frequency_hz;
        // The phase is known but for whole periods: the one next to the delay of the line below.
        let delay_s = -libm::atan2(ratio.im, ratio.re) / (TAU * frequency_hz);
        let delay_s = delay_s + period_s * libm::round((last_delay_s - delay_s) / period_s);
        last_delay_s = delay_s;
        let gain_deviation = libm::sqrt(scatter2 * answered.leverage[nth]) / amplitude;
        let gain = libm::hypot(ratio.re, ratio.im);
        lines.push(Line { frequency_hz: *frequency_hz, amplitude, gain, delay_s, gain_deviation });
    }
    let weights = lines.iter().map(|line| (line, 1.0 / (line.delay_deviation_s() * line.delay_deviation_s())));
    let (sum, weight) = weights.fold((0.0, 0.0), |sum, (line, weight)| (sum.0 + weight * line.delay_s, sum.1 + weight));
    let equivalent_delay_s = (sum / weight, libm::sqrt(1.0 / weight));
    let choice = choose(&lines, equivalent_delay_s.0);
    Some(Spectrum { lines, equivalent_delay_s, choice })
}

/// Lag, dead time or both, on the lines. The gain at rest is 1: a pose in the units of the command.
fn choose(lines: &[Line], delay_s: f64) -> Option<Choice> {
    if lines.len() < 2 {
        return None;
    }
    let response = |lag: Option<Lag>, dead_s: f64, line: &Line| {
        let omega = TAU * line.frequency_hz;
        let turn = Complex::new(libm::cos(omega * dead_s), -libm::sin(omega * dead_s));
        lag.map_or(turn, |lag| {
            let ratio = line.frequency_hz / lag.natural_frequency_hz;
            turn / Complex::new(1.0 - ratio * ratio, 2.0 * lag.damping_ratio * ratio)
        })
    };
    let left = |lag: Option<Lag>, dead_s: f64| -> Vec<f64> {
        let one = |line: &Line| {
            let phase = TAU * line.frequency_hz * line.delay_s;
            let seen = Complex::new(line.gain * libm::cos(phase), -line.gain * libm::sin(phase));
            let gap = (seen - response(lag, dead_s, line)) / Complex::new(line.gain_deviation, 0.0);
            [gap.re, gap.im]
        };
        lines.iter().flat_map(one).collect()
    };
    let lag_of = |v: &[f64]| Lag { natural_frequency_hz: libm::exp(v[0]), damping_ratio: libm::exp(v[1]) };
    let readings = 2 * lines.len();
    let mut ways = Vec::new();
    let mut add = |form: Form, with_lag: bool, with_dead: bool, start: &[f64], scales: &[f64]| {
        let of = |v: &[f64]| (with_lag.then(|| lag_of(v)), if with_dead { v[v.len() - 1] } else { 0.0 });
        let residuals = |v: &[f64]| left(of(v).0, of(v).1);
        let Some(found) = minimise(&residuals, start, scales) else { return };
        let (lag, dead_s) = of(&found.values);
        let lag = lag.map(|lag| {
            let deviation = Lag {
                natural_frequency_hz: lag.natural_frequency_hz * found.deviations[0],
                damping_ratio: lag.damping_ratio * found.deviations[1],
            };
            (lag, deviation)
        });
        let deviation_s = if with_dead { found.deviations[start.len() - 1] } else { 0.0 };
        let residual_rms = libm::sqrt(found.squares / readings as f64);
        let criterion = criterion_of_known_scatter(found.squares, readings, start.len());
        ways.push(Way { form, lag, dead_time_s: (dead_s, deviation_s), gain: 1.0, residual_rms, criterion });
    };
    let top_hz = lines.iter().map(|line| line.frequency_hz).fold(0.0, f64::max);
    let scale_s = delay_s.abs().max(1e-3);
    add(Form::DeadTime, false, true, &[delay_s], &[scale_s]);
    for damping in [0.3, 0.8] {
        let start = vec![libm::log(damping / (core::f64::consts::PI * scale_s)), libm::log(damping)];
        add(Form::Lag, true, false, &start, &[1.0, 1.0]);
        let start = vec![libm::log(2.0 * top_hz), libm::log(damping), 0.5 * delay_s];
        add(Form::Both, true, true, &start, &[1.0, 1.0, scale_s]);
    }
    Choice::of(ways)
}

/// With the scatter known from the record, the sum of squares stands for itself.
fn criterion_of_known_scatter(squares: f64, readings: usize, numbers: usize) -> f64 {
    squares + numbers as f64 * libm::log(readings as f64)
}
