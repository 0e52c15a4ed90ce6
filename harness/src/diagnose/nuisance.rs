//! What one recording may fit of its own with everything else held: force offset, stiffness, damping, inside the declared
//! repeatability.
//!
//! The declared standard deviation is the prior, and [`FITTED_SIGMAS_MAX`] times it the limit: a model that is far off would
//! otherwise buy its error away with a stiffness that no repeatability allows.

use super::problem::{Nuisance, Problem, Scratch, Trial};
use nalgebra::DMatrix;

/// How many times its declared standard deviation a number of one recording may be fitted away.
pub const FITTED_SIGMAS_MAX: f64 = 3.0;

/// Gauss-Newton in a box: the squares of the residuals and of the nuisances, none further than its limit.
pub fn bounded(problem: &Problem, index: usize, trial: &Trial, scratch: &mut Scratch) -> Nuisance {
    let count = problem.runs[index].nuisances;
    let mut nuisance = problem.first_nuisance(&problem.runs[index]);
    for _ in 0..4 {
        let here = problem.residuals(index, trial, &nuisance, scratch);
        let columns = columns(problem, index, trial, &nuisance, &here, scratch);
        let prior = |j: usize| 1.0 / (problem.declared[j] * problem.declared[j]);
        let gradient: Vec<f64> = columns.iter().map(|column| dot(column, &here)).collect();
        let matrix = DMatrix::from_fn(count, count, |i, j| dot(&columns[i], &columns[j]));
        let from = nuisance;
        // The box is a product of intervals, so that going round the coordinates ends at the least value inside it.
        for _ in 0..200 {
            for j in 0..count {
                let moved = |i: usize| nuisance[i] - from[i];
                let moves: f64 = (0..count).map(|i| matrix[(j, i)] * moved(i)).sum();
                let slope = gradient[j] + moves + prior(j) * nuisance[j];
                let curvature = matrix[(j, j)] + prior(j);
                let limit = FITTED_SIGMAS_MAX * problem.declared[j];
                nuisance[j] = (nuisance[j] - slope / curvature).clamp(-limit, limit);
            }
        }
    }
    nuisance
}

/// Difference quotients of the residuals by each nuisance of a docking run, residuals `here` at `nuisance`.
pub fn columns(
    problem: &Problem,
    index: usize,
    trial: &Trial,
    nuisance: &Nuisance,
    here: &[f64],
    scratch: &mut Scratch,
) -> Vec<Vec<f64>> {
    // A thousandth of 1 N or of the value itself: small against what matters, large against rounding.
    const NUDGE: f64 = 1e-3;
    let mut column = |j: usize| {
        let mut moved = *nuisance;
        moved[j] += NUDGE;
        let there = problem.residuals(index, trial, &moved, scratch);
        there.iter().zip(here).map(|(there, here)| (there - here) / NUDGE).collect()
    };
    (0..problem.runs[index].nuisances).map(&mut column).collect()
}

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
