//! What a set of poses can show, and which poses to add.
//!
//! A calibration is worth what it predicts: the covariance `J P Jᵀ` of the predicted force, with gravity in any direction. Among
//! the poses that were visited it is small by construction; elsewhere it may be ten times larger. The direction where it is
//! largest is the next pose to visit, since that pose takes most from the largest uncertainty.
//!
//! The yardstick is the same number of poses with gravity spread evenly over the sphere.

use super::batch::{Calibration, inverse};
use super::measurement::StaticPose;
use alloc::vec::Vec;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Two directions of gravity closer than this are one. Chosen: 1 kg then changes its reading by 0.17 N, about the error that the
/// thesis gives for its sensor (0.25 N).
pub const DISTINCT_RAD: f64 = core::f64::consts::PI / 180.0;
/// Directions that are tried: 12 degrees apart.
const GRID: usize = 200;
/// Most poses that are proposed at once.
const ADD_MAX: usize = 4;
/// Proposed poses keep this far apart: 30 degrees. Chosen, so that four of them are four attitudes.
const APART_RAD: f64 = core::f64::consts::PI / 6.0;
/// How many times the yardstick is good enough. Chosen: of 36 poses a full turn about one axis has 1.0,
/// ± 60° have 4.5, ± 30° have 18.
pub const ENOUGH: f64 = 3.0;

/// The least known combination of three numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weakest {
    /// The combination, as a unit vector in the sensor's own axes.
    pub direction: Vector3<f64>,
    /// Its standard deviation.
    pub deviation: f64,
    /// The largest standard deviation that evenly spread poses would leave.
    pub even: f64,
}

/// A pose to add.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Addition {
    /// Gravity there, as a unit vector in the nominal axes of the sensor.
    pub direction: Vector3<f64>,
    /// Largest standard deviation of the predicted force, in any attitude, once this and the earlier ones are added.
    pub anywhere_n: f64,
    /// Largest standard deviation of the force's bias then.
    pub bias_n: f64,
}

/// What a set of poses can show.
#[derive(Debug, Clone, PartialEq)]
pub struct Observability {
    /// Distinct directions of gravity.
    pub directions: usize,
    /// Largest angle between two of them.
    pub opening_rad: f64,
    /// Least known part of the force's bias, in N.
    pub bias: Weakest,
    /// Least known part of the misalignment, in rad, if it is estimated.
    pub misalignment: Option<Weakest>,
    /// Largest standard deviation of the predicted force among the poses.
    pub visited_n: f64,
    /// The same in any attitude.
    pub anywhere_n: f64,
    /// The same if the poses were spread evenly.
    pub even_n: f64,
    /// Poses to add, the most useful first; empty if it is good enough.
    pub add: Vec<Addition>,
}

impl Observability {
    /// Whether more attitudes would help little.
    pub fn is_enough(&self) -> bool {
        self.anywhere_n <= ENOUGH * self.even_n
    }
}

/// Unit vectors of which no two are closer than `least_rad`, in the order of their first visit.
pub fn distinct<'a>(directions: impl Iterator<Item = &'a Vector3<f64>>, least_rad: f64) -> Vec<Vector3<f64>> {
    let mut found: Vec<Vector3<f64>> = Vec::new();
    for direction in directions {
        let unit = direction.normalize();
        if found.iter().all(|other| angle(other, &unit) >= least_rad) {
            found.push(unit);
        }
    }
    found
}

/// Angle between two unit vectors; exact for small ones too.
fn angle(one: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    2.0 * libm::atan2((one - other).norm(), (one + other).norm())
}

/// `count` unit vectors, nearly evenly over the sphere (Fibonacci lattice).
pub fn even(count: usize) -> Vec<Vector3<f64>> {
    let golden = core::f64::consts::PI * (3.0 - libm::sqrt(5.0));
    let unit = |nth: usize| {
        let z = 1.0 - (2.0 * nth as f64 + 1.0) / count as f64;
        let radius = libm::sqrt(1.0 - z * z);
        let turn = golden * nth as f64;
        Vector3::new(radius * libm::cos(turn), radius * libm::sin(turn), z)
    };
    (0..count).map(unit).collect()
}

/// Judges the poses of a calibration.
pub fn observe(calibration: &Calibration, poses: &[StaticPose]) -> Observability {
    let gravity_size = poses.iter().map(|pose| pose.gravity_m_per_s2.norm()).sum::<f64>() / poses.len().max(1) as f64;
    let scaled = |units: Vec<Vector3<f64>>| units.into_iter().map(|unit| unit * gravity_size).collect::<Vec<_>>();
    let grid = scaled(even(GRID));
    let visited: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.gravity_m_per_s2).collect();
    let mut covariance = calibration.covariance.clone();
    let spread = spread_covariance(calibration, &scaled(even(poses.len())));
    let yardstick = spread.as_ref().unwrap_or(&covariance);
    let even_n = largest(calibration, yardstick, &grid).1;
    let weakest = |at: usize| {
        let (direction, deviation) = principal(&block(&covariance, at));
        Weakest { direction, deviation, even: principal(&block(yardstick, at)).1 }
    };
    let units = distinct(visited.iter(), DISTINCT_RAD);
    let mut found = Observability {
        directions: units.len(),
        opening_rad: units.iter().flat_map(|one| units.iter().map(move |other| angle(one, other))).fold(0.0, f64::max),
        bias: weakest(0),
        misalignment: calibration.terms.misalignment.then(|| weakest(10)),
        visited_n: largest(calibration, &covariance, &visited).1,
        anywhere_n: largest(calibration, &covariance, &grid).1,
        even_n,
        add: Vec::new(),
    };
    let mut anywhere_n = found.anywhere_n;
    while anywhere_n > ENOUGH * even_n && found.add.len() < ADD_MAX {
        let apart = |gravity: &&Vector3<f64>| {
            found.add.iter().all(|old| angle(&old.direction, &(**gravity / gravity_size)) > APART_RAD)
        };
        let free: Vec<Vector3<f64>> = grid.iter().filter(apart).copied().collect();
        let (worst, _) = largest(calibration, &covariance, &free);
        covariance = with_pose(calibration, &covariance, &worst);
        anywhere_n = largest(calibration, &covariance, &grid).1;
        let bias_n = principal(&block(&covariance, 0)).1;
        found.add.push(Addition { direction: worst / gravity_size, anywhere_n, bias_n });
    }
    found
}

/// Covariance that poses with these directions of gravity would leave; `None` if they leave something open.
fn spread_covariance(calibration: &Calibration, directions: &[Vector3<f64>]) -> Option<DMatrix<f64>> {
    let count = calibration.terms.count();
    let mut normal = DMatrix::zeros(count, count);
    for (nth, direction) in directions.iter().enumerate() {
        // Without a temperature that changes, its drift would be open in every set of poses.
        let warmer_k = if calibration.terms.temperature { (nth % 2) as f64 } else { 0.0 };
        let rows = weighted(calibration, direction, warmer_k);
        normal += rows.transpose() * rows;
    }
    inverse(&normal, calibration.terms).ok()
}

fn weighted(calibration: &Calibration, gravity_m_per_s2: &Vector3<f64>, warmer_k: f64) -> DMatrix<f64> {
    let mut rows = calibration.parameters.jacobian(gravity_m_per_s2, warmer_k, calibration.terms);
    for (axis, mut row) in rows.row_iter_mut().enumerate() {
        row /= calibration.noise.of(axis);
    }
    rows
}

/// One more pose: `P ← P - P Jᵀ (1 + J P Jᵀ)⁻¹ J P`, with rows over their noise.
fn with_pose(calibration: &Calibration, covariance: &DMatrix<f64>, gravity: &Vector3<f64>) -> DMatrix<f64> {
    let rows = weighted(calibration, gravity, 0.0);
    let cross = covariance * rows.transpose();
    let inside = DMatrix::identity(6, 6) + &rows * &cross;
    match inside.cholesky() {
        Some(factor) => covariance - &cross * factor.solve(&cross.transpose()),
        // Only a covariance that is none gets here; it then stays as it is.
        None => covariance.clone(),
    }
}

/// The direction in which the predicted force is least known, and its standard deviation there.
fn largest(calibration: &Calibration, covariance: &DMatrix<f64>, directions: &[Vector3<f64>]) -> (Vector3<f64>, f64) {
    let deviation = |gravity: &Vector3<f64>| {
        let rows = calibration.parameters.jacobian(gravity, 0.0, calibration.terms);
        let force = rows.rows(0, 3);
        principal(&Matrix3::from_iterator((force * covariance * force.transpose()).iter().copied())).1
    };
    let mut worst = (Vector3::zeros(), 0.0);
    for gravity in directions {
        let size = deviation(gravity);
        if size > worst.1 {
            worst = (*gravity, size);
        }
    }
    worst
}

fn block(covariance: &DMatrix<f64>, at: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| covariance[(at + row, at + column)])
}

/// Direction and standard deviation of the least known combination; the largest part of the direction is positive.
fn principal(covariance: &Matrix3<f64>) -> (Vector3<f64>, f64) {
    let eigen = covariance.symmetric_eigen();
    let most = eigen.eigenvalues.imax();
    let direction: Vector3<f64> = eigen.eigenvectors.column(most).into();
    let sign = direction[direction.icamax()].signum();
    (direction * sign, libm::sqrt(eigen.eigenvalues[most].max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_closer_than_a_degree_are_one() {
        let at = |angle: f64| Vector3::new(libm::sin(angle), 0.0, -9.0 * libm::cos(angle));
        let near = [at(0.0), at(0.02), at(0.021), at(1.0), at(0.0)];
        assert_eq!(distinct(near.iter(), DISTINCT_RAD).len(), 2, "0.02 of 9 is below a degree");
        assert_eq!(even(GRID).len(), GRID);
        let mean = even(GRID).iter().sum::<Vector3<f64>>() / GRID as f64;
        assert!(mean.norm() < 0.01, "{mean}");
    }
}
