//! Contact laws: a sum of terms, clamped once at the end ('never pulls' is a property of the sum).

use crate::signals::ContactForce;
use crate::space::Space;

mod spring_dashpot;
pub use spring_dashpot::{Sides, SpringDashpot};

/// The force that resists a penetration.
pub trait ContactLaw<S: Space>: Send + Sync {
    /// The nominal terms.
    fn force(&self, touch: &S::Touch) -> ContactForce<S>;
    /// The force at the interface, after effects have added their terms: nothing outside contact, and never a pull if one-sided.
    fn clamped(&self, touch: &S::Touch, force: &ContactForce<S>) -> S::Wrench;
}
