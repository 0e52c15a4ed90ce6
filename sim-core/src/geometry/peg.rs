//! A peg with a round nose in a straight bore through a plate: a ball that slides on the wall, and a shaft that leans on a rim.
//!
//! The origin of the nozzle frame is the middle of the front rim, at which the bore begins; it runs along z. The peg is all points
//! within rp of a straight line that runs back from the probe tip, along -z of the probe. Three places may touch: the nose
//! against plate, wall or rim (as in `cone`, with no slope), the shaft against the front rim, and, once the nose is through, against
//! the rear one. The deepest counts; `d = rp - distance`, normal on the probe = gradient of the distance.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | R, L | radius and depth of the bore | m |
//! | rp | radius of peg and nose; the probe tip is the middle of the nose | m |
//! | q(s) | point of the shaft's middle line, s behind the probe tip | m |
//!
//! The point of the shaft nearest to a rim solves `d/ds [(r - R)² + (z - z₀)²] = 0`, by Newton steps from where the line crosses the
//! plane of the rim. Not modelled: two places at once (a peg that leans on nose and rim wedges; here the deeper one alone pushes),
//! a tilt beyond 45°, a depth beyond rp.

use super::funnel::{Distance, Funnel, circle};
use super::{Geometry, place};
use crate::refusal::{self, Refusal};
use crate::space::{Motion, Spatial, Touch};
use nalgebra::Vector3;

/// Most Newton steps; from the crossing of the plane, at tilts that fit a bore, two to four do.
const STEPS_MAX: usize = 12;

/// A step this small ends the search: what is then left is its square over the radius, far below what a depth can mean.
const STEP_END_M: f64 = 1e-8;

/// Peg and bore.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peg {
    bore: Funnel,
    bore_radius_m: f64,
    bore_depth_m: f64,
    peg_radius_m: f64,
    shaft_m: f64,
}

/// A point of the peg's middle line, how far behind the tip it is, and how far the wall is from it.
#[derive(Debug, Clone, Copy)]
struct Near {
    behind_m: f64,
    outward: Vector3<f64>,
    wall: Distance,
}

impl Peg {
    /// From radius and depth of the bore, radius of the peg, and length of the shaft behind its nose.
    pub fn new(bore_radius_m: f64, bore_depth_m: f64, peg_radius_m: f64, shaft_m: f64) -> Result<Self, Refusal> {
        let bore_radius_m = refusal::positive("bore_radius_m", bore_radius_m, "m")?;
        let bore_depth_m = refusal::positive("bore_depth_m", bore_depth_m, "m")?;
        let peg_radius_m = refusal::positive("peg_radius_m", peg_radius_m, "m")?;
        if peg_radius_m >= bore_radius_m {
            let limit = "is not below the radius of the bore";
            return Err(Refusal { name: "peg_radius_m", value: peg_radius_m, unit: "m", limit });
        }
        Ok(Peg {
            bore: Funnel::new(bore_radius_m, bore_radius_m, bore_depth_m),
            bore_radius_m,
            bore_depth_m,
            peg_radius_m,
            shaft_m: refusal::not_negative("shaft_m", shaft_m, "m")?,
        })
    }

    /// The nose against whatever is nearest.
    fn nose(&self, achieved: &Motion) -> Near {
        let (r, outward) = place::from_axis(achieved.position_m, achieved.velocity_m_per_s);
        Near { behind_m: 0.0, outward, wall: self.bore.distance(r, achieved.position_m.z) }
    }

    /// The point of the shaft that is nearest to the rim at depth `rim_z_m`, if it is nearer to it than `nearer_than_m`.
    fn shaft(&self, achieved: &Motion, axis: &Vector3<f64>, rim_z_m: f64, nearer_than_m: f64) -> Option<Near> {
        let (tip, lean2) = (achieved.position_m, axis.x * axis.x + axis.y * axis.y);
        let mut behind_m = (tip.z - rim_z_m) / axis.z;
        let crossing = tip - axis * behind_m;
        let crossing_r = libm::sqrt(crossing.x * crossing.x + crossing.y * crossing.y);
        // The nearest point is the foot of a point of the rim on the line: no further from the crossing than the rim is wide. And
        // the line leans by no more than its tilt, so that its distance from the rim is bounded from below.
        let short = behind_m < -2.0 * self.bore_radius_m;
        if !behind_m.is_finite() || short || (self.bore_radius_m - crossing_r) * axis.z.abs() >= nearer_than_m {
            return None;
        }
        for _ in 0..STEPS_MAX {
            let (x, y) = (tip.x - axis.x * behind_m, tip.y - axis.y * behind_m);
            let z = tip.z - axis.z * behind_m - rim_z_m;
            let r = libm::sqrt(x * x + y * y);
            if r <= 0.0 {
                break;
            }
            let r_rate = -(x * axis.x + y * axis.y) / r;
            let slope = (r - self.bore_radius_m) * r_rate - z * axis.z;
            let curve = r_rate * r_rate + (r - self.bore_radius_m) * (lean2 - r_rate * r_rate) / r + axis.z * axis.z;
            // Near the axis the distance is not convex, but there the shaft is far from the rim.
            let step_m = slope / if curve > 0.0 { curve } else { 1.0 };
            behind_m -= step_m;
            if step_m.abs() < STEP_END_M {
                break;
            }
        }
        if behind_m <= 0.0 || self.shaft_m <= 0.0 {
            return None;
        }
        let behind_m = behind_m.min(self.shaft_m);
        let point_m = tip - axis * behind_m;
        let velocity = achieved.velocity_m_per_s - achieved.rate_rad_per_s.cross(&(axis * behind_m));
        let (r, outward) = place::from_axis(point_m, velocity);
        // On the circle itself every direction is nearest; inward is one.
        let on_it = Distance { distance_m: 0.0, radial: -1.0, axial: 0.0 };
        let wall = circle(r - self.bore_radius_m, point_m.z - rim_z_m).unwrap_or(on_it);
        (wall.distance_m < nearer_than_m).then_some(Near { behind_m, outward, wall })
    }
}

impl Geometry<Spatial> for Peg {
    #[inline]
    fn touch(&self, achieved: &Motion) -> Touch {
        let axis = achieved.attitude * Vector3::z();
        let mut near = self.nose(achieved);
        for rim_z_m in [0.0, self.bore_depth_m] {
            near = self.shaft(achieved, &axis, rim_z_m, near.wall.distance_m).unwrap_or(near);
        }
        let mut normal = near.outward * near.wall.radial;
        normal.z = near.wall.axial;
        let arm_m = -axis * near.behind_m - normal * self.peg_radius_m;
        place::touch(achieved, arm_m, normal, self.peg_radius_m - near.wall.distance_m)
    }
}
