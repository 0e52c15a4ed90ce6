//! A spring and a dashpot: `f = k d + b d'` (thesis eq. 1.5), positive resists penetration.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k | stiffness | N/m |
//! | b | damping | N s/m |
//! | d | penetration | m |
//!
//! One-sided contact acts while d > 0 and never pulls: at release a dashpot alone would, which is unphysical.
//! Two-sided, it is a spring and a bearing that act always.
//!
//! Not modelled: anything that depends on the depth but linearly; at first touch the dashpot answers with a step of force.

use super::{DepthLaw, Sides};
use crate::refusal::{self, Refusal};
use crate::signals::ContactForce;
use crate::space::{Axis, AxisTouch};
use serde::{Deserialize, Serialize};

/// Linear spring and dashpot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpringDashpot {
    /// Stiffness k.
    pub stiffness_n_per_m: f64,
    /// Damping b.
    pub damping_n_s_per_m: f64,
    /// One- or two-sided.
    pub sides: Sides,
}

impl SpringDashpot {
    /// The law, if its numbers have a meaning. Negative ones have: a device preloaded too far pushes apart, which is unstable, and is
    /// answered.
    pub fn checked(self) -> Result<Self, Refusal> {
        refusal::finite("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        refusal::finite("damping_n_s_per_m", self.damping_n_s_per_m, "N s/m")?;
        Ok(self)
    }
}

impl DepthLaw for SpringDashpot {
    #[inline]
    fn resistance(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        ContactForce {
            elastic: self.stiffness_n_per_m * touch.depth_m,
            dissipative: self.damping_n_s_per_m * touch.rate_m_per_s,
        }
    }

    #[inline]
    fn sides(&self) -> Sides {
        self.sides
    }
}
