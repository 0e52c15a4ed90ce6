//! The force/torque sensor.

use crate::rng::Stream;
use crate::space::{Axis, AxisMotion, Space};
use core::fmt::Debug;

mod axis_cell;
mod space_cell;
pub use axis_cell::{AxisCell, SensorNoise};
pub use space_cell::{SpaceCell, WrenchNoise};

/// Standard gravity, in m/s² (CGPM 1901): what makes a weight of a tool's mass.
pub const GRAVITY_M_PER_S2: f64 = 9.80665;

/// Turns a contact force into a reading.
pub trait ForceSensor<S: Space>: Send + Sync {
    /// The analogue reading, before effects and noise: contact, weight of the tool, bias.
    fn reading(&self, achieved: &S::Motion, interface: &S::Wrench) -> S::Wrench;
    /// Whether the reading follows from the acceleration too; a sensor that says no spares a run its computation.
    fn reads_acceleration(&self) -> bool {
        true
    }
}

/// A reading that noise can be added to.
pub trait Noisy: Sized {
    /// How large the noise of each channel is.
    type Noise: Copy + Debug + PartialEq + Send + Sync;
    /// The slow part of the noise, from sample to sample.
    type Slow: Default;
    /// Whether this noise is none at all, so that a sample is the reading.
    fn silent(noise: &Self::Noise) -> bool;
    /// A noisy sample of this analogue reading; the noise is not silent.
    fn noisy(&self, noise: &Self::Noise, slow: &mut Self::Slow, random: &mut Stream) -> Self;
}

impl Noisy for f64 {
    type Noise = SensorNoise;
    type Slow = f64;

    fn silent(noise: &SensorNoise) -> bool {
        *noise == SensorNoise::NONE
    }

    #[inline]
    fn noisy(&self, noise: &SensorNoise, slow_n: &mut f64, random: &mut Stream) -> f64 {
        noise.disturbed(*self, slow_n, random)
    }
}

impl ForceSensor<Axis> for AxisCell {
    #[inline]
    fn reading(&self, achieved: &AxisMotion, interface: &f64) -> f64 {
        -interface + self.bias_n + self.tool_weight_n * libm::sin(achieved.pitch_rad)
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}
