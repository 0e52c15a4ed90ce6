//! Three translations and three rotations.

use super::{Load, Path, Space};
use core::ops::{Add, Mul, Sub};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Motion of the probe tip relative to the nozzle, expressed in the nozzle frame. Positive z closes the gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Probe tip from the nozzle's origin.
    pub position_m: Vector3<f64>,
    /// Turns probe axes into nozzle axes.
    pub attitude: UnitQuaternion<f64>,
    /// Rate of the position.
    pub velocity_m_per_s: Vector3<f64>,
    /// Rate of turn, in nozzle axes.
    pub rate_rad_per_s: Vector3<f64>,
    /// Rate of the velocity.
    pub acceleration_m_per_s2: Vector3<f64>,
}

impl Default for Motion {
    fn default() -> Self {
        Motion {
            position_m: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            velocity_m_per_s: Vector3::zeros(),
            rate_rad_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
        }
    }
}

/// A straight line in space: position along a chord, attitude turning about one axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionLine {
    from_m: Vector3<f64>,
    change_m: Vector3<f64>,
    velocity_m_per_s: Vector3<f64>,
    from: UnitQuaternion<f64>,
    turn_rad: Vector3<f64>,
    rate_rad_per_s: Vector3<f64>,
}

/// Up to this turn, in rad, the series below are exact to rounding: their first term left out is below 2⁻⁵³.
const SMALL_RAD: f64 = 0.07;

/// The attitude turned by `turn_rad` (axis times angle, in nozzle axes).
#[inline(always)]
pub fn turned(attitude: &UnitQuaternion<f64>, turn_rad: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half2 = 0.25 * turn_rad.norm_squared();
    let (cos, sin_per_angle) = if half2 < 0.25 * SMALL_RAD * SMALL_RAD {
        let cos = 1.0 - half2 * (0.5 - half2 * (1.0 / 24.0 - half2 * (1.0 / 720.0)));
        (cos, 0.5 - half2 * (1.0 / 12.0 - half2 * (1.0 / 240.0 - half2 * (1.0 / 10_080.0))))
    } else {
        let half = libm::sqrt(half2);
        (libm::cos(half), 0.5 * libm::sin(half) / half)
    };
    let turn = Quaternion::from_parts(cos, turn_rad * sin_per_angle);
    UnitQuaternion::new_unchecked(turn * attitude.as_ref())
}

/// The shortest turn (axis times angle, in rad, in nozzle axes) that brings `from` to `to`.
#[inline]
pub fn turn_between(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector3<f64> {
    let turn = to.as_ref() * from.as_ref().conjugate();
    let (cos, axis) = if turn.w < 0.0 { (-turn.w, -turn.imag()) } else { (turn.w, turn.imag()) };
    let sin2 = axis.norm_squared();
    if sin2 < 0.25 * SMALL_RAD * SMALL_RAD {
        // asin(s) / s.
        let series = 1.0 + sin2 * (1.0 / 6.0 + sin2 * (3.0 / 40.0 + sin2 * (15.0 / 336.0 + sin2 * (105.0 / 3456.0))));
        axis * (2.0 * series)
    } else {
        let sin = libm::sqrt(sin2);
        axis * (2.0 * libm::atan2(sin, cos) / sin)
    }
}

impl Path for Motion {
    type Line = MotionLine;
    type Place = Vector3<f64>;

    #[inline]
    fn line(from: &Self, to: &Self, duration_s: f64) -> MotionLine {
        let change_m = to.position_m - from.position_m;
        let turn_rad = turn_between(&from.attitude, &to.attitude);
        MotionLine {
            from_m: from.position_m,
            change_m,
            velocity_m_per_s: change_m / duration_s,
            from: from.attitude,
            turn_rad,
            rate_rad_per_s: turn_rad / duration_s,
        }
    }

    #[inline]
    fn held(at: &Self) -> MotionLine {
        MotionLine {
            from_m: at.position_m,
            change_m: Vector3::zeros(),
            velocity_m_per_s: at.velocity_m_per_s,
            from: at.attitude,
            turn_rad: Vector3::zeros(),
            rate_rad_per_s: at.rate_rad_per_s,
        }
    }

    #[inline(always)]
    fn on(line: &MotionLine, share: f64) -> Self {
        Motion {
            position_m: line.from_m + line.change_m * share,
            attitude: turned(&line.from, &(line.turn_rad * share)),
            velocity_m_per_s: line.velocity_m_per_s,
            rate_rad_per_s: line.rate_rad_per_s,
            acceleration_m_per_s2: Vector3::zeros(),
        }
    }

    #[inline]
    fn place_on(line: &MotionLine, share: f64) -> Vector3<f64> {
        line.from_m + line.change_m * share
    }

    #[inline]
    fn place(&self) -> Vector3<f64> {
        self.position_m
    }

    #[inline]
    fn coasted(&self, duration_s: f64) -> Self {
        Motion {
            position_m: self.position_m + self.velocity_m_per_s * duration_s,
            attitude: turned(&self.attitude, &(self.rate_rad_per_s * duration_s)),
            ..*self
        }
    }

    #[inline]
    fn accelerated(&self, acceleration_m_per_s2: Vector3<f64>) -> Self {
        Motion { acceleration_m_per_s2, ..*self }
    }

    #[inline]
    fn blend(a: &Self, b: &Self, share: f64) -> Self {
        let mix = |a: &Vector3<f64>, b: &Vector3<f64>| a + (b - a) * share;
        Motion {
            position_m: mix(&a.position_m, &b.position_m),
            attitude: turned(&a.attitude, &(turn_between(&a.attitude, &b.attitude) * share)),
            velocity_m_per_s: mix(&a.velocity_m_per_s, &b.velocity_m_per_s),
            rate_rad_per_s: mix(&a.rate_rad_per_s, &b.rate_rad_per_s),
            acceleration_m_per_s2: mix(&a.acceleration_m_per_s2, &b.acceleration_m_per_s2),
        }
    }
}

/// Force and torque on the chaser at the probe tip, expressed in the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force.
    pub force_n: Vector3<f64>,
    /// Torque about the probe tip.
    pub torque_n_m: Vector3<f64>,
}

impl Default for Wrench {
    #[inline]
    fn default() -> Self {
        Wrench { force_n: Vector3::zeros(), torque_n_m: Vector3::zeros() }
    }
}

impl Add for Wrench {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Wrench { force_n: self.force_n + other.force_n, torque_n_m: self.torque_n_m + other.torque_n_m }
    }
}

impl Sub for Wrench {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Wrench { force_n: self.force_n - other.force_n, torque_n_m: self.torque_n_m - other.torque_n_m }
    }
}

impl Mul<f64> for Wrench {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        Wrench { force_n: self.force_n * factor, torque_n_m: self.torque_n_m * factor }
    }
}

impl Load for Wrench {}

/// Penetration in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Depth along the normal; positive while the interfaces touch.
    pub depth_m: f64,
    /// Rate of the depth.
    pub rate_m_per_s: f64,
    /// Unit normal on the probe, in the nozzle frame.
    pub normal: Vector3<f64>,
    /// Contact point in the nozzle frame.
    pub point_m: Vector3<f64>,
    /// From the probe tip to the contact point, in the nozzle frame: the arm of the contact force.
    pub arm_m: Vector3<f64>,
    /// Velocity of the probe at the contact point across the normal, relative to the nozzle, in the nozzle frame.
    pub slip_m_per_s: Vector3<f64>,
}

impl Default for Touch {
    fn default() -> Self {
        Touch {
            depth_m: 0.0,
            rate_m_per_s: 0.0,
            normal: -Vector3::z(),
            point_m: Vector3::zeros(),
            arm_m: Vector3::zeros(),
            slip_m_per_s: Vector3::zeros(),
        }
    }
}

/// Three translations and three rotations.
#[derive(Debug, Clone, Copy)]
pub struct Spatial;

impl Space for Spatial {
    type Motion = Motion;
    type Wrench = Wrench;
    type Touch = Touch;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Below the bound a series answers, above it libm: they meet, and one undoes the other, to rounding.
    #[test]
    fn a_turn_is_exact_on_both_sides_of_the_bound() {
        let axis = Vector3::new(2.0, -3.0, 6.0) / 7.0;
        let start = turned(&UnitQuaternion::identity(), &Vector3::new(0.3, -0.2, 0.9));
        for angle in [0.0, 1e-12, 1e-4, 0.01, 0.069_999, 0.070_001, 0.5, 3.0, -0.03, -1.0] {
            let now = turned(&start, &(axis * angle));
            let (sin, cos) = (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
            let exact = Quaternion::from_parts(cos, axis * sin) * start.as_ref();
            // A product of quaternions, and the terms left out: some eight roundings of numbers below one.
            assert!((now.into_inner() - exact).norm() <= 8.0 * f64::EPSILON, "{angle}");
            let back = turn_between(&start, &now);
            // The sine of a large half angle is known to rounding, its angle to the rounding over the cosine.
            assert!((back - axis * angle).norm() <= 16.0 * f64::EPSILON / cos, "{angle}: {back}");
            let opposite = UnitQuaternion::new_unchecked(-now.into_inner());
            assert!((turn_between(&start, &opposite) - back).norm() <= 8.0 * f64::EPSILON, "the shortest turn");
        }
    }
}
