//! The eight wires of the loop, by name.

use crate::space::Space;
use serde::{Deserialize, Serialize};

/// A wire. Each has exactly one producer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wire {
    /// Relative pose that the satellites ask for.
    Commanded,
    /// The command as the robot got it.
    Received,
    /// Pose that the robot really has.
    Achieved,
    /// Pose that the robot controller reports.
    Measured,
    /// Depth, rate and place of the penetration.
    Touch,
    /// Force at the docking interface.
    Contact,
    /// The sensor's reading.
    Sensed,
    /// Net force that drives the satellites.
    Feedback,
    /// Not in the loop: the stage that stamps and rounds what the log holds.
    Recorder,
}

impl Wire {
    /// The wire's name as users type it.
    pub fn name(self) -> &'static str {
        match self {
            Wire::Commanded => "commanded",
            Wire::Received => "received",
            Wire::Achieved => "achieved",
            Wire::Measured => "measured",
            Wire::Touch => "touch",
            Wire::Contact => "contact",
            Wire::Sensed => "sensed",
            Wire::Feedback => "feedback",
            Wire::Recorder => "recorder",
        }
    }
}

/// A command as the robot got it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Received<S: Space> {
    /// The pose in the packet that counts.
    pub motion: S::Motion,
    /// How much later than the link's nominal dead time it takes effect, in s.
    pub late_s: f64,
    /// Whether this tick's packet was lost, so that the last one counts.
    pub lost: bool,
}

impl<S: Space> Default for Received<S> {
    fn default() -> Self {
        Received { motion: S::Motion::default(), late_s: 0.0, lost: false }
    }
}

/// Force at the interface before the law's clamp; positive resists penetration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForce<S: Space> {
    /// The part that follows from the depth.
    pub elastic: S::Wrench,
    /// The part that follows from the rate, or from the path.
    pub dissipative: S::Wrench,
}

impl<S: Space> Default for ContactForce<S> {
    fn default() -> Self {
        ContactForce { elastic: S::Wrench::default(), dissipative: S::Wrench::default() }
    }
}

impl<S: Space> ContactForce<S> {
    /// Elastic and dissipative part together.
    pub fn total(&self) -> S::Wrench {
        self.elastic + self.dissipative
    }
}

/// What every wire carries now. Wires further down the loop hold the value of their last tick.
#[derive(Debug, Clone, Copy)]
pub struct Signals<S: Space> {
    /// See [`Wire::Commanded`].
    pub commanded: S::Motion,
    /// See [`Wire::Received`].
    pub received: Received<S>,
    /// See [`Wire::Achieved`].
    pub achieved: S::Motion,
    /// See [`Wire::Measured`].
    pub measured: S::Motion,
    /// See [`Wire::Touch`].
    pub touch: S::Touch,
    /// See [`Wire::Contact`]; not yet clamped.
    pub contact: ContactForce<S>,
    /// The contact force after the law's clamp: what the interface really feels.
    pub interface: S::Wrench,
    /// See [`Wire::Sensed`].
    pub sensed: S::Wrench,
    /// See [`Wire::Feedback`]; positive resists closing.
    pub feedback: S::Wrench,
}

impl<S: Space> Default for Signals<S> {
    fn default() -> Self {
        Signals {
            commanded: Default::default(),
            received: Default::default(),
            achieved: Default::default(),
            measured: Default::default(),
            touch: Default::default(),
            contact: Default::default(),
            interface: Default::default(),
            sensed: Default::default(),
            feedback: Default::default(),
        }
    }
}
