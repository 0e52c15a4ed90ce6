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

use super::ContactLaw;
use crate::signals::ContactForce;
use crate::space::{Axis, AxisTouch};
use serde::{Deserialize, Serialize};

/// Whether the law may pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// Acts in penetration only, and never pulls.
    One,
    /// Acts always, both ways.
    Two,
}

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

impl ContactLaw<Axis> for SpringDashpot {
    fn force(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        ContactForce {
            elastic: self.stiffness_n_per_m * touch.depth_m,
            dissipative: self.damping_n_s_per_m * touch.rate_m_per_s,
        }
    }

    fn clamped(&self, touch: &AxisTouch, force: &ContactForce<Axis>) -> f64 {
        match self.sides {
            Sides::Two => force.total(),
            Sides::One if touch.depth_m > 0.0 => force.total().max(0.0),
            Sides::One => 0.0,
        }
    }
}
