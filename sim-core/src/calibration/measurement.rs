//! The reading of one pose at rest, as a function of the parameters, and its derivatives.
//!
//! A step of the misalignment turns the weight on: `D ← exp([δ]×) D`, so that `∂w/∂δ = -[w]×` holds at any misalignment.

use crate::refusal::{Refusal, finite};
use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SVector, UnitQuaternion, Vector3, Vector6};

/// Symmetric crosstalk between forces, without trace: S = [[s0, s2, s3], [s2, s1, s4], [s3, s4, -s0-s1]].
const SHEAR: usize = 5;
/// Symmetric crosstalk from force to torque: Q = [[q0, q3, q4], [q3, q1, q5], [q4, q5, q2]].
const LEVER: usize = 6;
/// c_f, c_τ, m, r.
const ALWAYS: usize = 10;

/// One pose at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaticPose {
    /// Gravity in the nominal axes of the sensor, from the attitude of the robot.
    pub gravity_m_per_s2: Vector3<f64>,
    /// Mean reading: force on the tool, in the sensor's own axes.
    pub force_n: Vector3<f64>,
    /// Mean reading: torque on the tool about the sensor's origin, in the sensor's own axes.
    pub torque_n_m: Vector3<f64>,
    /// Temperature less the reference; 0 where nobody measured it.
    pub warmer_k: f64,
}

impl StaticPose {
    /// Refuses what is not a number, and a place without gravity.
    pub fn check(&self) -> Result<(), Refusal> {
        self.gravity_m_per_s2.iter().try_for_each(|&value| finite("gravity_m_per_s2", value, "m/s²").map(drop))?;
        self.force_n.iter().try_for_each(|&value| finite("force_n", value, "N").map(drop))?;
        self.torque_n_m.iter().try_for_each(|&value| finite("torque_n_m", value, "N m").map(drop))?;
        finite("warmer_k", self.warmer_k, "K")?;
        crate::refusal::positive("gravity_m_per_s2", self.gravity_m_per_s2.norm(), "m/s²").map(drop)
    }
}

/// What is estimated besides bias, mass and centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Terms {
    /// The misalignment of the sensor.
    pub misalignment: bool,
    /// The part of the crosstalk that a weight can show.
    pub crosstalk: bool,
    /// The drift of the bias with temperature.
    pub temperature: bool,
}

impl Terms {
    /// Bias, mass, centre of mass and misalignment: thirteen numbers.
    pub const USUAL: Self = Terms { misalignment: true, crosstalk: false, temperature: false };

    /// How many numbers are estimated.
    pub fn count(self) -> usize {
        let optional = [(self.misalignment, 3), (self.crosstalk, SHEAR + LEVER), (self.temperature, 6)];
        ALWAYS + optional.iter().filter(|(is_on, _)| *is_on).map(|(_, count)| count).sum::<usize>()
    }

    /// What each number is, with its unit, in the order of the estimate.
    pub fn names(self) -> Vec<(&'static str, &'static str)> {
        let mut names: Vec<_> = ["bias of the force", "bias of the torque"]
            .into_iter()
            .zip(["N", "N m"])
            .flat_map(|name| [name; 3])
            .collect();
        names.push(("mass", "kg"));
        names.extend([("centre of mass", "m"); 3]);
        if self.misalignment {
            names.extend([("misalignment", "rad"); 3]);
        }
        if self.crosstalk {
            names.extend([("crosstalk between forces", "1"); SHEAR]);
            names.extend([("crosstalk from force to torque", "m"); LEVER]);
        }
        if self.temperature {
            names.extend([("drift of the force with temperature", "N/K"); 3]);
            names.extend([("drift of the torque with temperature", "N m/K"); 3]);
        }
        names
    }
}

/// What a calibration knows of a sensor and its tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Reading without load, in the sensor's own axes.
    pub bias_force_n: Vector3<f64>,
    /// Reading without load, about the sensor's origin.
    pub bias_torque_n_m: Vector3<f64>,
    /// Mass of everything beyond the sensor.
    pub mass_kg: f64,
    /// Its centre of mass from the sensor's origin, in the sensor's own axes.
    pub centre_m: Vector3<f64>,
    /// Turns the nominal axes into the sensor's own: `v_S = D v_S0`. A quaternion, since the angle of a matrix near 1 is lost.
    pub alignment: UnitQuaternion<f64>,
    /// S: what a force reads too much, per force, in the other axes.
    pub shear: Matrix3<f64>,
    /// Q: what a force reads as a torque beyond its lever arm.
    pub lever_m: Matrix3<f64>,
    /// Drift of the force's bias.
    pub drift_force_n_per_k: Vector3<f64>,
    /// Drift of the torque's bias.
    pub drift_torque_n_m_per_k: Vector3<f64>,
}

impl Parameters {
    /// A perfect sensor that carries nothing.
    pub fn nothing() -> Self {
        Parameters {
            bias_force_n: Vector3::zeros(),
            bias_torque_n_m: Vector3::zeros(),
            mass_kg: 0.0,
            centre_m: Vector3::zeros(),
            alignment: UnitQuaternion::identity(),
            shear: Matrix3::zeros(),
            lever_m: Matrix3::zeros(),
            drift_force_n_per_k: Vector3::zeros(),
            drift_torque_n_m_per_k: Vector3::zeros(),
        }
    }

    /// Weight of the tool in the sensor's own axes.
    pub fn weight_n(&self, gravity_m_per_s2: &Vector3<f64>) -> Vector3<f64> {
        self.alignment * gravity_m_per_s2 * self.mass_kg
    }

    /// The reading that these parameters predict: force, then torque.
    pub fn reading(&self, gravity_m_per_s2: &Vector3<f64>, warmer_k: f64) -> Vector6<f64> {
        let weight_n = self.weight_n(gravity_m_per_s2);
        let force_n = weight_n + self.shear * weight_n + self.bias_force_n + self.drift_force_n_per_k * warmer_k;
        let torque_n_m = self.centre_m.cross(&weight_n)
            + self.lever_m * weight_n
            + self.bias_torque_n_m
            + self.drift_torque_n_m_per_k * warmer_k;
        stacked(&force_n, &torque_n_m)
    }

    /// What is left of a reading when bias and weight are taken out: force, then torque. This is what a compensator does.
    pub fn contact(&self, pose: &StaticPose) -> Vector6<f64> {
        stacked(&pose.force_n, &pose.torque_n_m) - self.reading(&pose.gravity_m_per_s2, pose.warmer_k)
    }

    /// Misalignment as a rotation vector.
    pub fn misalignment_rad(&self) -> Vector3<f64> {
        self.alignment.scaled_axis()
    }

    /// What a load reads too much, six by six: reading = (1 + E) load. The columns of torques are zero: a weight does not
    /// show them.
    pub fn crosstalk(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.shear);
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.lever_m);
        matrix
    }

    /// Derivatives of the reading by the estimated numbers: six rows, one column for each of [`Terms::names`].
    pub fn jacobian(&self, gravity_m_per_s2: &Vector3<f64>, warmer_k: f64, terms: Terms) -> DMatrix<f64> {
        let down = self.alignment * gravity_m_per_s2;
        let weight = down * self.mass_kg;
        let (to_force, to_torque) = (Matrix3::identity() + self.shear, self.centre_m.cross_matrix() + self.lever_m);
        let mut rows = DMatrix::zeros(6, terms.count());
        for axis in 0..6 {
            rows[(axis, axis)] = 1.0;
        }
        rows.fixed_view_mut::<3, 1>(0, 6).copy_from(&(to_force * down));
        rows.fixed_view_mut::<3, 1>(3, 6).copy_from(&(to_torque * down));
        rows.fixed_view_mut::<3, 3>(3, 7).copy_from(&-weight.cross_matrix());
        let mut next = ALWAYS;
        if terms.misalignment {
            rows.fixed_view_mut::<3, 3>(0, next).copy_from(&(-to_force * weight.cross_matrix()));
            rows.fixed_view_mut::<3, 3>(3, next).copy_from(&(-to_torque * weight.cross_matrix()));
            next += 3;
        }
        if terms.crosstalk {
            for nth in 0..SHEAR {
                rows.fixed_view_mut::<3, 1>(0, next + nth).copy_from(&(shear_of(nth) * weight));
            }
            for nth in 0..LEVER {
                rows.fixed_view_mut::<3, 1>(3, next + SHEAR + nth).copy_from(&(lever_of(nth) * weight));
            }
            next += SHEAR + LEVER;
        }
        if terms.temperature {
            for axis in 0..6 {
                rows[(axis, next + axis)] = warmer_k;
            }
        }
        rows
    }

    /// One step of the estimate further.
    pub fn moved(&self, step: &DVector<f64>, terms: Terms) -> Self {
        let three = |at: usize| Vector3::new(step[at], step[at + 1], step[at + 2]);
        let mut new = *self;
        new.bias_force_n += three(0);
        new.bias_torque_n_m += three(3);
        new.mass_kg += step[6];
        new.centre_m += three(7);
        let mut next = ALWAYS;
        if terms.misalignment {
            new.alignment = UnitQuaternion::from_scaled_axis(three(next)) * self.alignment;
            next += 3;
        }
        if terms.crosstalk {
            new.shear = (0..SHEAR).fold(new.shear, |sum, nth| sum + shear_of(nth) * step[next + nth]);
            new.lever_m = (0..LEVER).fold(new.lever_m, |sum, nth| sum + lever_of(nth) * step[next + SHEAR + nth]);
            next += SHEAR + LEVER;
        }
        if terms.temperature {
            new.drift_force_n_per_k += three(next);
            new.drift_torque_n_m_per_k += three(next + 3);
        }
        new
    }
}

/// A reading with a known crosstalk taken out: the load of which `reading = (1 + crosstalk) load`. `None` if the matrix cannot
/// be inverted.
pub fn decoupled(crosstalk: &Matrix6<f64>, reading: &Vector6<f64>) -> Option<Vector6<f64>> {
    (Matrix6::identity() + crosstalk).lu().solve(reading)
}

fn stacked(force_n: &Vector3<f64>, torque_n_m: &Vector3<f64>) -> Vector6<f64> {
    SVector::from_fn(|row, _| if row < 3 { force_n[row] } else { torque_n_m[row - 3] })
}

/// The matrix that the `nth` number of S stands for.
fn shear_of(nth: usize) -> Matrix3<f64> {
    match nth {
        0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0),
        1 => Matrix3::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0),
        _ => symmetric_pair(nth - 2),
    }
}

/// The matrix that the `nth` number of Q stands for.
fn lever_of(nth: usize) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    if nth >= 3 {
        return symmetric_pair(nth - 3);
    }
    matrix[(nth, nth)] = 1.0;
    matrix
}

/// Ones at (0, 1), (0, 2) or (1, 2), and mirrored.
fn symmetric_pair(nth: usize) -> Matrix3<f64> {
    let (row, column) = [(0, 1), (0, 2), (1, 2)][nth];
    let mut matrix = Matrix3::zeros();
    matrix[(row, column)] = 1.0;
    matrix[(column, row)] = 1.0;
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives against central differences: their error is h² / 6 of the third derivative, the rounding ε |y| / h.
    #[test]
    fn every_derivative_is_that_of_the_reading() {
        let terms = Terms { misalignment: true, crosstalk: true, temperature: true };
        let mut truth = Parameters::nothing();
        truth.mass_kg = 12.0;
        truth.centre_m = Vector3::new(0.02, -0.03, 0.15);
        truth.alignment = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 0.1));
        truth.shear = shear_of(2) * 0.02;
        truth.lever_m = lever_of(4) * 0.003;
        let gravity = Vector3::new(3.0, -5.0, 7.8);
        let rows = truth.jacobian(&gravity, 4.0, terms);
        for column in 0..terms.count() {
            let h = 1e-5;
            let mut step = DVector::zeros(terms.count());
            step[column] = h;
            let up = truth.moved(&step, terms).reading(&gravity, 4.0);
            step[column] = -h;
            let down = truth.moved(&step, terms).reading(&gravity, 4.0);
            let difference = (up - down) / (2.0 * h);
            let gap = (rows.column(column) - difference).norm();
            assert!(gap < 1e-7, "{:?}: {gap}", terms.names()[column]);
        }
    }

    #[test]
    fn a_known_crosstalk_is_taken_out() {
        let mut crosstalk = Matrix6::zeros();
        crosstalk[(0, 2)] = 0.01;
        crosstalk[(4, 0)] = -0.02;
        let load = Vector6::new(1.0, 2.0, 3.0, 0.1, 0.2, 0.3);
        let read = (Matrix6::identity() + crosstalk) * load;
        assert!((decoupled(&crosstalk, &read).unwrap() - load).norm() < 1e-14);
        assert_eq!(decoupled(&-Matrix6::identity(), &read), None);
    }

    #[test]
    fn a_pose_without_meaning_is_refused() {
        let pose = StaticPose {
            gravity_m_per_s2: Vector3::new(0.0, 0.0, -9.8),
            force_n: Vector3::zeros(),
            torque_n_m: Vector3::zeros(),
            warmer_k: 0.0,
        };
        assert_eq!(pose.check(), Ok(()));
        let nowhere = StaticPose { gravity_m_per_s2: Vector3::zeros(), ..pose };
        assert!(nowhere.check().unwrap_err().limit.contains("not above 0"));
        let broken = StaticPose { force_n: Vector3::new(0.0, f64::NAN, 0.0), ..pose };
        assert_eq!(broken.check().unwrap_err().name, "force_n");
    }
}
