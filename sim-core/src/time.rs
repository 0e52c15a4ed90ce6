//! Time as an integer, so that a million steps add up to exactly a million steps.

use core::ops::{Add, Sub};
use serde::{Deserialize, Serialize};

/// A time or a duration in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub struct Nanos(pub i64);

impl Nanos {
    /// The nearest whole nanosecond.
    pub fn from_seconds(seconds: f64) -> Self {
        Nanos(libm::round(seconds * 1e9) as i64)
    }

    /// Seconds; exact to rounding for less than 104 days.
    #[inline]
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }
}

/// A clock that a run asks once at each physics step.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    next: Nanos,
    period: Nanos,
}

impl Clock {
    /// A clock of this `period` that first ticks at `phase`, asked from the time `from` on. A period of zero never ticks.
    pub fn new(period: Nanos, phase: Nanos, from: Nanos) -> Self {
        if period.0 <= 0 {
            return Clock { next: Nanos(i64::MAX), period: Nanos(0) };
        }
        let missed = if from > phase { (from.0 - phase.0 + period.0 - 1) / period.0 } else { 0 };
        Clock { next: Nanos(phase.0 + missed * period.0), period }
    }

    /// Whether it ticks now; times only grow from call to call, and none that ticks is left out.
    #[inline]
    pub fn ticks(&mut self, now: Nanos) -> bool {
        let ticks = now == self.next;
        if ticks {
            self.next = self.next + self.period;
        }
        ticks
    }
}

impl Add for Nanos {
    type Output = Nanos;
    fn add(self, other: Nanos) -> Nanos {
        Nanos(self.0 + other.0)
    }
}

impl Sub for Nanos {
    type Output = Nanos;
    fn sub(self, other: Nanos) -> Nanos {
        Nanos(self.0 - other.0)
    }
}

/// One physics step.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Steps since the start of the run.
    pub index: u64,
    /// Time since the start of the run.
    pub now: Nanos,
    /// Length of a tick of the part that is being evaluated.
    pub dt: Nanos,
}
