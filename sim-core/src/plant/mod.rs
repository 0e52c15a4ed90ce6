//! The satellites: what the feedback accelerates, and what asks the robot for a pose.

use crate::space::Space;
use crate::time::Step;

mod point_mass;
pub use point_mass::{Integrator, PointMass, PointMassState};

/// Turns the net force into a commanded motion, one tick at a time.
pub trait Plant<S: Space>: Send + Sync {
    /// What changes from tick to tick.
    type State: Clone + Send;
    /// The state that has this motion.
    fn start(&self, first: &S::Motion) -> Self::State;
    /// The motion now: what is commanded at this tick, before its force acts.
    fn motion(&self, state: &Self::State) -> S::Motion;
    /// Lets `feedback` (positive resists closing) act for one tick.
    fn step(&self, state: &mut Self::State, step: Step, feedback: &S::Wrench);
}
