//! A rigid body: its mass and inertia, its state, a kick and a drift.
//!
//! The state holds the *angular momentum* in global axes and not the body rate: then a free body's momentum stays the same to
//! the last bit, however it tumbles, and a kick is one sum.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m, J | mass; inertia about the centre of mass in body axes | kg, kg m² |
//! | ρ, v | centre of mass and its velocity, global | m, m/s |
//! | R, q | body axes → global axes, as a matrix and as a quaternion | 1 |
//! | L | angular momentum about the centre of mass, global | N m s |
//! | M | the same in body axes, `Rᵀ L` | N m s |
//! | ω | body rate, `J⁻¹ M` | rad/s |
//!
//! Kick, at a fixed attitude: `v += T F/m`, `L += T (r × F + τ)`.
//!
//! Drift, free: `ρ += T v`, and for the attitude the implicit midpoint rule with Cayley's rotation
//! `μ = M + (T/2) μ × J⁻¹μ`, `q ← q ⊗ (1, T J⁻¹μ/2) / |·|`.
//! The rotation takes M to `M⁺ = 2μ - M`, so that L stays. The energy `M·J⁻¹M/2` changes by `(M⁺ - M)·J⁻¹μ`, and `M⁺ - M` is
//! across `J⁻¹μ`: it stays as well. Both hold to rounding whatever the step; the phase is of second order. It takes no sine.
//! How it is computed: `plant/lanes.rs`.
//!
//! Not modelled: flexible appendages, propellant, a mass that changes.

use super::lanes::Symmetric;
use crate::refusal::{Refusal, finite, positive};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// What the moments and products of a body may differ from symmetry, or from a flat body, by rounding: relative.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Mass and inertia; or a body that nothing moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    mass_kg: f64,
    inertia_kg_m2: Matrix3<f64>,
    inverse_inertia: Matrix3<f64>,
}

/// How a body moves, as people say it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyMotion {
    /// Centre of mass, global.
    pub position_m: Vector3<f64>,
    /// Turns body axes into global axes.
    pub attitude: UnitQuaternion<f64>,
    /// Velocity of the centre of mass, global.
    pub velocity_m_per_s: Vector3<f64>,
    /// Rate of turn, in body axes.
    pub rate_rad_per_s: Vector3<f64>,
}

impl Default for BodyMotion {
    fn default() -> Self {
        BodyMotion {
            position_m: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            velocity_m_per_s: Vector3::zeros(),
            rate_rad_per_s: Vector3::zeros(),
        }
    }
}

/// How a body moves, as it is integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyState {
    /// Centre of mass, global.
    pub position_m: Vector3<f64>,
    /// Turns body axes into global axes.
    pub attitude: UnitQuaternion<f64>,
    /// Velocity of the centre of mass, global.
    pub velocity_m_per_s: Vector3<f64>,
    /// Angular momentum about the centre of mass, global; zero of a fixed body.
    pub spin_n_m_s: Vector3<f64>,
}

/// A force and a torque at a point, all in global axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Force on the body.
    pub force_n: Vector3<f64>,
    /// Torque on the body, besides that of the force.
    pub torque_n_m: Vector3<f64>,
    /// Where the force acts.
    pub point_m: Vector3<f64>,
}

impl Push {
    /// The same the other way: the reaction at the same point.
    #[inline]
    pub fn reaction(&self) -> Push {
        Push { force_n: -self.force_n, torque_n_m: -self.torque_n_m, point_m: self.point_m }
    }

    /// Its moment about a point.
    #[inline]
    pub fn moment_n_m(&self, about_m: &Vector3<f64>) -> Vector3<f64> {
        (self.point_m - about_m).cross(&self.force_n) + self.torque_n_m
    }
}

impl Body {
    /// A free body. Refuses a mass that is not positive, and an inertia that no body has.
    pub fn new(mass_kg: f64, inertia_kg_m2: Matrix3<f64>) -> Result<Self, Refusal> {
        let mass_kg = positive("mass_kg", mass_kg, "kg")?;
        let refused = |value, limit| Refusal { name: "inertia_kg_m2", value, unit: "kg m²", limit };
        for &moment in &inertia_kg_m2 {
            finite("inertia_kg_m2", moment, "kg m²")?;
        }
        let size = inertia_kg_m2.amax();
        for (row, column) in [(1, 0), (2, 0), (2, 1)] {
            let apart = inertia_kg_m2[(row, column)] - inertia_kg_m2[(column, row)];
            if apart.abs() > ROUNDING * size {
                return Err(refused(inertia_kg_m2[(row, column)], "is not the same across the diagonal"));
            }
        }
        let inertia = (inertia_kg_m2 + inertia_kg_m2.transpose()) * 0.5;
        let principal = inertia.symmetric_eigenvalues();
        let (least, most) = (principal.min(), principal.max());
        if least <= ROUNDING * size {
            return Err(refused(least, "is a principal moment that is not above 0"));
        }
        if most > (inertia.trace() - most) + ROUNDING * size {
            return Err(refused(most, "is a principal moment above the sum of the other two"));
        }
        let inverse_inertia = inertia.try_inverse().ok_or(refused(least, "is a principal moment too small"))?;
        Ok(Body { mass_kg, inertia_kg_m2: inertia, inverse_inertia })
    }

    /// A body that nothing moves: of infinite mass.
    pub fn fixed() -> Self {
        let infinite = Matrix3::from_diagonal_element(f64::INFINITY);
        Body { mass_kg: f64::INFINITY, inertia_kg_m2: infinite, inverse_inertia: Matrix3::zeros() }
    }

    /// Whether nothing moves it.
    #[inline]
    pub fn is_fixed(&self) -> bool {
        self.mass_kg.is_infinite()
    }

    /// Mass; infinite of a fixed body.
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Inertia about the centre of mass in body axes; infinite on the diagonal of a fixed body.
    pub fn inertia_kg_m2(&self) -> &Matrix3<f64> {
        &self.inertia_kg_m2
    }

    /// The state of this motion. A fixed body keeps its pose and rests.
    pub fn state(&self, motion: &BodyMotion) -> BodyState {
        let BodyMotion { position_m, attitude, .. } = *motion;
        if self.is_fixed() {
            let (velocity_m_per_s, spin_n_m_s) = (Vector3::zeros(), Vector3::zeros());
            return BodyState { position_m, attitude, velocity_m_per_s, spin_n_m_s };
        }
        let spin_n_m_s = attitude * (self.inertia_kg_m2 * motion.rate_rad_per_s);
        BodyState { position_m, attitude, velocity_m_per_s: motion.velocity_m_per_s, spin_n_m_s }
    }

    /// The motion of this state.
    pub fn motion(&self, state: &BodyState) -> BodyMotion {
        let BodyState { position_m, attitude, velocity_m_per_s, spin_n_m_s } = *state;
        let rate_rad_per_s = self.rate(&(attitude.inverse() * spin_n_m_s));
        BodyMotion { position_m, attitude, velocity_m_per_s, rate_rad_per_s }
    }

    /// Body rate of a body with this angular momentum in body axes.
    #[inline]
    pub(crate) fn rate(&self, spin_in_body: &Vector3<f64>) -> Vector3<f64> {
        self.inverse_inertia * spin_in_body
    }

    /// Kinetic energy; zero of a fixed body.
    pub fn energy_j(&self, state: &BodyState) -> f64 {
        if self.is_fixed() {
            return 0.0;
        }
        let spin_in_body = state.attitude.inverse() * state.spin_n_m_s;
        let twice_j = self.rate(&spin_in_body).dot(&spin_in_body);
        0.5 * (self.mass_kg * state.velocity_m_per_s.norm_squared() + twice_j)
    }

    /// The same body in axes that are turned: `axes` takes the new axes to the old ones.
    pub(crate) fn in_axes(&self, axes: &UnitQuaternion<f64>) -> Body {
        if self.is_fixed() {
            return *self;
        }
        let turn = axes.to_rotation_matrix().into_inner();
        let turned = |matrix: &Matrix3<f64>| {
            let full = turn.transpose() * matrix * turn;
            (full + full.transpose()) * 0.5
        };
        Body { inertia_kg_m2: turned(&self.inertia_kg_m2), inverse_inertia: turned(&self.inverse_inertia), ..*self }
    }

    /// `J⁻¹`, as xx, yy, zz, xy, xz, yz.
    pub(crate) fn inverse_inertia(&self) -> Symmetric<f64> {
        let j = &self.inverse_inertia;
        Symmetric([j[(0, 0)], j[(1, 1)], j[(2, 2)], j[(0, 1)], j[(0, 2)], j[(1, 2)]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    fn refused(mass_kg: f64, inertia: Matrix3<f64>) -> alloc::string::String {
        Body::new(mass_kg, inertia).unwrap_err().to_string()
    }

    #[test]
    fn what_no_body_has_is_refused_with_the_reason() {
        let good = Matrix3::from_diagonal(&Vector3::new(2.0, 3.0, 4.0));
        assert_eq!(refused(0.0, good), "mass_kg = 0 kg is not above 0");
        assert_eq!(refused(f64::INFINITY, good), "mass_kg = inf kg is not a finite number");
        let thin = Matrix3::from_diagonal(&Vector3::new(2.0, 3.0, 5.5));
        assert_eq!(
            refused(1.0, thin),
            "inertia_kg_m2 = 5.5 kg m² is a principal moment above the sum of the other two"
        );
        let negative = Matrix3::from_diagonal(&Vector3::new(2.0, -3.0, 4.0));
        assert_eq!(refused(1.0, negative), "inertia_kg_m2 = -3 kg m² is a principal moment that is not above 0");
        assert!(refused(1.0, Matrix3::zeros()).contains("not above 0"));
        let mut skew = good;
        skew[(1, 0)] = 0.1;
        assert_eq!(refused(1.0, skew), "inertia_kg_m2 = 0.1 kg m² is not the same across the diagonal");
        skew[(1, 0)] = f64::NAN;
        assert_eq!(refused(1.0, skew), "inertia_kg_m2 = NaN kg m² is not a finite number");
    }

    /// The triangle holds for principal moments: products of inertia can break it where the diagonal does not show it.
    #[test]
    fn the_triangle_is_of_the_principal_moments() {
        let axes = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.8, -0.5)).to_rotation_matrix().into_inner();
        let turned = |moments: Vector3<f64>| axes * Matrix3::from_diagonal(&moments) * axes.transpose();
        assert!(refused(1.0, turned(Vector3::new(1.0, 2.0, 3.1))).contains("sum of the other two"));
        // A flat plate has equality, a rod nearly no third moment.
        assert!(Body::new(1.0, turned(Vector3::new(1.0, 2.0, 3.0))).is_ok());
        assert!(Body::new(1.0, turned(Vector3::new(1e-6, 2.0, 2.0))).is_ok());
    }

    #[test]
    fn state_and_motion_are_each_others_inverse() {
        let body = Body::new(3.0, Matrix3::new(2.0, 0.2, 0.0, 0.2, 2.5, 0.1, 0.0, 0.1, 3.0)).unwrap();
        let motion = BodyMotion {
            attitude: UnitQuaternion::from_scaled_axis(Vector3::new(1.0, -0.2, 0.7)),
            rate_rad_per_s: Vector3::new(0.3, -0.4, 0.5),
            ..BodyMotion::default()
        };
        let back = body.motion(&body.state(&motion));
        assert!((back.rate_rad_per_s - motion.rate_rad_per_s).norm() < 32.0 * f64::EPSILON);
        let energy_j = 0.5 * motion.rate_rad_per_s.dot(&(body.inertia_kg_m2() * motion.rate_rad_per_s));
        assert!((body.energy_j(&body.state(&motion)) - energy_j).abs() < 32.0 * f64::EPSILON);
    }
}
