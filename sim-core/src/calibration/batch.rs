//! Iterative batch of weighted least squares (Gauss-Newton), and the covariance that it states.

use super::measurement::{Parameters, StaticPose, Terms};
use super::observability::{DISTINCT_RAD, distinct};
use super::start::start;
use crate::refusal::{Refusal, positive};
use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector, Vector6};

/// Fewest distinct directions of gravity: two leave a turn about the line between them open.
pub const DIRECTIONS_MIN: usize = 3;
/// A step counts as none when it is this small in its own standard deviations. Chosen: no printed digit changes.
const STEP_IN_DEVIATIONS: f64 = 1e-4;
/// More iterations than any sound problem needs (three or four).
const ITERATIONS_MAX: usize = 20;
/// Least eigenvalue of the normal matrix, scaled to a unit diagonal, that counts as determined. Its square root is the part of
/// the digits that survives: below 1e-12 fewer than ten of sixteen are left for the residuals.
const EIGENVALUE_MIN: f64 = 1e-12;

/// One standard deviation of the mean reading of a pose, as repeated visits would scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of each force.
    pub force_sigma_n: f64,
    /// Of each torque.
    pub torque_sigma_n_m: f64,
}

impl Noise {
    /// Of the axis: three forces, then three torques.
    pub fn of(&self, axis: usize) -> f64 {
        if axis < 3 { self.force_sigma_n } else { self.torque_sigma_n_m }
    }
}

/// A finished calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// What was found.
    pub parameters: Parameters,
    /// Which of it was estimated.
    pub terms: Terms,
    /// The noise that weighs forces against torques.
    pub noise: Noise,
    /// Covariance of the estimated numbers, in the order of [`Terms::names`].
    pub covariance: DMatrix<f64>,
    /// Size of each step, in its own standard deviations.
    pub steps: Vec<f64>,
    /// Reading less prediction, pose by pose: forces, then torques.
    pub residuals: Vec<Vector6<f64>>,
    /// Root of the mean squared residual in standard deviations, per degree of freedom: 1 if the noise is as stated.
    pub weighted_rms: f64,
    /// Noise that the residuals show, with the degrees of freedom that the estimate took; `None` where none is left.
    pub observed_noise: Option<Noise>,
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unsolved {
    /// A number without meaning.
    #[error("{0}")]
    Value(#[from] Refusal),
    /// Too few attitudes.
    #[error("{found} distinct directions of gravity, at least {DIRECTIONS_MIN} are needed")]
    Directions {
        /// How many there are.
        found: usize,
    },
    /// More numbers than readings.
    #[error("{poses} poses give {} readings for {unknown} unknown numbers", 6 * poses)]
    Poses {
        /// How many poses there are.
        poses: usize,
        /// How many numbers are asked for.
        unknown: usize,
    },
    /// Readings that do not depend on a number.
    #[error("the poses do not show the {name}")]
    Unobservable {
        /// The number with the largest part in the direction that does not show.
        name: &'static str,
    },
    /// It runs away.
    #[error("no convergence within {ITERATIONS_MAX} iterations")]
    Diverged,
}

impl Calibration {
    /// Standard deviation of each estimated number, in the order of [`Terms::names`].
    pub fn deviations(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| libm::sqrt(*variance)).collect()
    }

    /// Covariance of the predicted reading when gravity points there: what the calibration itself is worth.
    pub fn prediction_covariance(&self, gravity_m_per_s2: &nalgebra::Vector3<f64>) -> DMatrix<f64> {
        let rows = self.parameters.jacobian(gravity_m_per_s2, 0.0, self.terms);
        &rows * &self.covariance * rows.transpose()
    }
}

/// Calibrates.
pub fn calibrate(poses: &[StaticPose], noise: Noise, terms: Terms) -> Result<Calibration, Unsolved> {
    positive("force_sigma_n", noise.force_sigma_n, "N")?;
    positive("torque_sigma_n_m", noise.torque_sigma_n_m, "N m")?;
    poses.iter().try_for_each(StaticPose::check)?;
    let directions = distinct(poses.iter().map(|pose| &pose.gravity_m_per_s2), DISTINCT_RAD);
    if directions.len() < DIRECTIONS_MIN {
        return Err(Unsolved::Directions { found: directions.len() });
    }
    if 6 * poses.len() < terms.count() {
        return Err(Unsolved::Poses { poses: poses.len(), unknown: terms.count() });
    }
    let mut parameters = start(poses, terms).ok_or(Unsolved::Unobservable { name: "centre of mass" })?;
    let mut steps = Vec::new();
    for _ in 0..ITERATIONS_MAX {
        let (normal, right) = normal_equations(poses, &parameters, noise, terms);
        let covariance = inverse(&normal, terms)?;
        let step = &covariance * &right;
        steps.push(libm::sqrt(step.dot(&right).max(0.0)));
        parameters = parameters.moved(&step, terms);
        if steps.last().is_some_and(|size| *size < STEP_IN_DEVIATIONS) {
            return finished(poses, parameters, noise, terms, steps);
        }
    }
    Err(Unsolved::Diverged)
}

/// `Hᵀ R⁻¹ H` and `Hᵀ R⁻¹ (z - h)`.
fn normal_equations(
    poses: &[StaticPose],
    parameters: &Parameters,
    noise: Noise,
    terms: Terms,
) -> (DMatrix<f64>, DVector<f64>) {
    let count = terms.count();
    let (mut normal, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
    for pose in poses {
        let rows = weighted_rows(pose, parameters, noise, terms);
        let left = parameters.contact(pose);
        let left = DVector::from_fn(6, |axis, _| left[axis] / noise.of(axis));
        normal += rows.transpose() * &rows;
        right += rows.transpose() * left;
    }
    (normal, right)
}

/// Rows of H, each over its noise.
fn weighted_rows(pose: &StaticPose, parameters: &Parameters, noise: Noise, terms: Terms) -> DMatrix<f64> {
    let mut rows = parameters.jacobian(&pose.gravity_m_per_s2, pose.warmer_k, terms);
    for (axis, mut row) in rows.row_iter_mut().enumerate() {
        row /= noise.of(axis);
    }
    rows
}

/// The inverse, by eigenvalues of the matrix scaled to a unit diagonal: so that what does not show can be named.
pub(super) fn inverse(normal: &DMatrix<f64>, terms: Terms) -> Result<DMatrix<f64>, Unsolved> {
    let count = normal.nrows();
    let name = |nth: usize| Unsolved::Unobservable { name: terms.names()[nth].0 };
    let scale: Vec<f64> = normal.diagonal().iter().map(|value| libm::sqrt(*value)).collect();
    if let Some(nth) = scale.iter().position(|value| !(value.is_finite() && *value > 0.0)) {
        return Err(name(nth));
    }
    let scaled = DMatrix::from_fn(count, count, |row, column| normal[(row, column)] / (scale[row] * scale[column]));
    let eigen = scaled.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    if eigen.eigenvalues[least] < EIGENVALUE_MIN {
        return Err(name(eigen.eigenvectors.column(least).icamax()));
    }
    let inverted = &eigen.eigenvectors
        * DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| 1.0 / value))
        * eigen.eigenvectors.transpose();
    Ok(DMatrix::from_fn(count, count, |row, column| inverted[(row, column)] / (scale[row] * scale[column])))
}

fn finished(
    poses: &[StaticPose],
    parameters: Parameters,
    noise: Noise,
    terms: Terms,
    steps: Vec<f64>,
) -> Result<Calibration, Unsolved> {
    let (normal, _) = normal_equations(poses, &parameters, noise, terms);
    let covariance = inverse(&normal, terms)?;
    let residuals: Vec<Vector6<f64>> = poses.iter().map(|pose| parameters.contact(pose)).collect();
    // What the estimate took from each group: the trace of its part of the hat matrix.
    let (mut taken, mut squares) = ([0.0; 2], [0.0; 2]);
    for (pose, residual) in poses.iter().zip(&residuals) {
        let rows = weighted_rows(pose, &parameters, noise, terms);
        let hat = &rows * &covariance * rows.transpose();
        for axis in 0..6 {
            let scaled = residual[axis] / noise.of(axis);
            taken[axis / 3] += hat[(axis, axis)];
            squares[axis / 3] += scaled * scaled;
        }
    }
    let readings = 3.0 * poses.len() as f64;
    let free = [readings - taken[0], readings - taken[1]];
    let all = free[0] + free[1];
    // Below half a reading the quotient is noise over noise.
    let weighted_rms = if all > 0.5 { libm::sqrt((squares[0] + squares[1]) / all) } else { 0.0 };
    let observed_noise = (free[0] > 0.5 && free[1] > 0.5).then(|| Noise {
        force_sigma_n: noise.force_sigma_n * libm::sqrt(squares[0] / free[0]),
        torque_sigma_n_m: noise.torque_sigma_n_m * libm::sqrt(squares[1] / free[1]),
    });
    Ok(Calibration { parameters, terms, noise, covariance, steps, residuals, weighted_rms, observed_noise })
}
