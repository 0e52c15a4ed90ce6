//! The compensator: what the satellites are told that they feel, and what the robot is told on their behalf.

use crate::space::{AxisMotion, Space};
use crate::time::Step;

mod applied;
mod architecture;
pub mod delay_compensation;
mod hybrid;
mod hybrid_space;
mod position_estimator;
mod software;
pub use applied::Applied;
pub use architecture::{Architecture, VirtualPose};
pub use delay_compensation::{Compensation, DelayCompensation, Uncompensated};
pub use hybrid::{Hybrid, HybridState};
pub use hybrid_space::{AxisPair, HybridSpace, HybridSpaceState, SpacePose};
pub use position_estimator::{PositionEstimator, PositionEstimatorState};
pub use software::{Release, Software, SoftwareState};

/// Turns a reading and a measured pose into the net force on the satellites.
pub trait Compensator<S: Space>: Send + Sync {
    /// What changes from tick to tick.
    type State: Clone + Send;
    /// Before the first tick; `period_s` is the loop's.
    fn start(&self, measured: &S::Motion, period_s: f64) -> Self::State;
    /// The net force at this tick. Along one axis positive resists closing; in space it is the wrench on the chaser at the probe
    /// tip, in the nozzle frame.
    fn feedback(&self, state: &mut Self::State, step: Step, heard: Heard<'_, S>) -> S::Wrench;
    /// Whether it reads the acceleration of the measured pose; one that says no spares a run its computation.
    fn reads_acceleration(&self) -> bool {
        true
    }
    /// What the robot is told at this tick, before its force is known, when the satellites ask for `asked`.
    fn command(&self, _state: &mut Self::State, _step: Step, asked: S::Motion) -> S::Motion {
        asked
    }
}

/// What a compensator can hear.
pub struct Heard<'a, S: Space> {
    /// The newest sample of the force sensor; none before its first.
    pub sensed: Option<&'a S::Wrench>,
    /// The motion that was commanded at this tick.
    pub commanded: &'a S::Motion,
    /// The newest pose that the robot controller reports.
    pub measured: &'a S::Motion,
    /// The force at the interface, for rigs whose mechanics closes the loop.
    pub interface: &'a S::Wrench,
    /// The force that drives the rig from outside, if one does.
    pub applied: S::Wrench,
}

/// The pitch-dependent weight of a tool along the axis.
pub(crate) fn weight_along_axis_n(weight_n: f64, measured: &AxisMotion) -> f64 {
    weight_n * libm::sin(measured.pitch_rad)
}
