//! One axis of a force/torque sensor that carries a tool.
//!
//! `reading = -f + W sin θ + c`: the force on the probe, so that contact reads negative. At pitch θ about +x the weight W of the
//! tool has the component +W sin θ along z of the sensor. The sensor's electronics takes out the inertia of the declared tool;
//! any further mass is an effect.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | f | contact force, positive resists penetration | N |
//! | W | weight of the declared tool, m g | N |
//! | θ | pitch of the tool | rad |
//! | c | bias | N |

use crate::rng::Stream;
use serde::{Deserialize, Serialize};

/// Weight, bias and noise of one axis of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AxisCell {
    /// Weight of the declared tool.
    pub tool_weight_n: f64,
    /// Bias of the reading.
    pub bias_n: f64,
}

/// Noise of the reading: white, plus a slow part of first order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorNoise {
    /// Standard deviation of the white part.
    pub white_n: f64,
    /// Standard deviation of the slow part.
    pub slow_n: f64,
    /// What is left of the slow part after one sample.
    pub memory: f64,
    /// Step to which a reading is rounded; 0 for none.
    pub quantum_n: f64,
}

impl SensorNoise {
    /// A sensor that tells the truth.
    pub const NONE: SensorNoise = SensorNoise { white_n: 0.0, slow_n: 0.0, memory: 0.0, quantum_n: 0.0 };

    /// The sample that is read at a tick of the sensor; `slow_n` carries the slow part from sample to sample.
    #[inline]
    pub fn sample(&self, analogue_n: f64, slow_n: &mut f64, random: &mut Stream) -> f64 {
        if *self == SensorNoise::NONE { analogue_n } else { self.disturbed(analogue_n, slow_n, random) }
    }

    /// The same, drawing nothing for a part that is none.
    #[inline]
    pub(crate) fn drawn(&self, analogue_n: f64, slow_n: &mut f64, random: &mut Stream) -> f64 {
        let mut reading_n = analogue_n;
        if self.slow_n > 0.0 {
            let fresh = libm::sqrt((1.0 - self.memory * self.memory).max(0.0));
            *slow_n = self.memory * *slow_n + fresh * self.slow_n * random.normal();
            reading_n += *slow_n;
        }
        if self.white_n > 0.0 {
            reading_n += self.white_n * random.normal();
        }
        self.rounded(reading_n)
    }

    #[inline]
    fn rounded(&self, reading_n: f64) -> f64 {
        if self.quantum_n > 0.0 { libm::round(reading_n / self.quantum_n) * self.quantum_n } else { reading_n }
    }

    /// The same as [`SensorNoise::sample`], for a noise that is known to be some.
    #[inline]
    pub(crate) fn disturbed(&self, analogue_n: f64, slow_n: &mut f64, random: &mut Stream) -> f64 {
        // Drawn in any case: the other draws must not depend on it.
        let slow = random.normal();
        if self.slow_n > 0.0 {
            let fresh = libm::sqrt((1.0 - self.memory * self.memory).max(0.0));
            *slow_n = self.memory * *slow_n + fresh * self.slow_n * slow;
        }
        self.rounded(analogue_n + *slow_n + self.white_n * random.normal())
    }
}
