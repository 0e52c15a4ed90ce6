//! The read-back: the pose that the robot controller reports, late.

use serde::{Deserialize, Serialize};

/// A constant delay between the pose and its report.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Readout {
    /// Delay.
    pub delay_s: f64,
}
