//! The force/torque sensor.

use crate::space::{Axis, AxisMotion, Space};

mod axis_cell;
pub use axis_cell::{AxisCell, SensorNoise};

/// Turns a contact force into a reading.
pub trait ForceSensor<S: Space>: Send + Sync {
    /// The analogue reading, before effects and noise: contact, weight of the tool, bias.
    fn reading(&self, achieved: &S::Motion, interface: &S::Wrench) -> S::Wrench;
}

impl ForceSensor<Axis> for AxisCell {
    fn reading(&self, achieved: &AxisMotion, interface: &f64) -> f64 {
        -interface + self.bias_n + self.tool_weight_n * libm::sin(achieved.pitch_rad)
    }
}
