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

    /// Whether a clock of this `period`, first ticking at `phase`, ticks now.
    pub fn ticks(self, period: Nanos, phase: Nanos) -> bool {
        period.0 > 0 && self >= phase && (self.0 - phase.0) % period.0 == 0
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
