//! What every device's side shares: its load, its zero, who listens, and the faults that need no protocol.

use super::{Disturbance, Unable};
use crate::units::SensorScale;
use core::net::SocketAddr;

/// The parts of a device that are the same in every protocol.
#[derive(Debug, Clone, Default)]
pub struct Bench {
    /// Who asked last for the stream.
    pub client: Option<SocketAddr>,
    /// Whether samples go out.
    pub streams: bool,
    /// Counters go on and nothing goes out.
    pub silent: bool,
    /// The device's own counter and its reading stand still.
    pub stalled: bool,
    /// Status word that a test dictates.
    pub status: Option<u32>,
    /// Counts that a test dictates.
    pub counts: Option<[i32; 6]>,
    deaf_starts: u32,
    load: [f64; 6],
    bias: [f64; 6],
    held: Option<[f64; 6]>,
}

impl Bench {
    /// A request to start from this peer; whether it was heard.
    pub fn begin(&mut self, peer: Option<SocketAddr>) -> bool {
        if self.deaf_starts > 0 {
            self.deaf_starts -= 1;
            return false;
        }
        self.client = peer;
        self.streams = true;
        true
    }

    /// The zero is at the load of the last sample, or where it was at first.
    pub fn set_bias(&mut self, set: bool) {
        self.bias = if set { self.load } else { [0.0; 6] };
    }

    /// What the sensor reads of this load: less the zero; the old one while it stands still.
    pub fn read(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3]) -> [f64; 6] {
        let ([fx, fy, fz], [tx, ty, tz]) = (force_n, torque_n_m);
        self.load = [fx, fy, fz, tx, ty, tz];
        if let (true, Some(held)) = (self.stalled, self.held) {
            return held;
        }
        let mut read = self.load;
        read.iter_mut().zip(self.bias).for_each(|(value, bias)| *value -= bias);
        self.held = Some(read);
        read
    }

    /// Takes what needs no protocol; whether it did.
    pub fn disturb(&mut self, disturbance: Disturbance) -> bool {
        match disturbance {
            Disturbance::Status(status) => self.status = status,
            Disturbance::Counts(counts) => self.counts = counts,
            Disturbance::Stall(stalled) => self.stalled = stalled,
            Disturbance::DeafStarts(starts) => self.deaf_starts = starts,
            Disturbance::Silent(silent) => self.silent = silent,
            Disturbance::Sequence(_) | Disturbance::Clock(_) | Disturbance::Scale { .. } => return false,
        }
        true
    }
}

/// The scale that a test dictates.
pub(super) fn scale(counts_per_n: f64, counts_per_n_m: f64) -> Result<SensorScale, Unable> {
    let unable = Unable { what: "count with a scale that is not finite and above zero" };
    SensorScale::new(counts_per_n, counts_per_n_m).ok_or(unable)
}

/// A counter of the device that runs at its own rate beside the samples of the stream.
#[derive(Debug, Clone)]
pub struct Ticks {
    /// Where it stands.
    pub count: u64,
    per_sample: f64,
    owed: f64,
}

impl Ticks {
    /// A counter at zero that makes `clock_hz / rate_hz` ticks in a sample.
    pub fn new(clock_hz: f64, rate_hz: f64) -> Self {
        Ticks { count: 0, per_sample: clock_hz / rate_hz, owed: 0.0 }
    }

    /// One sample passes.
    pub fn advance(&mut self) {
        self.owed += self.per_sample;
        let whole = self.owed.floor();
        self.owed -= whole;
        self.count = self.count.wrapping_add(whole as u64);
    }
}
