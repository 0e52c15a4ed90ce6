//! When a fault acts. The number of a packet or an event starts it; `for`, `every` and `chance` say how it goes on.

use super::wire_fault::{At, WireFault};
use serde::{Deserialize, Serialize};
use sim_core::rng;

/// Something in a run that may start a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Event {
    /// Probe and nozzle touch for the first time.
    FirstContact,
}

/// When a fault acts, and how often it has.
#[derive(Debug, Clone)]
pub struct Schedule {
    at: At,
    start: Option<u64>,
    happened: bool,
    count: u64,
    every: u64,
    chance: f64,
    random: rng::Stream,
    asked: u64,
    acted: u64,
    first: Option<u64>,
}

impl Schedule {
    /// Of this fault, the `index`-th of its run; draws come from the run's stream that carries both names.
    pub fn new(fault: &WireFault, index: usize, streams: &rng::Streams) -> Self {
        let start = match fault.at {
            At::Number(number) => Some(number),
            At::Event(_) => None,
        };
        let whole = if fault.action.lasts() { u64::MAX } else { 1 };
        Schedule {
            at: fault.at,
            start,
            happened: false,
            count: fault.count.unwrap_or(whole),
            every: fault.every.max(1),
            chance: fault.chance,
            random: streams.named(&format!("fault/{index}/{}", fault.id())),
            asked: 0,
            acted: 0,
            first: None,
        }
    }

    /// This event has happened: the next packet is the first on which a fault that waits for it acts.
    pub fn event(&mut self, event: Event) {
        self.happened |= self.at == At::Event(event);
    }

    /// Whether it is to act on the packet with this number. Numbers only grow; each is asked once.
    pub fn due(&mut self, number: u64) -> bool {
        self.asked = number;
        if self.start.is_none() && self.happened {
            self.start = Some(number);
        }
        let Some(since) = self.start.and_then(|start| number.checked_sub(start)) else { return false };
        let within = since % self.every == 0 && since / self.every < self.count;
        within && (self.chance >= 1.0 || self.random.uniform() < self.chance)
    }

    /// It did act: not before is it counted.
    pub fn count(&mut self) {
        self.acted += 1;
        self.first.get_or_insert(self.asked);
    }

    /// How often it acted.
    pub fn acted(&self) -> u64 {
        self.acted
    }

    /// Number of the packet on which it acted first.
    pub fn first(&self) -> Option<u64> {
        self.first
    }

    /// A whole number below `limit`, drawn from the fault's own stream; 0 if the limit is 0.
    pub(super) fn below(&mut self, limit: usize) -> usize {
        ((self.random.uniform() * limit as f64) as usize).min(limit.saturating_sub(1))
    }
}
