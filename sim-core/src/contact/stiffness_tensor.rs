//! A stiffness in all six axes, about one point: `wrench = -K (x, θ)` for a small shift x and a small turn θ.
//!
//! | block | meaning | unit |
//! |---|---|---|
//! | K_xx | force for a shift | N/m |
//! | K_xθ | force for a turn, torque for a shift | N |
//! | K_θθ | torque for a turn | N m |
//!
//! A preloaded device may be softer than nothing in some direction: it then runs away from its rest. That is reported with its
//! direction and its value, see [`StiffnessTensor::negative`]; whether there is one does not depend on the length by which turns are
//! compared with shifts, the value does.

use crate::refusal::{self, Refusal};
use core::fmt;
use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

/// Stiffness of three shifts and three turns; symmetric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StiffnessTensor(pub Matrix6<f64>);

/// A direction in which nothing but stiffness answers: wrench and displacement are parallel, turns measured as `length θ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Shift, of a displacement of size one.
    pub shift: Vector3<f64>,
    /// Turn times the length, of a displacement of size one.
    pub turn: Vector3<f64>,
}

impl fmt::Display for Principal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (x, t) = (&self.shift, &self.turn);
        write!(f, "{:.1} N/m along ({:.3}, {:.3}, {:.3})", self.stiffness_n_per_m, x.x, x.y, x.z)?;
        write!(f, " with turn ({:.3}, {:.3}, {:.3})", t.x, t.y, t.z)
    }
}

impl StiffnessTensor {
    /// The energy of a small displacement per square of its size, times two: the stiffness along it.
    pub fn along(&self, displacement: &Vector6<f64>) -> f64 {
        displacement.dot(&(self.0 * displacement)) / displacement.norm_squared()
    }

    /// How much a wrench displaces; none if some direction carries nothing.
    pub fn compliance(&self) -> Option<Matrix6<f64>> {
        self.0.try_inverse()
    }

    /// The same stiffness about a point `to_m` from the present one. Exact if no force holds the device at rest.
    pub fn about(&self, to_m: &Vector3<f64>) -> StiffnessTensor {
        let mut lever = Matrix6::identity();
        lever.fixed_view_mut::<3, 3>(0, 3).copy_from(&to_m.cross_matrix());
        StiffnessTensor(lever.transpose() * self.0 * lever)
    }

    /// The same stiffness in other axes: `turn` turns the present ones into those, as it turns the device with it.
    pub fn turned(&self, turn: &UnitQuaternion<f64>) -> StiffnessTensor {
        let rotation = turn.to_rotation_matrix();
        let mut both = Matrix6::zeros();
        both.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation.matrix());
        both.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation.matrix());
        StiffnessTensor(both * self.0 * both.transpose())
    }

    /// The six principal directions, softest first. A turn counts as the shift of a point `length_m` away.
    pub fn principal(&self, length_m: f64) -> Result<[Principal; 6], Refusal> {
        let length_m = refusal::positive("length_m", length_m, "m")?;
        let per_length = 1.0 / length_m;
        let scale = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, per_length, per_length, per_length));
        let eigen = (scale * self.0 * scale).symmetric_eigen();
        let mut all = [0, 1, 2, 3, 4, 5].map(|i| Principal {
            stiffness_n_per_m: eigen.eigenvalues[i],
            shift: eigen.eigenvectors.fixed_view::<3, 1>(0, i).into_owned(),
            turn: eigen.eigenvectors.fixed_view::<3, 1>(3, i).into_owned(),
        });
        all.sort_unstable_by(|a, b| a.stiffness_n_per_m.total_cmp(&b.stiffness_n_per_m));
        Ok(all)
    }

    /// The directions in which the device pushes away from its rest, softest first; empty if there is none.
    pub fn negative(&self, length_m: f64) -> Result<impl Iterator<Item = Principal>, Refusal> {
        Ok(self.principal(length_m)?.into_iter().filter(|direction| direction.stiffness_n_per_m < 0.0))
    }
}
