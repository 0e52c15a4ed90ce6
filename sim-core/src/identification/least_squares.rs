//! Nonlinear least squares for a handful of numbers: Levenberg and Marquardt, with derivatives by central differences.

use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector};

/// More steps than a sound problem of five numbers needs.
const STEPS_MAX: usize = 60;
/// A relative fall of the sum of squares below this is none: it is near the rounding of the sum.
const FALL_MIN: f64 = 1e-12;
/// Difference for a derivative, relative to the scale of the number: the cube root of the rounding of f64.
const DIFFERENCE: f64 = 6e-6;
const DAMPING_FIRST: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e12;

/// Where the iteration ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The numbers.
    pub values: Vec<f64>,
    /// Standard deviation of each, from the scatter of the residuals.
    pub deviations: Vec<f64>,
    /// Sum of the squared residuals.
    pub squares: f64,
}

/// Minimises the sum of squared residuals, from a start; `scales` are sizes at which each number matters.
///
/// `None` if the residuals are not finite at the start. Where a number does not matter, or only together with another one, nothing
/// is known of any: the deviations are infinite.
pub fn minimise(residuals: &dyn Fn(&[f64]) -> Vec<f64>, start: &[f64], scales: &[f64]) -> Option<Solution> {
    let mut values = start.to_vec();
    let mut left = DVector::from_vec(residuals(&values));
    let mut squares = left.norm_squared();
    if !squares.is_finite() {
        return None;
    }
    let mut damping = DAMPING_FIRST;
    let mut rows = jacobian(residuals, &values, scales, left.len());
    for _ in 0..STEPS_MAX {
        let (normal, right) = (rows.transpose() * &rows, rows.transpose() * &left);
        let mut damped = normal.clone();
        for nth in 0..values.len() {
            damped[(nth, nth)] += damping * normal[(nth, nth)];
        }
        let Some(solved) = damped.cholesky() else { break };
        let step = solved.solve(&right);
        let trial: Vec<f64> = values.iter().zip(step.iter()).map(|(value, part)| value - part).collect();
        let trial_left = DVector::from_vec(residuals(&trial));
        let trial_squares = trial_left.norm_squared();
        if trial_squares.is_finite() && trial_squares <= squares {
            let fall = squares - trial_squares;
            (values, left, squares) = (trial, trial_left, trial_squares);
            rows = jacobian(residuals, &values, scales, left.len());
            damping *= 0.2;
            if fall <= FALL_MIN * squares {
                break;
            }
        } else {
            damping *= 8.0;
            if damping > DAMPING_MAX {
                break;
            }
        }
    }
    let free = left.len().saturating_sub(values.len()).max(1) as f64;
    let deviations = match (rows.transpose() * &rows).cholesky() {
        Some(solved) => solved.inverse().diagonal().iter().map(|part| libm::sqrt(part * squares / free)).collect(),
        None => alloc::vec![f64::INFINITY; values.len()],
    };
    Some(Solution { values, deviations, squares })
}

fn jacobian(residuals: &dyn Fn(&[f64]) -> Vec<f64>, at: &[f64], scales: &[f64], count: usize) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(count, at.len());
    for (nth, scale) in scales.iter().enumerate() {
        let h = DIFFERENCE * scale;
        let moved = |by: f64| {
            let mut values = at.to_vec();
            values[nth] += by;
            DVector::from_vec(residuals(&values))
        };
        rows.column_mut(nth).copy_from(&((moved(h) - moved(-h)) / (2.0 * h)));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of Rosenbrock as residuals: its minimum is (1, 1) and 0.
    #[test]
    fn a_bent_valley_is_followed_to_its_end() {
        let residuals = |x: &[f64]| alloc::vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
        let found = minimise(&residuals, &[-1.2, 1.0], &[1.0, 1.0]).unwrap();
        assert!(found.squares < 1e-20 && (found.values[1] - 1.0).abs() < 1e-9, "{found:?}");
        assert_eq!(minimise(&|_: &[f64]| alloc::vec![f64::NAN], &[0.0], &[1.0]), None);
        let idle = minimise(&|_: &[f64]| alloc::vec![1.0, 2.0], &[0.0], &[1.0]).unwrap();
        assert_eq!(idle.deviations, [f64::INFINITY], "a number that does not matter");
    }
}
