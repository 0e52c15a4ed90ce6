//! A docking cell with six axes, pressed together: the linear loop at the probe tip.
//!
//! `x'' + A (K₁ x + B₁ x')(t - τ₁) + A (K₂ x + B₂ x')(t - τ₂) = 0`, x the six displacements of the probe tip against the nozzle, in
//! nozzle axes. A is what a wrench at the tip accelerates, both satellites together: for each body, with r from its centre of
//! mass to the tip, `v' = f/m + (J⁻¹ (r × f + τ)) × r`, `ω' = J⁻¹ (r × f + τ)`. The device acts along the normal of the
//! contact: `K₁ = k n nᵀ`; the software along and about the axes of the nozzle: K₂, B₂ diagonal.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A | inverse mass at the probe tip | 1/kg, 1/(kg m), 1/(kg m²) |
//! | k, b, n | stiffness and damping of the device, normal of the contact | N/m, N s/m, 1 |
//! | τ₁, τ₂ | delay of the felt and of the virtual wrench | s |
//!
//! Not modelled: friction, contact that opens or slides, turning of the lever arms, sampling beyond its mean delay. Source:
//! `reference/PHYSICS.md`, sections 3.1 and 3.2.

use super::spectral::{DelayedForce, DelayedSystem};
use crate::refusal::{Refusal, not_negative, positive};
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};

/// A satellite as its interface feels it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carrier {
    /// Mass.
    pub mass_kg: f64,
    /// Inertia about the centre of mass, in nozzle axes.
    pub inertia_kg_m2: Matrix3<f64>,
    /// From the centre of mass to the interface, in nozzle axes.
    pub lever_m: Vector3<f64>,
}

impl Carrier {
    /// What a wrench at the interface accelerates: force and torque in, linear and angular acceleration of the interface out.
    pub fn mobility_per_kg(&self) -> Result<Matrix6<f64>, Refusal> {
        let mass = positive("mass_kg", self.mass_kg, "kg")?;
        let limit = "has no inverse";
        let refusal = Refusal { name: "inertia_kg_m2", value: self.inertia_kg_m2.determinant(), unit: "", limit };
        let turned = self.inertia_kg_m2.try_inverse().ok_or(refusal)?;
        let lever = self.lever_m.cross_matrix();
        let mut mobility = Matrix6::zeros();
        mobility.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() / mass - lever * turned * lever));
        mobility.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-lever * turned));
        mobility.fixed_view_mut::<3, 3>(3, 0).copy_from(&(turned * lever));
        mobility.fixed_view_mut::<3, 3>(3, 3).copy_from(&turned);
        Ok(mobility)
    }
}

/// The cell, pressed together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpaceLoop {
    /// Inverse mass at the probe tip: the sum over both satellites.
    pub mobility_per_kg: Matrix6<f64>,
    /// Normal of the contact, in nozzle axes.
    pub normal: Vector3<f64>,
    /// Stiffness of the device along the normal.
    pub stiffness_n_per_m: f64,
    /// Damping of the device along the normal.
    pub damping_n_s_per_m: f64,
    /// Delay of the felt wrench.
    pub felt_delay_s: f64,
    /// Virtual stiffness along x, y, z and about them.
    pub virtual_stiffness: [f64; 6],
    /// Virtual damping along x, y, z and about them.
    pub virtual_damping: [f64; 6],
    /// Delay of the virtual wrench.
    pub virtual_delay_s: f64,
}

impl SpaceLoop {
    /// The linear system; its roots tell.
    pub fn system(&self) -> Result<DelayedSystem, Refusal> {
        not_negative("felt_delay_s", self.felt_delay_s, "s")?;
        not_negative("virtual_delay_s", self.virtual_delay_s, "s")?;
        let dynamic = |matrix: Matrix6<f64>| DMatrix::from_column_slice(6, 6, matrix.as_slice());
        let mut along = Matrix6::zeros();
        along.fixed_view_mut::<3, 3>(0, 0).copy_from(&(self.normal * self.normal.transpose()));
        let diagonal = |values: &[f64; 6]| Matrix6::from_diagonal(&(*values).into());
        let device = DelayedForce::spring_dashpot(
            self.felt_delay_s,
            dynamic(along * self.stiffness_n_per_m),
            dynamic(along * self.damping_n_s_per_m),
        );
        let software = DelayedForce::spring_dashpot(
            self.virtual_delay_s,
            dynamic(diagonal(&self.virtual_stiffness)),
            dynamic(diagonal(&self.virtual_damping)),
        );
        DelayedSystem::with_mobility(&dynamic(self.mobility_per_kg), &[device, software])
    }

    /// Reduced mass along the normal, lever arms included.
    pub fn reduced_mass_kg(&self) -> f64 {
        let block = self.mobility_per_kg.fixed_view::<3, 3>(0, 0);
        1.0 / (self.normal.transpose() * block * self.normal)[(0, 0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::exact::critical_delay;

    fn plates(lever_m: f64) -> SpaceLoop {
        let body = Carrier {
            mass_kg: 50.0,
            inertia_kg_m2: Matrix3::identity() * 2.0,
            lever_m: Vector3::new(lever_m, 0.0, 0.0),
        };
        SpaceLoop {
            mobility_per_kg: body.mobility_per_kg().unwrap() * 2.0,
            normal: -Vector3::z(),
            stiffness_n_per_m: 3000.0,
            damping_n_s_per_m: 50.0,
            felt_delay_s: 0.016,
            virtual_stiffness: [0.0; 6],
            virtual_damping: [0.0; 6],
            virtual_delay_s: 0.032,
        }
    }

    #[test]
    fn lever_arms_lighten_the_contact_as_in_the_plane() {
        // reference/PHYSICS.md, section 3.1: 50 kg, 2 kg m², 0.155 m give 15.6 kg, three digits.
        assert!((plates(0.155).reduced_mass_kg() - 15.6).abs() < 0.05, "{}", plates(0.155).reduced_mass_kg());
        assert!((plates(0.0).reduced_mass_kg() - 25.0).abs() < 1e-12);
    }

    #[test]
    fn along_the_normal_it_is_the_loop_of_one_delay() {
        let at = plates(0.155);
        let edge = critical_delay(at.reduced_mass_kg(), 3000.0, 50.0).unwrap();
        for (share, stable) in [(0.999, true), (1.001, false)] {
            let system = SpaceLoop { felt_delay_s: share * edge.delay_s, ..at }.system().unwrap();
            let roots = system.rightmost(1).unwrap();
            assert_eq!(roots.stable(), stable, "{share}: {roots:?}");
            assert!((roots.roots[0].frequency_rad_per_s / edge.frequency_rad_per_s - 1.0).abs() < 0.01);
        }
    }

    /// A device preloaded too far pushes apart: `m s² + b s + k = 0` has a positive root, which a delay hardly moves.
    #[test]
    fn a_negative_stiffness_grows_at_every_delay() {
        for felt_delay_s in [0.0, 1e-4, 0.002, 0.016, 0.1] {
            let at = SpaceLoop { stiffness_n_per_m: -500.0, damping_n_s_per_m: 70.0, felt_delay_s, ..plates(0.155) };
            let found = at.system().unwrap().rightmost(1).unwrap();
            assert!(!found.stable() && found.roots[0].growth_per_s > 3.0, "{felt_delay_s}: {found:?}");
        }
    }

    #[test]
    fn virtual_damping_about_the_axis_damps_only_that() {
        let software = SpaceLoop { virtual_damping: [0.0, 0.0, 0.0, 0.0, 0.0, 2.0], ..plates(0.0) };
        let roots = software.system().unwrap().rightmost(4).unwrap();
        // A free body that is damped: x'' + A b x'(t - τ) = 0 decays at A b e^{A b τ} ≈ 2 /s (1 + 2 × 0.032), to second order.
        let rate = 2.0 * (1.0 + 2.0 * 0.032 + 1.5 * 0.064 * 0.064);
        assert!(
            roots.roots.iter().any(|root| (root.growth_per_s + rate).abs() < 0.01 && root.frequency_rad_per_s < 1e-9),
            "{roots:?}"
        );
    }
}
