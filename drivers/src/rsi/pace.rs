//! How far the reader is behind the stream.
//!
//! Frames come once per cycle. After a stall of the reader they come at once, each older than it seems:
//! `lag = max(0, lag + interval - frames · cycle)`. The cycle is what the session has shown so far, a thousandth longer, so that a
//! constant delay, which one side alone cannot see, is forgotten within seconds and drift of the clocks never adds up.

use sim_core::time::Nanos;

/// Frames after which the cycle is known.
const LEARNED: i64 = 32;

/// The pace of one stream.
#[derive(Debug, Clone, Default)]
pub(super) struct Pace {
    begin: Option<Nanos>,
    last: Nanos,
    frames: i64,
    lag_ns: i64,
}

impl Pace {
    /// A frame, so many cycles after the one before, came at `now`: how old it seems to be.
    pub fn take(&mut self, now: Nanos, cycles: u64) -> Nanos {
        let Some(begin) = self.begin else {
            *self = Pace { begin: Some(now), last: now, frames: 0, lag_ns: 0 };
            return Nanos(0);
        };
        let cycles = i64::try_from(cycles).unwrap_or(i64::MAX).max(1);
        if self.frames >= LEARNED {
            let due = self.cycle_ns(begin).saturating_mul(cycles);
            let due = due.saturating_add(due / 1000);
            let interval = now.0.saturating_sub(self.last.0);
            self.lag_ns = self.lag_ns.saturating_add(interval).saturating_sub(due).max(0);
        }
        self.last = now;
        self.frames = self.frames.saturating_add(cycles);
        Nanos(self.lag_ns)
    }

    /// The cycle as seen so far, without what the last frame lags.
    fn cycle_ns(&self, begin: Nanos) -> i64 {
        let span = self.last.0.saturating_sub(begin.0).saturating_sub(self.lag_ns);
        span.max(0) / self.frames.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// The lag in ms after each frame: so many ms after the one before, so many cycles on.
    fn lags_ms(frames: impl IntoIterator<Item = (i64, u64)>) -> Vec<i64> {
        let mut pace = Pace::default();
        let mut now = Nanos(5 * MS);
        let mut lags = Vec::new();
        for (interval_ms, cycles) in frames {
            now = now + Nanos(interval_ms * MS);
            lags.push(pace.take(now, cycles).0 / MS);
        }
        lags
    }

    #[test]
    fn a_stall_of_the_reader_shows_as_lag_and_drains() {
        let steady = core::iter::repeat_n((4, 1), 100);
        let stall = [(40, 1)].into_iter().chain(core::iter::repeat_n((0, 1), 9));
        let lags = lags_ms(steady.chain(stall).chain(core::iter::repeat_n((4, 1), 10)));
        assert!(lags[..100].iter().all(|lag| *lag == 0));
        // 40 ms at once instead of 4, then nine frames that were waiting. A thousandth of each cycle is forgiven.
        assert_eq!(lags[100..110], [35, 31, 27, 23, 19, 15, 11, 7, 3, 0]);
        assert!(lags[110..].iter().all(|lag| *lag == 0));
    }

    #[test]
    fn missing_frames_are_no_lag() {
        let steady = core::iter::repeat_n((12, 1), 50);
        assert!(lags_ms(steady.chain([(120, 10), (12, 1)])).iter().all(|lag| *lag == 0));
    }

    #[test]
    fn times_at_the_ends_of_the_range_are_no_panic() {
        let mut pace = Pace::default();
        for i in 0..200 {
            pace.take(Nanos(if i % 2 == 0 { i64::MIN } else { i64::MAX }), u64::MAX);
        }
        assert!(pace.take(Nanos(0), 1).0 >= 0);
    }
}
