//! The satellites: what the feedback accelerates, and what asks the robot for a pose.

use crate::space::Space;
use crate::time::Step;

mod body;
mod integrator;
mod lanes;
mod point_mass;
mod two_body;
pub use body::{Body, BodyMotion, BodyState, Push};
pub use integrator::Integrator;
pub use point_mass::{Integrator as PointIntegrator, PointMass, PointMassState};
pub use two_body::{TwoBody, TwoBodyState};

/// Turns the net force into a commanded motion, one tick at a time.
pub trait Plant<S: Space>: Send + Sync {
    /// What changes from tick to tick.
    type State: Clone + Send;
    /// The state that has this motion.
    fn start(&self, first: &S::Motion) -> Self::State;
    /// The motion now: what is commanded at this tick, before its force acts.
    fn motion(&self, state: &Self::State) -> S::Motion;
    /// Lets `feedback` act for one tick. Along one axis positive resists closing; in space it is the wrench on the chaser at the
    /// probe tip, in the nozzle frame, so that contact is negative along z.
    fn step(&self, state: &mut Self::State, step: Step, feedback: &S::Wrench);
}
