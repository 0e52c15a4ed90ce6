//! The frames of a docking simulator, poses between them, and what moves from one to the next.
//!
//! A [`Pose<A, B>`] says where B is, seen from A: `p_A = r + D p_B`. The names are types, so a chain that does not fit does not
//! compile: `Pose<Global, Base>` then `Pose<Base, Tool>` is a `Pose<Global, Tool>`.
//!
//! | frame | origin and axes |
//! |---|---|
//! | [`Global`] | laboratory, inertial; origin 1.5 m above the floor (thesis 2.2) |
//! | [`Base`] | foot of a robot |
//! | [`Tool`] | flange of a robot, H in the thesis |
//! | [`NominalSensor`] | where the drawing puts the force sensor, S0 |
//! | [`Sensor`] | where it really is, S: turned from S0 by the small misalignment |
//! | [`Chaser`] | chaser's centre of mass, body axes, B |
//! | [`Target`] | target's centre of mass, body axes |
//! | [`Probe`] | probe tip |
//! | [`Nozzle`] | nozzle on the target, N; positive z closes the gap |
//!
//! A wrench that acts at B's origin in B's axes is, at A's origin in A's axes, `f_A = D f_B`, `τ_A = D τ_B + r × D f_B`.
//!
//! Inside the project an attitude is a unit quaternion. Euler angles live only here, at the edges, since robots speak them:
//! A about z, then B about y, then C about x, `D = Rz(A) Ry(B) Rx(C)`.
//!
//! Not modelled: the laboratory turns with the Earth; robots bend.

use crate::space::Wrench;
use core::marker::PhantomData;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

macro_rules! frames {
    ($($(#[$about:meta])* $name:ident),+) => {$(
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name;
    )+};
}

frames!(
    /// Laboratory, inertial.
    Global,
    /// Foot of a robot.
    Base,
    /// Flange of a robot.
    Tool,
    /// The force sensor as drawn.
    NominalSensor,
    /// The force sensor as it is.
    Sensor,
    /// Chaser's body axes at its centre of mass.
    Chaser,
    /// Target's body axes at its centre of mass.
    Target,
    /// Probe tip.
    Probe,
    /// Nozzle.
    Nozzle
);

/// Where frame `B` is, seen from frame `A`.
#[derive(Debug, PartialEq)]
pub struct Pose<A, B> {
    /// B's origin from A's origin, in A's axes.
    pub position_m: Vector3<f64>,
    /// Turns B's axes into A's axes.
    pub attitude: UnitQuaternion<f64>,
    frames: PhantomData<fn() -> (A, B)>,
}

impl<A, B> Clone for Pose<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A, B> Copy for Pose<A, B> {}

impl<A, B> Default for Pose<A, B> {
    fn default() -> Self {
        Pose::new(Vector3::zeros(), UnitQuaternion::identity())
    }
}

impl<A, B> Pose<A, B> {
    /// B at `position_m` of A, turned by `attitude`.
    pub fn new(position_m: Vector3<f64>, attitude: UnitQuaternion<f64>) -> Self {
        Pose { position_m, attitude, frames: PhantomData }
    }

    /// B at `position_m` of A, with parallel axes.
    pub fn at(position_m: Vector3<f64>) -> Self {
        Pose::new(position_m, UnitQuaternion::identity())
    }

    /// Where C is, seen from A, if `next` says where it is seen from B.
    pub fn then<C>(&self, next: &Pose<B, C>) -> Pose<A, C> {
        Pose::new(self.point(&next.position_m), self.attitude * next.attitude)
    }

    /// Where A is, seen from B.
    pub fn inverse(&self) -> Pose<B, A> {
        let attitude = self.attitude.inverse();
        Pose::new(-(attitude * self.position_m), attitude)
    }

    /// A point of B, seen from A.
    pub fn point(&self, point_m_in_b: &Vector3<f64>) -> Vector3<f64> {
        self.position_m + self.attitude * point_m_in_b
    }

    /// A wrench at B's origin in B's axes, taken to A's origin and A's axes.
    pub fn wrench(&self, in_b: &Wrench) -> Wrench {
        let force_n = self.attitude * in_b.force_n;
        Wrench { force_n, torque_n_m: self.attitude * in_b.torque_n_m + self.position_m.cross(&force_n) }
    }
}

/// What a robot's controller calls A, B and C: turns about z, y and x, in this order, each about the axes turned before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Euler321 {
    /// A, about z.
    pub about_z_rad: f64,
    /// B, about y.
    pub about_y_rad: f64,
    /// C, about x.
    pub about_x_rad: f64,
}

impl Euler321 {
    /// The attitude `Rz(A) Ry(B) Rx(C)`.
    pub fn attitude(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(self.about_x_rad, self.about_y_rad, self.about_z_rad)
    }

    /// The angles of an attitude: A and C within ±π, B within ±π/2. Where B is ±π/2, only A - C or A + C is known; then A is 0.
    pub fn of(attitude: &UnitQuaternion<f64>) -> Self {
        let turn: Rotation3<f64> = attitude.to_rotation_matrix();
        let d: &Matrix3<f64> = turn.matrix();
        let level = libm::hypot(d[(0, 0)], d[(1, 0)]);
        let about_y_rad = libm::atan2(-d[(2, 0)], level);
        // Below this the first column's direction is rounding.
        if level < 8.0 * f64::EPSILON {
            let about_x_rad = libm::atan2(-d[(1, 2)], d[(1, 1)]);
            return Euler321 { about_z_rad: 0.0, about_y_rad, about_x_rad };
        }
        Euler321 {
            about_z_rad: libm::atan2(d[(1, 0)], d[(0, 0)]),
            about_y_rad,
            about_x_rad: libm::atan2(d[(2, 1)], d[(2, 2)]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(z: f64, y: f64, x: f64) -> Euler321 {
        let rad = core::f64::consts::PI / 180.0;
        Euler321 { about_z_rad: z * rad, about_y_rad: y * rad, about_x_rad: x * rad }
    }

    /// The first column of A 30°, B 20°, C 10°: reference/PHYSICS.md, correction 8, to the digits given there.
    #[test]
    fn euler_angles_turn_about_z_then_y_then_x() {
        let x = degrees(30.0, 20.0, 10.0).attitude() * Vector3::x();
        assert!((x - Vector3::new(0.8138, 0.4698, -0.3420)).amax() < 5e-5, "{x}");
    }

    #[test]
    fn euler_angles_come_back() {
        for (z, y, x) in [(30.0, 20.0, 10.0), (-170.0, 80.0, 120.0), (0.0, 0.0, 0.0), (10.0, -89.9, -60.0)] {
            let angles = degrees(z, y, x);
            let back = Euler321::of(&angles.attitude());
            // Rounding of the matrix over the smaller of cos B, here 1.7e-3.
            let allowed = 8.0 * f64::EPSILON / libm::cos(angles.about_y_rad);
            assert!((back.about_z_rad - angles.about_z_rad).abs() < allowed, "{back:?}");
            assert!((back.about_x_rad - angles.about_x_rad).abs() < allowed, "{back:?}");
            assert!((back.about_y_rad - angles.about_y_rad).abs() < allowed, "{back:?}");
        }
    }

    /// Straight up, A and C turn about the same axis: the angles differ and the attitude is the same.
    #[test]
    fn euler_angles_at_the_pole_give_the_same_attitude() {
        for y in [90.0, -90.0] {
            let attitude = degrees(25.0, y, 40.0).attitude();
            let back = Euler321::of(&attitude);
            // The angle from an atan2 near its pole keeps half the digits of the matrix.
            assert!(attitude.angle_to(&back.attitude()) < 4.0 * libm::sqrt(f64::EPSILON), "{back:?}");
        }
    }

    fn lab() -> (Pose<Global, Base>, Pose<Base, Tool>) {
        let foot = Pose::new(Vector3::new(2.0, -1.0, -1.5), degrees(90.0, 0.0, 0.0).attitude());
        (foot, Pose::new(Vector3::new(1.2, 0.3, 1.4), degrees(30.0, 20.0, 10.0).attitude()))
    }

    #[test]
    fn poses_chain_and_turn_back() {
        let (foot, flange) = lab();
        let tool = foot.then(&flange);
        let point = Vector3::new(0.1, 0.2, 0.3);
        assert!((tool.point(&point) - foot.point(&flange.point(&point))).norm() < 16.0 * f64::EPSILON);
        let same = tool.then(&tool.inverse());
        assert!(same.position_m.norm() < 16.0 * f64::EPSILON);
        assert!(same.attitude.imag().norm() < 4.0 * f64::EPSILON);
        // A quarter turn about z takes x to y: by hand.
        let corner = foot.point(&Vector3::x());
        assert!((corner - Vector3::new(2.0, 0.0, -1.5)).norm() < 8.0 * f64::EPSILON);
    }

    /// The power of a wrench does not depend on the frame in which it is written: reference/PHYSICS.md, section 3.2.
    #[test]
    fn a_wrench_does_the_same_work_in_every_frame() {
        let sensor: Pose<Chaser, Sensor> = Pose::new(Vector3::new(0.2, -0.1, 0.7), degrees(15.0, -5.0, 2.0).attitude());
        let felt = Wrench { force_n: Vector3::new(1.0, -2.0, -9.0), torque_n_m: Vector3::new(0.3, 0.1, -0.2) };
        let at_centre = sensor.wrench(&felt);
        // A twist of the body, at the centre of mass and at the sensor.
        let (velocity, rate) = (Vector3::new(0.01, 0.02, 0.035), Vector3::new(-0.1, 0.2, 0.05));
        let back = sensor.attitude.inverse();
        let there = back * (velocity + rate.cross(&sensor.position_m));
        let power_w = felt.force_n.dot(&there) + felt.torque_n_m.dot(&(back * rate));
        let same_w = at_centre.force_n.dot(&velocity) + at_centre.torque_n_m.dot(&rate);
        assert!((power_w - same_w).abs() < 16.0 * f64::EPSILON, "{power_w} {same_w}");
        // By hand: 10 N down at an arm of 0.2 m along x turn about y with 2 N m.
        let arm: Pose<Chaser, Sensor> = Pose::at(Vector3::new(0.2, 0.0, 0.0));
        let down = Wrench { force_n: Vector3::new(0.0, 0.0, -10.0), torque_n_m: Vector3::zeros() };
        assert_eq!(arm.wrench(&down).torque_n_m, Vector3::new(0.0, 2.0, 0.0));
    }
}
