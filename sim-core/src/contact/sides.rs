//! Which way a contact acts, and when it lets go.
//!
//! With damping, the force is zero before the depth is, and the two definitions of release part: a contact that lets go at f = 0
//! never pulls; one that lets go at d = 0 pulls between. `restitution` has the formulas of both.

use crate::signals::ContactForce;
use crate::space::{Spatial, Touch, Wrench};
use serde::{Deserialize, Serialize};

/// Whether the law may pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// Acts in penetration only, and never pulls: release at f = 0.
    One,
    /// Acts in penetration only, and may pull until the depth is zero: release at d = 0.
    OnePulling,
    /// Acts always, both ways.
    Two,
}

impl Sides {
    /// Whether an interface at this depth, pressed with this force (positive resists), carries anything.
    #[inline]
    pub fn carries(self, depth_m: f64, pressing_n: f64) -> bool {
        match self {
            Sides::Two => true,
            Sides::OnePulling => depth_m > 0.0,
            Sides::One => depth_m > 0.0 && pressing_n > 0.0,
        }
    }

    /// The sum of the terms, or nothing: in space, what presses is the part along the normal on the probe.
    #[inline]
    pub fn clamped(self, touch: &Touch, force: &ContactForce<Spatial>) -> Wrench {
        let total = force.total();
        if self.carries(touch.depth_m, touch.normal.dot(&total.force_n)) { total } else { Wrench::default() }
    }
}
