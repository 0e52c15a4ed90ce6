//! Masses, springs and dampers with delays as a linear system: `M x'' + Σ (Mⱼ x'' + Bⱼ x' + Kⱼ x)(t - τⱼ) = 0`.
//!
//! The state is positions, then velocities, of the directions in which any force acts.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | M | mass matrix: six rows for two docking satellites, one along the axis | kg, kg m² |
//! | Kⱼ, Bⱼ, Mⱼ | stiffness, damping and inertia that act with delay τⱼ | N/m, N s/m, kg |
//!
//! Source: `reference/PHYSICS.md`, section 3.1.

use super::spectral::{Delayed, DelayedSystem, shaped};
use crate::refusal::Refusal;
use alloc::vec::Vec;
use nalgebra::DMatrix;

/// Forces of a mechanical system with one delay, all resisting: `M x'' + Σ (Mⱼ x'' + Bⱼ x' + Kⱼ x)(t - τⱼ) = 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayedForce {
    /// The delay τ; zero is allowed.
    pub delay_s: f64,
    /// Stiffness K, N/m (N m/rad for angles).
    pub stiffness: DMatrix<f64>,
    /// Damping B, N s/m.
    pub damping: DMatrix<f64>,
    /// Inertia that is felt late, kg: a tool between sensor and contact.
    pub inertia: DMatrix<f64>,
}

impl DelayedForce {
    /// A spring and a damper.
    pub fn spring_dashpot(delay_s: f64, stiffness: DMatrix<f64>, damping: DMatrix<f64>) -> Self {
        let inertia = DMatrix::zeros(stiffness.nrows(), stiffness.ncols());
        DelayedForce { delay_s, stiffness, damping, inertia }
    }
}

impl DelayedSystem {
    /// A mechanical system with as many axes as `mass_kg` has rows: six for two docking satellites, one along the axis.
    ///
    /// Directions that meet no force at all (a normal contact in the plane leaves the tangential one) are taken out and counted.
    pub fn mechanical(mass_kg: &DMatrix<f64>, forces: &[DelayedForce]) -> Result<Self, Refusal> {
        shaped("mass matrix", mass_kg, mass_kg.nrows())?;
        let mass_kg = forces.iter().filter(|force| force.delay_s == 0.0).fold(mass_kg.clone(), |sum, force| {
            if force.inertia.shape() == sum.shape() { sum + &force.inertia } else { sum }
        });
        let limit = "has no inverse: a direction without mass";
        let refusal = Refusal { name: "determinant of the mass matrix", value: 0.0, unit: "", limit };
        let mobility = mass_kg.try_inverse().ok_or(refusal)?;
        DelayedSystem::assembled(&mobility, forces)
    }

    /// The same from the inverse of the mass matrix, which is what contact coordinates have: `J M⁻¹ Jᵀ`.
    pub fn with_mobility(mobility_per_kg: &DMatrix<f64>, forces: &[DelayedForce]) -> Result<Self, Refusal> {
        if forces.iter().any(|force| force.delay_s == 0.0 && force.inertia.iter().any(|&value| value != 0.0)) {
            return Err(Refusal {
                name: "delay_s",
                value: 0.0,
                unit: "s",
                limit: "of an inertia: it belongs to the mass",
            });
        }
        DelayedSystem::assembled(mobility_per_kg, forces)
    }

    /// Inertia that acts at once is in the mobility already.
    fn assembled(mobility_per_kg: &DMatrix<f64>, forces: &[DelayedForce]) -> Result<Self, Refusal> {
        let axes = mobility_per_kg.nrows();
        shaped("inverse mass matrix", mobility_per_kg, axes)?;
        for force in forces {
            for matrix in [&force.stiffness, &force.damping, &force.inertia] {
                shaped("force matrix", matrix, axes)?;
            }
        }
        let felt = felt_directions(axes, forces);
        let n = felt.nrows();
        let reduced = |matrix: &DMatrix<f64>| &felt * mobility_per_kg * matrix * felt.transpose();
        let mut now = DMatrix::zeros(2 * n, 2 * n);
        now.view_mut((0, n), (n, n)).fill_with_identity();
        let delayed = forces.iter().map(|force| {
            let mut on_state = DMatrix::zeros(2 * n, 2 * n);
            on_state.view_mut((n, 0), (n, n)).copy_from(&-reduced(&force.stiffness));
            on_state.view_mut((n, n), (n, n)).copy_from(&-reduced(&force.damping));
            let mut on_rate = DMatrix::zeros(2 * n, 2 * n);
            if force.delay_s > 0.0 {
                on_rate.view_mut((n, n), (n, n)).copy_from(&-reduced(&force.inertia));
            }
            Delayed { delay_s: force.delay_s, on_state, on_rate }
        });
        let mut system = DelayedSystem::new(now, delayed.collect())?;
        system.rigid_modes = axes - n;
        Ok(system)
    }
}

/// An orthonormal basis, row by row, of the directions whose displacement any force answers.
fn felt_directions(axes: usize, forces: &[DelayedForce]) -> DMatrix<f64> {
    let mut gram = DMatrix::zeros(axes, axes);
    for matrix in forces.iter().flat_map(|force| [&force.stiffness, &force.damping, &force.inertia]) {
        let size = matrix.norm();
        if size > 0.0 {
            // Each counts by its shape, not by its unit.
            gram += matrix.transpose() * matrix / (size * size);
        }
    }
    let parts = gram.symmetric_eigen();
    let largest = parts.eigenvalues.iter().copied().fold(0.0, f64::max);
    // Squares: a direction counts as free where it is felt by less than 1e-7 of the strongest.
    let rows: Vec<_> = (0..axes)
        .filter(|&i| parts.eigenvalues[i] > 1e-14 * largest)
        .map(|i| parts.eigenvectors.column(i).transpose())
        .collect();
    if rows.is_empty() { DMatrix::zeros(0, axes) } else { DMatrix::from_rows(&rows) }
}
