//! The noise, learned from a recording at rest: white plus a slow part of first order, which together are ARMA(1,1).
//!
//! Autocovariances of the detrended reading, `γ_k = A φ^k` for k ≥ 1 and `γ_0 = A + W`, give the slow variance A, its memory φ
//! and the white variance W. The innovation `e_t = r_t - φ r_{t-1} - θ e_{t-1}` is white: residuals are whitened by it, model
//! and measurement alike. A trend at rest is a finding (drift), never noise: it is taken out first.

use crate::case::{Case, Channel};
use crate::model::Model;
use crate::recording::Kind;
use serde::Serialize;

/// Noise of the force reading and of the reported position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Noise {
    /// Memory of the slow part, per sample.
    pub slow_memory: f64,
    /// Moving-average coefficient θ of the whitening filter.
    pub average: f64,
    /// Standard deviation of an innovation, N.
    pub innovation_n: f64,
    /// Standard deviation of the reading at rest, N: the noise floor of every residual.
    pub force_floor_n: f64,
    /// Standard deviation of the reported position, m.
    pub position_floor_m: f64,
    /// Whether a static recording was there; otherwise the model's declared noise holds.
    pub learned: bool,
    /// Scatter at rest over the declared one, where that is so large that it is a finding and no noise; else 0.
    pub excess: f64,
}

/// Lags that the autocovariance is fitted on: 60 ms, three times the memory of the slow part.
const LAGS: usize = 60;
/// Memory of the slow part per sample, as the recorded cells declare it.
const DECLARED_MEMORY: f64 = 0.95;
/// How many samples the declared noise is worth: ten seconds.
const DECLARED_SAMPLES: f64 = 10_000.0;
/// Scatter at rest above this multiple of the declared one is a finding: four seconds know it to a few per cent.
const EXCESS_MAX: f64 = 1.2;
/// Distance from the nominal plane beyond which nothing touches, in the reported pose.
const FAR_M: f64 = 0.0015;
/// Time by which a slow sensor has settled, and by which the reported pose is late at most.
const SETTLED_S: f64 = 0.1;

impl Noise {
    /// From a recording at rest if there is one, else as the model declares it. How the noise hangs together needs more than the
    /// few seconds at rest: where impacts are far from contact they count too. The floors are those of the recording at rest.
    pub fn learn(cases: &[Case], model: &Model) -> Self {
        match cases.iter().find(|case| case.kind == Kind::Static) {
            Some(rest) => Noise::from_rest(rest, cases, model),
            None => Noise::declared(model),
        }
    }

    fn declared(model: &Model) -> Self {
        let white = model.sensor.white_sigma_n * model.sensor.white_sigma_n;
        let slow = model.sensor.slow_sigma_n * model.sensor.slow_sigma_n;
        Noise::of(white, slow, DECLARED_MEMORY, model.readout.position_sigma_m, false)
    }

    fn from_rest(rest: &Case, cases: &[Case], model: &Model) -> Self {
        let at_rest = detrended(&rest.sensed_n);
        let force_floor_n = libm::sqrt(autocovariance(std::slice::from_ref(&at_rest), 0)[0]);
        let mut quiet = vec![at_rest];
        quiet.extend(cases.iter().filter(|case| case.is_impact()).flat_map(far_from_contact));
        let gamma = with_declared(&autocovariance(&quiet, LAGS), quiet.iter().map(Vec::len).sum(), model);
        let (slow, memory) = slow_part(&gamma[1..]);
        let slow = slow.clamp(0.0, 0.95 * gamma[0]);
        let position = [detrended(&rest.measured_m)];
        let position_sigma_m = libm::sqrt(autocovariance(&position, 0)[0]).max(model.readout.position_sigma_m * 0.1);
        let declared = Noise::declared(model);
        let excess = if declared.force_floor_n > 0.0 { force_floor_n / declared.force_floor_n } else { 0.0 };
        if excess > EXCESS_MAX {
            // A hum at rest is no noise: whitened by itself it would vanish from every residual.
            return Noise { force_floor_n, position_floor_m: position_sigma_m, learned: true, excess, ..declared };
        }
        Noise { force_floor_n, ..Noise::of(gamma[0] - slow, slow, memory, position_sigma_m, true) }
    }

    fn of(white: f64, slow: f64, memory: f64, position_floor_m: f64, learned: bool) -> Self {
        // (1 - φB) r = e + θ e₋₁ has γ₀ = W(1+φ²) + A(1-φ²) and γ₁ = -φW of its right-hand side.
        let g0 = white * (1.0 + memory * memory) + slow * (1.0 - memory * memory);
        let g1 = -memory * white;
        let (average, variance) = if g1 == 0.0 {
            (0.0, g0)
        } else {
            let half = g0 / (2.0 * g1);
            // Of the two roots of θ² - (g0/g1) θ + 1 the one inside the unit circle is invertible.
            let average = half - half.signum() * libm::sqrt((half * half - 1.0).max(0.0));
            (average, g1 / average)
        };
        Noise {
            slow_memory: memory,
            average,
            innovation_n: libm::sqrt(variance),
            force_floor_n: libm::sqrt(white + slow),
            position_floor_m,
            learned,
            excess: 0.0,
        }
    }

    /// Turns residuals of the force into white noise of unit variance, in place. Ticks that are not known count as zero.
    pub fn whiten(&self, residual_n: &mut [f64], known: &[bool]) {
        let (mut before, mut innovation) = (0.0, 0.0);
        for (residual, known) in residual_n.iter_mut().zip(known) {
            let now = if *known { *residual } else { 0.0 };
            innovation = now - self.slow_memory * before - self.average * innovation;
            before = now;
            *residual = innovation / self.innovation_n;
        }
    }
}

/// A channel without its mean and its straight trend.
pub fn detrended(channel: &Channel) -> Vec<f64> {
    let (_, slope, mean, centre) = trend(channel);
    let values = channel.value.iter().enumerate().zip(&channel.known);
    values.filter(|(_, known)| **known).map(|((i, value), _)| value - mean - slope * (i as f64 - centre)).collect()
}

/// Number of known samples, slope per sample, mean, and the place of the mean.
pub fn trend(channel: &Channel) -> (usize, f64, f64, f64) {
    let points = || channel.value.iter().enumerate().zip(&channel.known).filter(|(_, known)| **known);
    let count = points().count();
    let n = (count as f64).max(1.0);
    let centre = points().map(|((i, _), _)| i as f64).sum::<f64>() / n;
    let mean = points().map(|((_, value), _)| *value).sum::<f64>() / n;
    let (mut sxx, mut sxy) = (0.0, 0.0);
    for ((i, value), _) in points() {
        let x = i as f64 - centre;
        sxx += x * x;
        sxy += x * (value - mean);
    }
    (count, if sxx > 0.0 { sxy / sxx } else { 0.0 }, mean, centre)
}

/// The stretches of an impact in which nothing can touch: well before the nominal plane, and well after it. Each without its mean
/// and trend.
fn far_from_contact(case: &Case) -> Vec<Vec<f64>> {
    let near = |position_m: &f64| *position_m > -FAR_M;
    let (first, last) = (case.measured_m.value.iter().position(near), case.measured_m.value.iter().rposition(near));
    let (Some(first), Some(last)) = (first, last) else { return Vec::new() };
    let before_s = case.loop_time_s(first) - SETTLED_S;
    let after_s = case.loop_time_s(last) + SETTLED_S;
    let stretch = |keep: &dyn Fn(f64) -> bool| {
        let ticks = (0..case.sensed_n.value.len()).filter(|&tick| keep(case.sensor_time_s(tick)));
        let (value, known) = ticks.map(|tick| (case.sensed_n.value[tick], case.sensed_n.known[tick])).unzip();
        detrended(&Channel { value, known })
    };
    let stretches = [stretch(&|time_s| time_s < before_s), stretch(&|time_s| time_s > after_s)];
    stretches.into_iter().filter(|stretch| stretch.len() > 4 * LAGS).collect()
}

/// Autocovariances together with the declared ones: a few seconds at rest hold too few periods of the slow part to tell its size
/// to better than a third, and taking their mean and trend out makes it look smaller still.
fn with_declared(gamma: &[f64], samples: usize, model: &Model) -> Vec<f64> {
    let slow = model.sensor.slow_sigma_n * model.sensor.slow_sigma_n;
    let white = model.sensor.white_sigma_n * model.sensor.white_sigma_n;
    if white == 0.0 {
        return gamma.to_vec();
    }
    let share = DECLARED_SAMPLES / (DECLARED_SAMPLES + samples as f64);
    let declared = |lag: usize| slow * libm::pow(DECLARED_MEMORY, lag as f64) + if lag == 0 { white } else { 0.0 };
    gamma.iter().enumerate().map(|(lag, found)| share * declared(lag) + (1.0 - share) * found).collect()
}

/// Autocovariances over several stretches.
fn autocovariance(stretches: &[Vec<f64>], lags: usize) -> Vec<f64> {
    let n = stretches.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let product =
        |values: &Vec<f64>, lag: usize| values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
    (0..=lags).map(|lag| stretches.iter().map(|values| product(values, lag)).sum::<f64>() / n).collect()
}

/// Variance and memory of the slow part: `A φ^k` through the autocovariances of lags 1, 2, …, by least squares on a grid of φ.
fn slow_part(gamma: &[f64]) -> (f64, f64) {
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for step in 0..=98 {
        let memory = step as f64 * 0.01;
        let (mut sxx, mut sxy, mut syy, mut power) = (0.0, 0.0, 0.0, memory);
        for value in gamma {
            sxx += power * power;
            sxy += power * value;
            syy += value * value;
            power *= memory;
        }
        let size = if sxx > 0.0 { (sxy / sxx).max(0.0) } else { 0.0 };
        let left = syy - 2.0 * size * sxy + size * size * sxx;
        if left < best.0 {
            best = (left, size, memory);
        }
    }
    (best.1, best.2)
}
