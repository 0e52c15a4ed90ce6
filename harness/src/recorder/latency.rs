//! What a proxy adds: from reading a packet to having sent it on.

use sim_core::time::Nanos;

/// Packets of which each single latency is kept; beyond, only count and greatest. Chosen: an hour of a robot, both ways.
const KEPT_MAX: usize = 1_800_000;

/// Latencies of one way.
#[derive(Debug, Clone, Default)]
pub struct Latency {
    kept_ns: Vec<u32>,
    count: u64,
    sum_ns: i64,
    most_ns: i64,
}

/// What latencies came to.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Packets.
    pub count: u64,
    /// The shortest.
    pub least_us: f64,
    /// Their mean.
    pub mean_us: f64,
    /// Half of them took no longer.
    pub median_us: f64,
    /// 99 of 100 took no longer.
    pub p99_us: f64,
    /// The longest.
    pub most_us: f64,
}

impl Latency {
    /// A packet that was read and sent on at these times.
    pub fn add(&mut self, read: Nanos, sent: Nanos) {
        let latency_ns = sent.0.saturating_sub(read.0).max(0);
        self.count += 1;
        self.sum_ns = self.sum_ns.saturating_add(latency_ns);
        self.most_ns = self.most_ns.max(latency_ns);
        if self.kept_ns.len() < KEPT_MAX {
            self.kept_ns.push(u32::try_from(latency_ns).unwrap_or(u32::MAX));
        }
    }

    /// `None` before the first packet.
    pub fn spread(&self) -> Option<Spread> {
        let mut sorted = self.kept_ns.clone();
        sorted.sort_unstable();
        let last = sorted.len().checked_sub(1)?;
        let at = |share: f64| f64::from(sorted[(share * last as f64).round() as usize]) * 1e-3;
        Some(Spread {
            count: self.count,
            least_us: at(0.0),
            mean_us: self.sum_ns as f64 * 1e-3 / self.count as f64,
            median_us: at(0.5),
            p99_us: at(0.99),
            most_us: self.most_ns as f64 * 1e-3,
        })
    }
}
