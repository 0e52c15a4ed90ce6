//! Contact laws: a sum of terms, clamped once at the end ('never pulls' is a property of the sum).
//!
//! A law on depth and rate alone is written once, as a [`DepthLaw`], and holds along an axis and in space. Along an axis a force
//! is positive when it resists. In space every wrench is the one that acts **on the chaser**, at the probe tip, in the nozzle
//! frame: force `n f` along the normal n on the probe, torque `arm × force`.

use crate::signals::ContactForce;
use crate::space::Space;

mod depth_law;
mod sides;
mod spring_dashpot;
pub use depth_law::DepthLaw;
pub use sides::Sides;
pub use spring_dashpot::SpringDashpot;

/// The force that resists a penetration.
pub trait ContactLaw<S: Space>: Send + Sync {
    /// The nominal terms.
    fn force(&self, touch: &S::Touch) -> ContactForce<S>;
    /// The force at the interface, after effects have added their terms: nothing outside contact, and never a pull if one-sided.
    fn clamped(&self, touch: &S::Touch, force: &ContactForce<S>) -> S::Wrench;
}
