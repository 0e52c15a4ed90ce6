//! A round probe tip against a round ring: `g = √((r - R)² + z²) - ρ - rt`, `d = -g`, normal on the probe = grad g.
//!
//! The ring lies in the plane z = 0 of the nozzle frame, about its origin: the ring of a launch adapter, for instance.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | R | radius of the ring's middle line | m |
//! | ρ | radius of its section | m |
//! | rt | radius of the tip; the probe tip is the middle of that ball | m |
//! | r, z | place of the probe tip: distance from the axis, and along it | m |
//!
//! Not modelled: a ring that is not round in section, the probe's shaft, contact on both sides of the axis at once.

use super::funnel::circle;
use super::{Geometry, place};
use crate::refusal::{self, Refusal};
use crate::space::{Motion, Spatial, Touch};
use nalgebra::Vector3;

/// Probe tip and ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    radius_m: f64,
    section_m: f64,
    tip_m: f64,
}

impl Ring {
    /// From the radii of the ring, its section and the tip.
    pub fn new(radius_m: f64, section_radius_m: f64, tip_radius_m: f64) -> Result<Self, Refusal> {
        let radius_m = refusal::positive("radius_m", radius_m, "m")?;
        let section_m = refusal::not_negative("section_radius_m", section_radius_m, "m")?;
        if section_m >= radius_m {
            let limit = "is not below the radius of the ring";
            return Err(Refusal { name: "section_radius_m", value: section_m, unit: "m", limit });
        }
        Ok(Ring { radius_m, section_m, tip_m: refusal::not_negative("tip_radius_m", tip_radius_m, "m")? })
    }
}

impl Geometry<Spatial> for Ring {
    #[inline]
    fn touch(&self, achieved: &Motion) -> Touch {
        let (r, outward) = place::from_axis(achieved.position_m, achieved.velocity_m_per_s);
        let reach_m = self.section_m + self.tip_m;
        let Some(away) = circle(r - self.radius_m, achieved.position_m.z) else {
            // The tip sits on the middle line, where every direction is nearest: back the way that it came is one.
            return place::touch(achieved, Vector3::z() * self.tip_m, -Vector3::z(), reach_m);
        };
        let mut normal = outward * away.radial;
        normal.z = away.axial;
        place::touch(achieved, -normal * self.tip_m, normal, reach_m - away.distance_m)
    }
}
