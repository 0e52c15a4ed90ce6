//! Where the interfaces touch.

use crate::space::{Axis, AxisMotion, AxisTouch, Space};

/// Turns the achieved motion into a penetration.
pub trait Geometry<S: Space>: Send + Sync {
    /// Depth, rate and place.
    fn touch(&self, achieved: &S::Motion) -> S::Touch;
}

/// The plane z = 0 across the axis: z > 0 is penetration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plane;

impl Geometry<Axis> for Plane {
    fn touch(&self, achieved: &AxisMotion) -> AxisTouch {
        AxisTouch { depth_m: achieved.position_m, rate_m_per_s: achieved.velocity_m_per_s }
    }
}
