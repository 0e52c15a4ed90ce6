//! What every sensor protocol shares on the host's side: counters, silence, lost starts, status changes, counts of all.
//!
//! | rule | value | source |
//! |---|---|---|
//! | a lost start is sent again | every 100 ms, 10 times | reference/PROTOCOLS.md, section 2.1 |
//! | then | after 0.25 s, doubling to 5 s | section 2.4 |
//! | malformed in a row that make a new session | 10 | section 2.4 |
//! | silence after which a sample is stale | 100 ms, unless the settings say otherwise | section 2.4 |
//!
//! What was never asked to start (a passive tap) sends nothing. A bias is sent only when asked for.

use super::event::{Event, Health, Malformed, Sample, Tally};
use super::sequence::{Sequence, Step};
use super::{Sensor, Unable};
use sim_core::time::Nanos;

/// Time between two requests to stream while none is answered.
pub(super) const RESEND_EVERY: Nanos = Nanos(100_000_000);
/// Repetitions of a request before the sensor is said not to answer.
const RESENDS: u32 = 10;
/// First pause after that; it doubles.
const PAUSE_MIN: Nanos = Nanos(250_000_000);
/// Longest pause.
const PAUSE_MAX: Nanos = Nanos(5_000_000_000);
/// Malformed inputs in a row after which all that is known of the stream is dropped.
const MALFORMED_IN_A_ROW: u32 = 10;

/// One record, decoded and in SI units, before its counters are judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Force in N, torque in N m.
    pub wrench: [f64; 6],
    /// Status word; 0 where there is none.
    pub status: u32,
    /// Packet counter as it came.
    pub sequence: Option<u64>,
    /// Counter of the device's clock as it came.
    pub clock: Option<u64>,
    /// A count lies at the limit of its type.
    pub clipped: bool,
}

/// What a decoder finds in bytes.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// A record.
    Reading(Reading),
    /// Something else.
    Malformed(Malformed),
    /// An answer to a command.
    Event(Event),
    /// Bytes that are allowed and mean nothing.
    Nothing,
}

/// Widths and rate of a protocol's counters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counters {
    /// Bits of the packet counter.
    pub sequence_bits: Option<u32>,
    /// Bits and rate (in Hz) of the device's clock.
    pub clock: Option<(u32, f64)>,
}

/// What differs from protocol to protocol.
pub trait Wire {
    /// Widths and rate of the counters.
    fn counters(&self) -> Counters;
    /// What makes the device stream.
    fn start(&mut self, out: &mut Vec<Vec<u8>>);
    /// What ends the stream.
    fn stop(&mut self, out: &mut Vec<Vec<u8>>);
    /// What sets the zero at the present load, or takes it back; `None` where the protocol cannot.
    fn bias(&mut self, set: bool) -> Option<Vec<Vec<u8>>>;
    /// What is to be said next while the stream is being set up.
    fn next_request(&mut self, _out: &mut Vec<Vec<u8>>) {}
    /// How long one start may take before it goes out again.
    fn patience(&self) -> Nanos {
        RESEND_EVERY
    }
    /// A datagram, or a piece of a stream.
    fn decode(&mut self, bytes: &[u8], found: &mut Vec<Found>);
    /// What bytes on their way to the device ask it for.
    fn overhear(&self, _bytes: &[u8]) -> Vec<Event> {
        Vec::new()
    }
    /// What a status word amounts to, and each bit in words.
    fn judge(&self, status: u32) -> (Health, String);
    /// Drops what is half read.
    fn forget(&mut self) {}
}

/// The host's side of one sensor.
#[derive(Debug, Clone)]
pub struct Client<W> {
    wire: W,
    stale_after: Nanos,
    sequence: Option<Sequence>,
    clock: Option<(Sequence, f64)>,
    stalled: u64,
    status: Option<(u32, Health)>,
    malformed_run: u32,
    wanted: bool,
    answered: bool,
    /// A start went out, so that the packet counter may begin anew at 1.
    anew: bool,
    asked_at: Option<Nanos>,
    requests: u32,
    pause: Nanos,
    fresh_at: Option<Nanos>,
    stale: bool,
    tally: Tally,
    found: Vec<Found>,
}

impl<W: Wire> Client<W> {
    /// A host that has heard nothing yet.
    pub fn new(wire: W, stale_after: Nanos) -> Self {
        let counters = wire.counters();
        Client {
            wire,
            stale_after,
            sequence: counters.sequence_bits.map(Sequence::new),
            clock: counters.clock.map(|(bits, rate_hz)| (Sequence::new(bits), rate_hz)),
            stalled: 0,
            status: None,
            malformed_run: 0,
            wanted: false,
            answered: false,
            anew: false,
            asked_at: None,
            requests: 0,
            pause: PAUSE_MIN,
            fresh_at: None,
            stale: false,
            tally: Tally::default(),
            found: Vec::new(),
        }
    }

    /// The protocol's own part.
    pub fn wire(&self) -> &W {
        &self.wire
    }

    /// The protocol's own part, to change what it divides by.
    pub fn wire_mut(&mut self) -> &mut W {
        &mut self.wire
    }

    /// Counts events that did not come from bytes.
    pub(super) fn count(&mut self, events: &[Event]) {
        self.tally.count(events);
    }

    fn ask(&mut self, out: &mut Vec<Vec<u8>>) {
        self.wire.start(out);
        self.wanted = true;
        self.answered = false;
        self.anew = true;
        if let Some(sequence) = &mut self.sequence {
            // The packet counter begins anew at every start; the device's clock goes on.
            sequence.reset();
        }
    }

    fn accept(&mut self, now: Nanos, reading: Reading, events: &mut Vec<Event>) {
        self.malformed_run = 0;
        if !self.in_order(&reading, events) {
            return;
        }
        let device_s = self.device_time(&reading, events);
        self.fresh(now, events);
        let (health, text) = match self.wire.judge(reading.status) {
            (Health::Good | Health::Warning, text) if reading.clipped => {
                (Health::Saturated, format!("a count at the limit of its type; {text}"))
            }
            judged => judged,
        };
        let first_good = self.status.is_none() && health == Health::Good;
        if self.status != Some((reading.status, health)) {
            self.status = Some((reading.status, health));
            if !first_good {
                events.push(Event::Status { status: reading.status, health, text });
            }
        }
        let [fx, fy, fz, tx, ty, tz] = reading.wrench;
        events.push(Event::Sample(Sample {
            received: now,
            force_n: [fx, fy, fz],
            torque_n_m: [tx, ty, tz],
            status: reading.status,
            health,
            sequence: self.sequence.as_ref().and_then(Sequence::last),
            device_s,
        }));
    }

    /// Whether the packet is to be published.
    fn in_order(&mut self, reading: &Reading, events: &mut Vec<Event>) -> bool {
        let (Some(sequence), Some(seen)) = (&mut self.sequence, reading.sequence) else {
            return true;
        };
        if self.anew && seen == 1 {
            // What came since the start was of the old stream, still under way.
            self.anew = false;
            sequence.reset();
        }
        let last = sequence.last().unwrap_or_default();
        match sequence.see(seen) {
            Step::First | Step::Next => {}
            Step::Gap { lost } => events.push(Event::Gap { sequence: last.wrapping_add(lost + 1), lost }),
            Step::Restart => events.push(Event::Restart { last, seen }),
            Step::Duplicate => {
                events.push(Event::Duplicate { sequence: last });
                return false;
            }
            Step::OutOfOrder => {
                events.push(Event::OutOfOrder { last, seen });
                return false;
            }
        }
        true
    }

    /// Time of the device's clock, in s.
    fn device_time(&mut self, reading: &Reading, events: &mut Vec<Event>) -> Option<f64> {
        let ((clock, rate_hz), seen) = (self.clock.as_mut()?, reading.clock?);
        let last = clock.last().unwrap_or_default();
        let step = clock.see(seen);
        match step {
            Step::Duplicate => {
                self.stalled += 1;
                if self.stalled == 1 {
                    events.push(Event::Stalled { counter: last });
                }
            }
            Step::OutOfOrder => events.push(Event::ClockBack { last, seen }),
            Step::Restart => events.push(Event::ClockRestart { last, seen }),
            Step::First | Step::Next | Step::Gap { .. } => {}
        }
        if step != Step::Duplicate && self.stalled > 0 {
            events.push(Event::Moving { samples: self.stalled });
            self.stalled = 0;
        }
        if step == Step::OutOfOrder {
            return None;
        }
        clock.last().map(|ticks| ticks as f64 / *rate_hz)
    }

    fn fresh(&mut self, now: Nanos, events: &mut Vec<Event>) {
        if self.stale {
            let since = self.fresh_at.unwrap_or(now);
            events.push(Event::Resumed { silent: since_then(now, since) });
        }
        self.stale = false;
        self.answered = true;
        self.asked_at = None;
        self.requests = 0;
        self.pause = PAUSE_MIN;
        self.fresh_at = Some(now);
    }

    fn refuse(&mut self, why: Malformed, events: &mut Vec<Event>) {
        events.push(Event::Malformed(why));
        self.malformed_run += 1;
        if self.malformed_run >= MALFORMED_IN_A_ROW {
            self.malformed_run = 0;
            self.wire.forget();
            if let Some(sequence) = &mut self.sequence {
                sequence.reset();
            }
            events.push(Event::Session { why: "ten inputs in a row were no records" });
            if self.wanted {
                self.answered = false;
                self.asked_at = None;
                self.requests = 0;
            }
        }
    }

    /// While a request is not answered: sends it again, or says that nobody answers.
    fn insist(&mut self, now: Nanos, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>) {
        let Some(asked_at) = self.asked_at else {
            self.asked_at = Some(now);
            return;
        };
        let wait = if self.requests <= RESENDS { self.wire.patience() } else { self.pause.max(self.wire.patience()) };
        if since_then(now, asked_at) < wait {
            return;
        }
        self.requests += 1;
        self.asked_at = Some(now);
        if self.requests == RESENDS + 1 {
            events.push(Event::NoAnswer { requests: self.requests });
            return;
        }
        if self.requests > RESENDS + 1 {
            self.pause = Nanos(self.pause.0.saturating_mul(2).min(PAUSE_MAX.0));
        }
        let before = out.len();
        self.ask(out);
        if out.len() > before {
            events.push(Event::Resent { attempt: self.requests });
        }
    }
}

impl<W: Wire> Sensor for Client<W> {
    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        self.asked_at = None;
        self.requests = 0;
        self.ask(out);
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        self.wanted = false;
        self.wire.stop(out);
    }

    fn receive(&mut self, now: Nanos, bytes: &[u8], events: &mut Vec<Event>) {
        let before = events.len();
        let mut found = core::mem::take(&mut self.found);
        self.wire.decode(bytes, &mut found);
        for item in found.drain(..) {
            match item {
                Found::Reading(reading) => match reading.wrench.iter().position(|value| !value.is_finite()) {
                    Some(component) => self.refuse(Malformed::NotFinite { component }, events),
                    None => self.accept(now, reading, events),
                },
                Found::Malformed(why) => self.refuse(why, events),
                Found::Event(event) => events.push(event),
                Found::Nothing => {}
            }
        }
        self.found = found;
        self.tally.count(&events[before..]);
    }

    fn tick(&mut self, now: Nanos, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>) {
        let before = events.len();
        if self.wanted {
            self.wire.next_request(out);
        }
        if let Some(fresh_at) = self.fresh_at {
            let silent = since_then(now, fresh_at);
            if silent >= self.stale_after && !self.stale {
                self.stale = true;
                self.answered = false;
                events.push(Event::Stale { silent });
            }
        }
        if self.wanted && !self.answered {
            self.insist(now, out, events);
        }
        self.tally.count(&events[before..]);
    }

    fn bias(&mut self, set: bool, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>) -> Result<(), Unable> {
        let requests =
            self.wire.bias(set).ok_or(Unable { what: if set { "set a bias" } else { "take a bias back" } })?;
        out.extend(requests);
        let before = events.len();
        events.push(Event::Bias { set });
        if self.wanted {
            // Some firmwares disturb the stream: start it again and drop the old base.
            self.asked_at = None;
            self.ask(out);
        }
        self.tally.count(&events[before..]);
        Ok(())
    }

    fn overhear(&mut self, bytes: &[u8], events: &mut Vec<Event>) {
        let heard = self.wire.overhear(bytes);
        self.tally.count(&heard);
        events.extend(heard);
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }
}

fn since_then(now: Nanos, then: Nanos) -> Nanos {
    Nanos(now.0.saturating_sub(then.0))
}
