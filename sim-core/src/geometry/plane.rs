//! The plane z = 0 of the nozzle frame, and the probe's tip as a point: `d = z`, normal on the probe -z.
//!
//! Not modelled: a tip with a radius, an edge of the plane.

use super::{Geometry, place};
use crate::space::{Axis, AxisMotion, AxisTouch, Motion, Spatial, Touch};
use nalgebra::Vector3;

/// The plane z = 0 across the axis: z > 0 is penetration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plane;

impl Geometry<Axis> for Plane {
    #[inline]
    fn touch(&self, achieved: &AxisMotion) -> AxisTouch {
        AxisTouch { depth_m: achieved.position_m, rate_m_per_s: achieved.velocity_m_per_s }
    }
}

impl Geometry<Spatial> for Plane {
    #[inline]
    fn touch(&self, achieved: &Motion) -> Touch {
        place::touch(achieved, Vector3::zeros(), -Vector3::z(), achieved.position_m.z)
    }
}
