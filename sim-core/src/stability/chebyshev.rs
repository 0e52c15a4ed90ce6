//! Functions on [-1, 1] by their values at Chebyshev nodes: derivatives there, and values between, in barycentric form.

use core::f64::consts::PI;
use nalgebra::{DMatrix, RowDVector};

/// Chebyshev node i of `nodes`, from 1 down to -1.
fn node(i: usize, nodes: usize) -> f64 {
    libm::cos(PI * i as f64 / nodes as f64)
}

/// Barycentric weight of node i.
fn weight(i: usize, nodes: usize) -> f64 {
    let sign = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    if i == 0 || i == nodes { 0.5 * sign } else { sign }
}

/// Values at the nodes to derivatives at the nodes, on [-1, 1]. Rows sum to zero, so that a constant has slope zero exactly.
pub(super) fn differentiation(nodes: usize) -> DMatrix<f64> {
    let mut slopes = DMatrix::from_fn(nodes + 1, nodes + 1, |i, j| {
        if i == j { 0.0 } else { weight(j, nodes) / weight(i, nodes) / (node(i, nodes) - node(j, nodes)) }
    });
    for i in 0..=nodes {
        slopes[(i, i)] = -slopes.row(i).sum();
    }
    slopes
}

/// Values at the nodes to the value at `place` in [-1, 1].
pub(super) fn interpolation(nodes: usize, place: f64) -> RowDVector<f64> {
    let distance = |i: usize| place - node(i, nodes);
    if let Some(exact) = (0..=nodes).find(|&i| distance(i).abs() < 1e-14) {
        return RowDVector::from_fn(nodes + 1, |_, j| if j == exact { 1.0 } else { 0.0 });
    }
    let all = RowDVector::from_fn(nodes + 1, |_, j| weight(j, nodes) / distance(j));
    let sum = all.sum();
    all / sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_function_is_differentiated_and_interpolated() {
        let nodes = 20;
        let values = nalgebra::DVector::from_fn(nodes + 1, |i, _| libm::exp(2.0 * node(i, nodes)));
        let slopes = differentiation(nodes) * &values;
        for i in 0..=nodes {
            // The series of e^(2x) is below 1e-16 at 20 terms; differences of nodes cost some nodes² roundings of e².
            assert!((slopes[i] - 2.0 * values[i]).abs() < 400.0 * 7.4 * f64::EPSILON);
        }
        for place in [-1.0, -0.3, 0.0, 0.77, 1.0] {
            let found = (interpolation(nodes, place) * &values)[0];
            assert!((found - libm::exp(2.0 * place)).abs() < 1e-13, "{place}");
        }
    }
}
