//! Contact laws: a sum of terms, clamped once at the end ('never pulls' is a property of the sum).
//!
//! A law on depth and rate alone is written once, as a [`DepthLaw`], and holds along an axis and in space. Along an axis a force
//! is positive when it resists. In space every wrench is the one that acts **on the chaser**, at the probe tip, in the nozzle
//! frame: force `n f` along the normal n on the probe, torque `arm × force`.

use crate::signals::ContactForce;
use crate::space::Space;

mod compliance_device;
mod depth_law;
mod device_contact;
mod empirical;
mod friction;
mod hertz;
mod hunt_crossley;
mod impulse;
mod power;
mod series;
mod sides;
mod spring_dashpot;
mod stiffness_tensor;
pub use compliance_device::{ComplianceDevice, Spring};
pub use depth_law::DepthLaw;
pub use device_contact::DeviceContact;
pub use empirical::{Empirical, ROWS_MAX, Row};
pub use friction::{Friction, SMOOTHING_M_PER_S};
pub use hertz::{EXPONENT_OF_ROUND_BODIES, Hertz};
pub use hunt_crossley::HuntCrossley;
pub use impulse::{Impulse, Struck};
pub use series::{Series, tensors_in_series};
pub use sides::Sides;
pub use spring_dashpot::SpringDashpot;
pub use stiffness_tensor::{Principal, StiffnessTensor};

/// The force that resists a penetration.
pub trait ContactLaw<S: Space>: Send + Sync {
    /// The nominal terms.
    fn force(&self, touch: &S::Touch) -> ContactForce<S>;
    /// The force at the interface, after effects have added their terms: nothing outside contact, and never a pull if one-sided.
    fn clamped(&self, touch: &S::Touch, force: &ContactForce<S>) -> S::Wrench;
}

#[cfg(test)]
mod impact;
#[cfg(test)]
mod in_space;
