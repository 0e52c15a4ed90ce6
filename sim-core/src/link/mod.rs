//! The link: when a command takes effect.

use crate::signals::Received;
use crate::space::Space;
use crate::time::Nanos;
use serde::{Deserialize, Serialize};

/// A link with a constant dead time: a command issued at t takes effect at t + h.
///
/// Dead times below one tick of the loop are refused where a rig is built: the robot draws a straight line to a command that
/// must be known by then.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Dead time h.
    pub dead_time_s: f64,
}

impl Link {
    /// The command as the robot gets it, not yet late by any effect.
    pub fn receive<S: Space>(&self, commanded: &S::Motion) -> Received<S> {
        Received { motion: *commanded, late_s: 0.0, lost: false }
    }

    /// When a packet that was issued at `issued` takes effect, in s since the start of the run.
    pub fn due_s<S: Space>(&self, issued: Nanos, received: &Received<S>) -> f64 {
        issued.seconds() + self.dead_time_s + received.late_s
    }
}
