//! Any geometry, shifted and turned in the nozzle frame: a nozzle that is not where the program takes it to be.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | o | origin of the geometry, in the nozzle frame | m |
//! | D | turns axes of the geometry into axes of the nozzle frame | |
//!
//! `p' = Dᵀ (p - o)`, `v' = Dᵀ v`, and what is touched comes back by D. A cone that is tilted by θ shows `sin θ` of its axial force
//! across the axis; a mounting error is 0.1° to 2° and 0.5 mm to 3 mm (reference/PHYSICS.md, section 8, effect 32).

use super::Geometry;
use crate::refusal::{self, Refusal};
use crate::space::{Motion, Spatial, Touch};
use nalgebra::{UnitQuaternion, Vector3};

/// A geometry in another place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed<G> {
    geometry: G,
    origin_m: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
}

impl<G: Geometry<Spatial>> Placed<G> {
    /// Puts a geometry's origin at `origin_m`, turned by `attitude`.
    pub fn new(geometry: G, origin_m: Vector3<f64>, attitude: UnitQuaternion<f64>) -> Result<Self, Refusal> {
        for value in origin_m.iter() {
            refusal::finite("origin_m", *value, "m")?;
        }
        for value in attitude.coords.iter() {
            refusal::finite("attitude", *value, "")?;
        }
        Ok(Placed { geometry, origin_m, attitude })
    }
}

impl<G: Geometry<Spatial>> Geometry<Spatial> for Placed<G> {
    fn touch(&self, achieved: &Motion) -> Touch {
        let back = self.attitude.inverse();
        let there = self.geometry.touch(&Motion {
            position_m: back * (achieved.position_m - self.origin_m),
            attitude: back * achieved.attitude,
            velocity_m_per_s: back * achieved.velocity_m_per_s,
            rate_rad_per_s: back * achieved.rate_rad_per_s,
            acceleration_m_per_s2: back * achieved.acceleration_m_per_s2,
        });
        Touch {
            normal: self.attitude * there.normal,
            point_m: self.origin_m + self.attitude * there.point_m,
            arm_m: self.attitude * there.arm_m,
            slip_m_per_s: self.attitude * there.slip_m_per_s,
            ..there
        }
    }
}
