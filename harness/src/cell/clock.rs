//! The clock on the wall: only for those who wait for somebody else. What a run computes never asks it.

use sim_core::time::Nanos;

/// Time since it was made.
#[derive(Debug, Clone, Copy)]
pub struct WallClock(Begun);

#[expect(clippy::disallowed_types, reason = "sockets wait in real time; nothing that is computed depends on it")]
type Begun = std::time::Instant;

impl WallClock {
    /// Starts at zero.
    #[expect(clippy::new_without_default, reason = "a clock that starts is not a default")]
    pub fn new() -> Self {
        WallClock(Begun::now())
    }

    /// Now.
    pub fn now(&self) -> Nanos {
        Nanos(i64::try_from(self.0.elapsed().as_nanos()).unwrap_or(i64::MAX))
    }
}
