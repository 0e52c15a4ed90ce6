//! Where the iteration starts: closed forms, exact without noise.
//!
//! 1. Attitude and mass from the forces less their mean: `D` turns the mean-free directions of gravity into the mean-free
//!    forces, by the singular value decomposition of `Σ f̃ γ̃ᵀ`. Three distinct directions are enough even if they lie in one
//!    plane: less their mean they still span that plane, since no line meets a sphere three times.
//! 2. Forces, linear in m and c_f: `f = m D γ + c_f`.
//! 3. Torques, linear in r and c_τ: `τ = -[w]× r + c_τ`, with `w = m D γ`.
//!
//! Without a misalignment among the terms D is the identity. Crosstalk and temperature start at zero.

use super::measurement::{Parameters, StaticPose, Terms};
use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};

/// The start, or `None` if the poses do not determine it.
pub fn start(poses: &[StaticPose], terms: Terms) -> Option<Parameters> {
    let count = poses.len() as f64;
    let mean = |of: &dyn Fn(&StaticPose) -> Vector3<f64>| poses.iter().map(of).sum::<Vector3<f64>>() / count;
    let mean_gravity = mean(&|pose| pose.gravity_m_per_s2);
    let mean_force = mean(&|pose| pose.force_n);
    let free = |pose: &StaticPose| (pose.gravity_m_per_s2 - mean_gravity, pose.force_n - mean_force);
    let mut parameters = Parameters::nothing();
    if terms.misalignment {
        let sum = |sum: Matrix3<f64>, pose| {
            let (gravity, force) = free(pose);
            sum + force * gravity.transpose()
        };
        parameters.alignment = nearest_rotation(&poses.iter().fold(Matrix3::zeros(), sum))?;
    }
    let spread: f64 = poses.iter().map(|pose| free(pose).0.norm_squared()).sum();
    let along: f64 = poses.iter().map(|pose| free(pose).1.dot(&(parameters.alignment * free(pose).0))).sum();
    parameters.mass_kg = along / spread;
    parameters.bias_force_n = mean_force - parameters.weight_n(&mean_gravity);
    let (centre_m, bias_torque_n_m) = lever(poses, &parameters)?;
    (parameters.centre_m, parameters.bias_torque_n_m) = (centre_m, bias_torque_n_m);
    parameters.mass_kg.is_finite().then_some(parameters)
}

/// The rotation D that makes tr(Dᵀ M) largest.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let decomposed = matrix.svd(true, true);
    let (u, v_t) = (decomposed.u?, decomposed.v_t?);
    let (u1, u2): (Vector3<f64>, Vector3<f64>) = (u.column(0).into(), u.column(1).into());
    let (v1, v2) = (v_t.row(0).transpose(), v_t.row(1).transpose());
    // The third pair follows from the others: it is arbitrary where all directions lie in one plane, and never a reflection.
    let rotation = u1 * v1.transpose() + u2 * v2.transpose() + u1.cross(&u2) * v1.cross(&v2).transpose();
    let is_finite = rotation.iter().all(|value| value.is_finite());
    is_finite.then(|| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)))
}

/// Centre of mass and bias of the torque, by linear least squares.
fn lever(poses: &[StaticPose], parameters: &Parameters) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for pose in poses {
        let to_centre = -parameters.weight_n(&pose.gravity_m_per_s2).cross_matrix();
        let mut rows = nalgebra::Matrix3x6::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&to_centre);
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
        normal += rows.transpose() * rows;
        right += rows.transpose() * pose.torque_n_m;
    }
    let solution = normal.cholesky()?.solve(&right);
    Some((solution.fixed_rows::<3>(0).into(), solution.fixed_rows::<3>(3).into()))
}
