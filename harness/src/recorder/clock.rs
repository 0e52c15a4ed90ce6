//! The clock of one device while a session grows: reconstructed times, from what is known by then.
//!
//! A live recording cannot wait for its end. Each message gets the time that the lower envelope of all messages so far gives it;
//! within the first packets that is worth as much as the least delay among them, after seconds as much as the final line. When a
//! whole capture is read, the final lines are known before the first message is written.

use crate::clocks::{ClockLine, Envelope};

/// Host time after which a counter must have shown that it counts time. Chosen.
const PROBATION_NS: i64 = 1_000_000_000;
/// How far its span may be from the host's then: a stall of 0.2 s in one second. A counter that counts frames is off by 3 in 4.
const SPAN_ERROR_MAX: f64 = 0.2;
/// Device time ahead of the host's from which on a clock is too fast; more than what waits in a socket while the host sleeps, and
/// its ratio. Chosen. Below the first value a session is too short to tell.
const AHEAD: [(i64, f64); 2] = [(250_000_000, 1.5), (1_000_000_000, 1.05)];
/// The same while the session goes on: what had waited at its beginning could be much of it. Chosen.
const AHEAD_ALREADY: (i64, f64) = (2_000_000_000, 1.5);
/// Device time behind the host's from which on a clock is too slow, and its ratio. Chosen.
const BEHIND: (i64, f64) = (1_000_000_000, 0.95);

/// Lines of one device, one for each session of it; `None` where its counter counts no time.
pub type Lines = Vec<Option<ClockLine>>;

#[derive(Debug, Default)]
pub(super) struct DeviceClock {
    /// Final lines, where they are known already.
    known: Option<Lines>,
    ended: Lines,
    envelope: Envelope,
    first: Option<(i64, i64)>,
    is_counter: bool,
    last_ns: i64,
    /// How long it lasted: by the device's clock, and by the host's.
    span: (i64, i64),
}

impl DeviceClock {
    pub fn with(known: Option<Lines>) -> Self {
        DeviceClock { known, ..DeviceClock::default() }
    }

    /// The time of a sample that the device counts as `device_ns`, and that came at `received_ns`. Times only grow.
    pub fn stamp(&mut self, device_ns: Option<i64>, received_ns: i64) -> i64 {
        let stamp_ns = device_ns.and_then(|device_ns| self.reconstructed(device_ns, received_ns));
        // Nothing is older than its arrival; nothing comes before what came before it.
        self.last_ns = stamp_ns.unwrap_or(received_ns).min(received_ns).max(self.last_ns.saturating_add(1));
        self.last_ns
    }

    fn reconstructed(&mut self, device_ns: i64, received_ns: i64) -> Option<i64> {
        self.envelope.push(device_ns, received_ns);
        let (device_from, received_from) = *self.first.get_or_insert((device_ns, received_ns));
        let (device_span, span) = (device_ns.saturating_sub(device_from), received_ns.saturating_sub(received_from));
        self.span = (device_span, span);
        if span >= PROBATION_NS {
            let error = (device_span as f64 / span as f64 - 1.0).abs();
            self.is_counter = error > SPAN_ERROR_MAX;
        }
        let line = match &self.known {
            Some(lines) => lines.get(self.ended.len()).copied().flatten(),
            None => self.envelope.line().filter(|_| !self.is_counter),
        };
        line.map(|line| line.host_ns(device_ns))
    }

    /// Whether its counter turned out to count something else than time.
    pub fn counts_no_time(&self) -> bool {
        self.is_counter
    }

    /// How many of its seconds went by in one of the host's, where that is far from one. No crystal is off by a thousandth: either
    /// the counter counts something else, or the device does not live in real time.
    pub fn rate_off(&self) -> Option<f64> {
        let fast = || AHEAD.into_iter().any(|limit| self.is_ahead(limit));
        let (behind_ns, ratio_max) = BEHIND;
        let slow = || self.span.1.saturating_sub(self.span.0) > behind_ns && self.ratio() < ratio_max;
        (fast() || slow()).then(|| self.ratio())
    }

    /// Whether it is too fast for whatever may have waited.
    pub fn is_too_fast(&self) -> bool {
        self.is_ahead(AHEAD_ALREADY)
    }

    fn is_ahead(&self, (ahead_ns, ratio_min): (i64, f64)) -> bool {
        self.span.0.saturating_sub(self.span.1) > ahead_ns && self.ratio() > ratio_min
    }

    fn ratio(&self) -> f64 {
        self.span.0 as f64 / self.span.1.max(1) as f64
    }

    /// The device begins a new session: its counter starts anywhere.
    pub fn restart(&mut self) {
        self.ended.push(self.line());
        self.envelope = Envelope::default();
        self.first = None;
        self.span = (0, 0);
        self.is_counter = false;
    }

    /// All lines, the present one last.
    pub fn lines(&self) -> Lines {
        let mut lines = self.ended.clone();
        lines.push(self.line());
        lines
    }

    fn line(&self) -> Option<ClockLine> {
        self.envelope.line().filter(|_| !self.is_counter)
    }
}
