//! Where the interfaces touch.
//!
//! In space the depth, its rate, the normal, the arm and the slip all come from one contact point of the probe; the normal on
//! the probe is the gradient of the gap, and the rate is what the motion makes of the depth, `d' = -n · (v + ω × arm)`.

use crate::space::Space;

mod cone;
mod funnel;
mod peg;
mod place;
mod placed;
mod plane;
mod ring;
pub use cone::Cone;
pub use peg::Peg;
pub use placed::Placed;
pub use plane::Plane;
pub use ring::Ring;

/// Turns the achieved motion into a penetration.
pub trait Geometry<S: Space>: Send + Sync {
    /// Depth, rate and place.
    fn touch(&self, achieved: &S::Motion) -> S::Touch;
}

#[cfg(test)]
mod places;
