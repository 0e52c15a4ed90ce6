//! A touch from its contact point: rate, slip and arm all follow from the same point, so that none can disagree with another.

use crate::space::{Motion, Touch};
use nalgebra::Vector3;

/// Closer to the axis than this counts as on it: far below a tracking error, far above rounding.
const ON_AXIS_M: f64 = 1e-12;

/// The touch at the point `arm_m` away from the probe tip, where the unit normal on the probe is `normal`.
#[inline]
pub(super) fn touch(achieved: &Motion, arm_m: Vector3<f64>, normal: Vector3<f64>, depth_m: f64) -> Touch {
    let velocity = achieved.velocity_m_per_s + achieved.rate_rad_per_s.cross(&arm_m);
    let rate_m_per_s = -normal.dot(&velocity);
    Touch {
        depth_m,
        rate_m_per_s,
        normal,
        point_m: achieved.position_m + arm_m,
        arm_m,
        slip_m_per_s: velocity + normal * rate_m_per_s,
    }
}

/// Distance of a point from the z axis, and the unit vector from the axis to it.
///
/// On the axis every direction is nearest. The one that the point moves towards is taken, so that the rate stays the derivative
/// of the depth; at rest it is x.
#[inline]
pub(super) fn from_axis(position_m: Vector3<f64>, velocity_m_per_s: Vector3<f64>) -> (f64, Vector3<f64>) {
    let radius_m = across(position_m);
    if radius_m > ON_AXIS_M {
        return (radius_m, Vector3::new(position_m.x / radius_m, position_m.y / radius_m, 0.0));
    }
    let speed_m_per_s = across(velocity_m_per_s);
    if speed_m_per_s > 0.0 {
        return (radius_m, Vector3::new(velocity_m_per_s.x / speed_m_per_s, velocity_m_per_s.y / speed_m_per_s, 0.0));
    }
    (radius_m, Vector3::x())
}

#[inline]
fn across(vector: Vector3<f64>) -> f64 {
    libm::sqrt(vector.x * vector.x + vector.y * vector.y)
}
