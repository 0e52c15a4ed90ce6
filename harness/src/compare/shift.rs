//! The shift in time that would fit best. It is reported and applied nowhere.
//!
//! The model's signal is read at `t - s` for every s; what a recording may fit of its own is fitted again for each s (linear,
//! around the values without a shift), so that a shift is not mistaken for damping that the declared repeatability allows.

use super::clamped::Clamped;
use super::result::Shift;
use crate::diagnose::nuisance::{columns, dot};
use crate::diagnose::problem::{Problem, Scratch, Trial};
use crate::model::RigKind;
use nalgebra::{DMatrix, DVector};

/// Furthest shift that is searched. A shift at its edge is not determined.
const SHIFT_MAX_S: f64 = 0.060;
/// A finding lowers chi² by more than this: five sigma.
const GAIN_MIN: f64 = 25.0;
/// A finding is more than this many of its own standard deviations.
const SIGMAS_MIN: f64 = 2.0;
/// A finding leaves no more than this share of what it takes away above the noise, and what chance leaves there. Chosen: missing
/// friction is imitated by shifts of 19 to 36 ms that leave half of what they take; a delay or a clock leaves a sixth or less.
const LEFT_MAX: f64 = 0.25;

/// Best shift of the force, and of the reported pose.
pub fn best(problem: &Problem, index: usize, trial: &Trial, clamped: &Clamped) -> (Option<Shift>, Option<Shift>) {
    if problem.model.rig == RigKind::Drive {
        return (None, None);
    }
    (force(problem, index, trial, clamped), pose(problem, index, clamped))
}

fn force(problem: &Problem, index: usize, trial: &Trial, clamped: &Clamped) -> Option<Shift> {
    let sensed = &problem.runs[index].case.sensed_n;
    let count = sensed.value.len();
    let own = Own::of(problem, index, trial, clamped, count);
    let chi2 = |late: f64| {
        let model = crate::blocks::stamped(&clamped.force_n, late);
        let mut residual: Vec<f64> =
            sensed.value.iter().zip(&model).map(|(measured, model)| measured - model).collect();
        problem.noise.whiten(&mut residual, &sensed.known);
        own.eliminated(&residual)
    };
    let period_s = problem.runs[index].case.rates.sensor_period.seconds();
    minimum(&chi2, period_s, sensed.known.iter().filter(|known| **known).count())
}

fn pose(problem: &Problem, index: usize, clamped: &Clamped) -> Option<Shift> {
    let measured = &problem.runs[index].case.measured_m;
    let sigma_m = problem.noise.position_floor_m;
    let chi2 = |late: f64| {
        let model = crate::blocks::stamped(&clamped.measured_m, late);
        let all = measured.value.iter().zip(&model).zip(&measured.known);
        let known = all.filter(|(_, known)| **known);
        known.map(|((measured, model), _)| (measured - model) * (measured - model)).sum::<f64>() / (sigma_m * sigma_m)
    };
    let period_s = problem.runs[index].case.rates.loop_period.seconds();
    minimum(&chi2, period_s, measured.known.iter().filter(|known| **known).count())
}

/// Nuisances of one recording, linear around their values.
struct Own {
    columns: Vec<Vec<f64>>,
    inverse: Option<DMatrix<f64>>,
    /// Gradient of the prior at those values.
    pull: DVector<f64>,
    /// What the prior costs at those values.
    cost: f64,
}

impl Own {
    fn of(problem: &Problem, index: usize, trial: &Trial, clamped: &Clamped, count: usize) -> Self {
        let mut scratch = Scratch::default();
        let nuisance = &clamped.nuisance;
        let q = problem.runs[index].nuisances;
        let mut columns = columns(problem, index, trial, nuisance, &clamped.residuals, &mut scratch);
        columns.iter_mut().for_each(|column| column.truncate(count));
        let prior = |j: usize| 1.0 / (problem.declared[j] * problem.declared[j]);
        let matrix = DMatrix::from_fn(q, q, |i, j| dot(&columns[i], &columns[j]) + if i == j { prior(i) } else { 0.0 });
        Own {
            inverse: matrix.cholesky().map(|factor| factor.inverse()),
            pull: DVector::from_fn(q, |j, _| prior(j) * nuisance[j]),
            cost: (0..q).map(|j| prior(j) * nuisance[j] * nuisance[j]).sum(),
            columns,
        }
    }

    /// Chi² of a residual, the nuisances at their best for it.
    fn eliminated(&self, residual: &[f64]) -> f64 {
        let plain = dot(residual, residual) + self.cost;
        let gradient = DVector::from_fn(self.columns.len(), |j, _| dot(&self.columns[j], residual) + self.pull[j]);
        match &self.inverse {
            Some(inverse) => plain - gradient.dot(&(inverse * &gradient)),
            None => plain,
        }
    }
}

/// The minimum of chi² over the shift, in sample periods: a grid, then a golden section around its best point.
fn minimum(chi2: &dyn Fn(f64) -> f64, period_s: f64, count: usize) -> Option<Shift> {
    let reach = libm::floor(SHIFT_MAX_S / period_s) as i64;
    let here = chi2(0.0);
    let grid = (-reach..=reach).map(|shift| (shift, chi2(shift as f64)));
    let (start, _) = grid.min_by(|a, b| a.1.total_cmp(&b.1))?;
    if start.abs() == reach || !here.is_finite() {
        return None;
    }
    let (mut low, mut high) = (start as f64 - 1.0, start as f64 + 1.0);
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..30 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if chi2(a) <= chi2(b) { high = b } else { low = a }
    }
    let best = 0.5 * (low + high);
    let least = chi2(best);
    let rise = 0.5 * (chi2(best + 1.0) + chi2(best - 1.0)) - least;
    if rise.is_nan() || rise <= 0.0 {
        return None;
    }
    // Whatever else is wrong widens what can be said of the time.
    let misfit = libm::sqrt((least / (count as f64).max(1.0)).max(1.0));
    let sd = misfit / libm::sqrt(rise);
    let gain = here - least;
    let (excess, left) = (here - count as f64, least - count as f64);
    let share = if excess > 0.0 { (gain / excess).clamp(0.0, 1.0) } else { 1.0 };
    let explains = left <= LEFT_MAX * gain + libm::sqrt(2.0 * count as f64);
    Some(Shift {
        shift_ms: best * period_s * 1e3,
        sd_ms: sd * period_s * 1e3,
        gain,
        share_of_excess: share,
        finding: best.abs() > SIGMAS_MIN * sd && gain > GAIN_MIN && explains,
    })
}
