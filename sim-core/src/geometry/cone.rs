//! A round probe tip in a nozzle cone with an outer rim and a throat that the probe passes through.
//!
//! The origin of the nozzle frame is the middle of the rim. The cone opens along -z and narrows with z, towards the throat.
//! `g = s - rt` with s the distance of the tip's middle from the wall; `d = -g`, normal on the probe = grad g. On the cone
//! `g = u sin α - r cos α - rt` and `n = a sin α - e_r cos α`, a = -z (reference/PHYSICS.md, section 3.4); at rim and throat the
//! wall is a circle, beyond the rim it is a plate, and behind the throat it is the back of that plate.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | α | half angle, between axis and wall | rad |
//! | rt | radius of the tip; the probe tip is the middle of that ball | m |
//! | u | height above the apex | m |
//! | r, e_r | distance from the axis, and the direction of it | m, 1 |
//!
//! Not modelled: the probe's shaft behind the tip; the outside of a thin nozzle (a tip that misses the rim meets a plate). A tip
//! wider than the throat rests on all of its circle; here the nearest side alone acts, so that its direction jumps on the axis.

use super::funnel::Funnel;
use super::{Geometry, place};
use crate::refusal::{self, Refusal};
use crate::space::{Motion, Spatial, Touch};

/// Probe tip and nozzle cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    funnel: Funnel,
    tip_radius_m: f64,
}

impl Cone {
    /// From the radii of rim, throat and tip, and the half angle between axis and wall.
    pub fn new(
        rim_radius_m: f64,
        throat_radius_m: f64,
        half_angle_rad: f64,
        tip_radius_m: f64,
    ) -> Result<Self, Refusal> {
        let rim_m = refusal::positive("rim_radius_m", rim_radius_m, "m")?;
        let throat_m = refusal::positive("throat_radius_m", throat_radius_m, "m")?;
        if throat_m >= rim_m {
            let limit = "is not below the radius of the rim";
            return Err(Refusal { name: "throat_radius_m", value: throat_m, unit: "m", limit });
        }
        let angle_rad = refusal::positive("half_angle_rad", half_angle_rad, "rad")?;
        if angle_rad >= core::f64::consts::FRAC_PI_2 {
            let limit = "is not below a right angle";
            return Err(Refusal { name: "half_angle_rad", value: angle_rad, unit: "rad", limit });
        }
        let tip_radius_m = refusal::not_negative("tip_radius_m", tip_radius_m, "m")?;
        let depth_m = (rim_m - throat_m) / libm::tan(angle_rad);
        Ok(Cone { funnel: Funnel::new(rim_m, throat_m, depth_m), tip_radius_m })
    }
}

impl Geometry<Spatial> for Cone {
    #[inline]
    fn touch(&self, achieved: &Motion) -> Touch {
        let (r, outward) = place::from_axis(achieved.position_m, achieved.velocity_m_per_s);
        let wall = self.funnel.distance(r, achieved.position_m.z);
        let mut normal = outward * wall.radial;
        normal.z = wall.axial;
        place::touch(achieved, -normal * self.tip_radius_m, normal, self.tip_radius_m - wall.distance_m)
    }
}
