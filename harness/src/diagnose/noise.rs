//! The noise, learned from a recording at rest: white plus a slow part of first order, which together are ARMA(1,1).
//!
//! Autocovariances of the detrended reading, `γ_k = A φ^k` for k ≥ 1 and `γ_0 = A + W`, give the slow variance A, its memory φ
//! and the white variance W. The innovation `e_t = r_t - φ r_{t-1} - θ e_{t-1}` is white: residuals are whitened by it, model
//! and measurement alike. A trend at rest is a finding (drift), never noise: it is taken out first.

use crate::case::{Case, Channel};
use crate::model::Model;
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
}

/// Lags that the autocovariance is fitted on: 60 ms, three times the memory of the slow part.
const LAGS: usize = 60;

impl Noise {
    /// From a recording at rest if there is one, else as the model declares it.
    pub fn learn(at_rest: Option<&Case>, model: &Model) -> Self {
        match at_rest {
            Some(case) => Noise::from_rest(case, model),
            None => Noise::declared(model),
        }
    }

    fn declared(model: &Model) -> Self {
        let white = model.sensor.white_sigma_n * model.sensor.white_sigma_n;
        let slow = model.sensor.slow_sigma_n * model.sensor.slow_sigma_n;
        // 0.95 per sample is what the recorded cells declare; it matters only where the slow part does.
        Noise::of(white, slow, 0.95, model.readout.position_sigma_m, false)
    }

    fn from_rest(case: &Case, model: &Model) -> Self {
        let force: Vec<f64> = detrended(&case.sensed_n);
        let gamma = autocovariance(&force, LAGS);
        let (slow, memory) = slow_part(&gamma[1..]);
        let slow = slow.clamp(0.0, 0.95 * gamma[0]);
        let position = detrended(&case.measured_m);
        let position_sigma_m = libm::sqrt(autocovariance(&position, 0)[0]).max(model.readout.position_sigma_m * 0.1);
        Noise::of(gamma[0] - slow, slow, memory, position_sigma_m, true)
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

fn autocovariance(values: &[f64], lags: usize) -> Vec<f64> {
    let n = values.len().max(1) as f64;
    let at = |lag: usize| values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>() / n;
    (0..=lags).map(at).collect()
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
