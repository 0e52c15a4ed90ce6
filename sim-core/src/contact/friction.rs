//! Dry friction at the nozzle, on top of any law in space: `f_t = -μ |f_n| v_t / √(v_t² + ε²)` at the contact point.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | μ | coefficient | 1 | 0.05 to 0.3 is the usual range (reference/PHYSICS.md, section 8, effect 33) |
//! | f_n | normal force after the law's clamp | N | |
//! | v_t | slip: velocity of the probe at the contact point, across the normal | m/s | |
//! | ε | speed below which friction is viscous | m/s | chosen, not measured |
//!
//! Friction follows the clamped normal force, so it is added by the clamp: the wire `contact` holds the normal terms, and the
//! force at the interface holds all. A bearing that is pulled presses on its other side, hence the size of f_n. The power of the
//! friction is `-μ |f_n| v_t² / √(v_t² + ε²)`, never above zero.
//!
//! Not modelled: sticking (below ε the contact creeps), the turn about the normal, a greater force at rest.

use super::ContactLaw;
use crate::refusal::{self, Refusal};
use crate::signals::ContactForce;
use crate::space::{Spatial, Touch, Wrench};

/// Smoothing speed ε: 1/35 of the impact speed of thesis 4.4. Chosen, not measured.
pub const SMOOTHING_M_PER_S: f64 = 0.001;

/// A law, with friction across its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction<L> {
    law: L,
    coefficient: f64,
    smoothing_m_per_s: f64,
}

impl<L> Friction<L> {
    /// Puts friction on a law.
    pub fn new(law: L, coefficient: f64, smoothing_m_per_s: f64) -> Result<Self, Refusal> {
        Ok(Friction {
            law,
            coefficient: refusal::not_negative("coefficient", coefficient, "")?,
            smoothing_m_per_s: refusal::positive("smoothing_m_per_s", smoothing_m_per_s, "m/s")?,
        })
    }
}

impl<L: ContactLaw<Spatial>> ContactLaw<Spatial> for Friction<L> {
    fn force(&self, touch: &Touch) -> ContactForce<Spatial> {
        self.law.force(touch)
    }

    fn clamped(&self, touch: &Touch, force: &ContactForce<Spatial>) -> Wrench {
        let pressed = self.law.clamped(touch, force);
        let normal_n = touch.normal.dot(&pressed.force_n).abs();
        let slip = &touch.slip_m_per_s;
        let speed_m_per_s = libm::sqrt(slip.norm_squared() + self.smoothing_m_per_s * self.smoothing_m_per_s);
        let force_n = slip * (-self.coefficient * normal_n / speed_m_per_s);
        pressed + Wrench { force_n, torque_n_m: touch.arm_m.cross(&force_n) }
    }
}
