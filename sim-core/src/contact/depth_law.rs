//! A law on depth and rate alone, lifted to one axis and to space.
//!
//! In space `force = n f`, `torque = arm × force`. The normal n is that of the touch, so the lift adds no term of its own: what
//! the scalar law dissipates is what the wrench dissipates, `wrench · twist = -f d'`.

use super::{ContactLaw, Sides};
use crate::signals::ContactForce;
use crate::space::{Axis, AxisTouch, Spatial, Touch, Wrench};

/// Force along the normal as a function of depth and rate.
pub trait DepthLaw: Send + Sync {
    /// The nominal terms, in N; positive resists penetration. Not clamped.
    fn resistance(&self, touch: &AxisTouch) -> ContactForce<Axis>;
    /// Which way it acts.
    fn sides(&self) -> Sides;
}

impl<L: DepthLaw> ContactLaw<Axis> for L {
    #[inline]
    fn force(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        self.resistance(touch)
    }

    #[inline]
    fn clamped(&self, touch: &AxisTouch, force: &ContactForce<Axis>) -> f64 {
        let total_n = force.total();
        if self.sides().carries(touch.depth_m, total_n) { total_n } else { 0.0 }
    }
}

impl<L: DepthLaw> ContactLaw<Spatial> for L {
    fn force(&self, touch: &Touch) -> ContactForce<Spatial> {
        let along = self.resistance(&touch.along_normal());
        ContactForce { elastic: touch.pushed(along.elastic), dissipative: touch.pushed(along.dissipative) }
    }

    fn clamped(&self, touch: &Touch, force: &ContactForce<Spatial>) -> Wrench {
        self.sides().clamped(touch, force)
    }
}

impl Touch {
    /// Depth and rate along the normal.
    #[inline]
    pub fn along_normal(&self) -> AxisTouch {
        AxisTouch { depth_m: self.depth_m, rate_m_per_s: self.rate_m_per_s }
    }

    /// The wrench on the chaser at the probe tip of a force along the normal, positive on the probe's side.
    #[inline]
    pub fn pushed(&self, force_n: f64) -> Wrench {
        let force_n = self.normal * force_n;
        Wrench { force_n, torque_n_m: self.arm_m.cross(&force_n) }
    }
}
