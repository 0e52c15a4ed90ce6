//! The recorder: what the log holds is one more stage, outside the loop. It stamps, rounds and adds read-out noise.

use crate::rng::Stream;
use crate::time::Nanos;
use serde::{Deserialize, Serialize};

/// Read-out noise and rounding of one logged channel. The controller uses its own noise-free value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LogChannel {
    /// Standard deviation of white read-out noise.
    pub sigma: f64,
    /// Step to which the log rounds; 0 for none.
    pub quantum: f64,
}

impl LogChannel {
    /// The value as the log holds it.
    pub fn written(&self, value: f64, random: &mut Stream) -> f64 {
        let noisy = if self.sigma > 0.0 { value + self.sigma * random.normal() } else { value };
        if self.quantum > 0.0 { libm::round(noisy / self.quantum) * self.quantum } else { noisy }
    }
}

/// The stamp that the log gives to a sample taken at `time`.
pub fn stamped(time: Nanos, offset_s: f64) -> Nanos {
    time + Nanos::from_seconds(offset_s)
}
