//! How well a cell kept real time, and its controller with it.

use serde::Serialize;
use sim_core::time::Nanos;

/// How well the time was kept.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Timing {
    /// Cycles that were run.
    pub cycles: u64,
    /// How late the frames of a cycle were sent.
    pub sent_late: Spread,
    /// How long the answers took that came in time.
    pub answers_in_time: Spread,
    /// Frames without an answer in time.
    pub late_or_missing: u64,
    /// Time that was not spent waiting, in ns.
    pub busy_ns: i64,
    /// Time from the first cycle to the last, in ns.
    pub total_ns: i64,
}

/// Times of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spread {
    /// How many.
    pub count: u64,
    /// Their sum, in ns.
    pub sum_ns: i64,
    /// The longest, in ns.
    pub most_ns: i64,
}

impl Spread {
    pub(super) fn add(&mut self, time: Nanos) {
        self.count += 1;
        self.sum_ns += time.0;
        self.most_ns = self.most_ns.max(time.0);
    }
}
