//! What a sensor's side of the wire has to say: samples, and everything that is not one.

use sim_core::time::Nanos;
use std::collections::BTreeMap;
use thiserror::Error;

/// One reading, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// When the host got it.
    pub received: Nanos,
    /// Force in the sensor's frame, in N.
    pub force_n: [f64; 3],
    /// Torque in the sensor's frame, in N m.
    pub torque_n_m: [f64; 3],
    /// Status word as it came; 0 where the protocol has none.
    pub status: u32,
    /// What it amounts to.
    pub health: Health,
    /// Packet counter, unwrapped: its low bits are those of the wire.
    pub sequence: Option<u64>,
    /// Clock of the device, unwrapped, in s; `None` where it has none, or while its counter cannot be believed.
    pub device_s: Option<f64>,
}

impl Sample {
    /// Whether the reading is a measurement: neither clipped nor invalid.
    pub fn is_measured(&self) -> bool {
        matches!(self.health, Health::Good | Health::Warning)
    }
}

/// How well the sensor says it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Health {
    /// Nothing to say.
    Good,
    /// It measures, and something is latched or limited.
    Warning,
    /// The load is out of range: the reading is clipped.
    Saturated,
    /// The reading must not be used.
    Error,
}

/// Bytes that are no record, and why.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Malformed {
    /// Wrong number of bytes.
    #[error("{got} bytes where {wanted} are due")]
    Length {
        /// Bytes that came.
        got: usize,
        /// What the protocol has.
        wanted: &'static str,
    },
    /// The bytes by which a record is known are not there.
    #[error("0x{got:x} at byte {at} where 0x{wanted:x} is due")]
    Header {
        /// What came.
        got: u64,
        /// What the protocol has.
        wanted: u64,
        /// First byte of it.
        at: usize,
    },
    /// The checksum of the bytes is another one.
    #[error("checksum 0x{got:x}, computed 0x{computed:x}")]
    Checksum {
        /// What came.
        got: u64,
        /// What the bytes give.
        computed: u64,
        /// Bytes of the record.
        bytes: usize,
    },
    /// Bytes of a stream that belong to no record.
    #[error("{bytes} bytes between records")]
    Garbage {
        /// How many.
        bytes: usize,
    },
    /// A component that is not a number, or infinite.
    #[error("component {component} of the wrench is not finite")]
    NotFinite {
        /// 0 to 5: Fx Fy Fz Tx Ty Tz.
        component: usize,
    },
    /// An answer that the protocol does not have.
    #[error("an answer that says nothing known: {0}")]
    Answer(String),
}

impl Malformed {
    /// Stable name of the kind.
    pub fn id(&self) -> &'static str {
        match self {
            Malformed::Length { .. } => "length",
            Malformed::Header { .. } => "header",
            Malformed::Checksum { .. } => "checksum",
            Malformed::Garbage { .. } => "garbage",
            Malformed::NotFinite { .. } => "not-finite",
            Malformed::Answer(_) => "answer",
        }
    }
}

/// What a device was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Asked {
    /// To stream.
    #[error("the sensor is asked to stream")]
    Start,
    /// To end its stream.
    #[error("the sensor is asked to stop")]
    Stop,
    /// To clear its latched monitor condition.
    #[error("the sensor is asked to clear its latched monitor condition")]
    ResetLatch,
}

/// What happened on the sensor's side.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Event {
    /// A reading.
    #[error("a sample")]
    Sample(Sample),
    /// Bytes that are no record; nothing was published.
    #[error("not a record: {0}")]
    Malformed(Malformed),
    /// The last packet again; not published.
    #[error("packet {sequence} came again")]
    Duplicate {
        /// Its counter.
        sequence: u64,
    },
    /// Packets are missing before this one.
    #[error("{lost} packets are missing before {sequence}")]
    Gap {
        /// Counter of the packet that came.
        sequence: u64,
        /// How many are missing.
        lost: u64,
    },
    /// A packet that is older than the last; not published.
    #[error("packet {seen} came after {last}")]
    OutOfOrder {
        /// Counter of the newest packet.
        last: u64,
        /// Counter of this one, as it came.
        seen: u64,
    },
    /// The packet counter began anew without being asked to.
    #[error("the packet counter began anew at {seen} after {last}")]
    Restart {
        /// Last counter of the old count.
        last: u64,
        /// Counter of this packet.
        seen: u64,
    },
    /// The device's own sample counter went back while the packets are in order; that sample has no device time.
    #[error("the device's sample counter went from {last} back to {seen}")]
    ClockBack {
        /// Newest counter.
        last: u64,
        /// Counter of this sample.
        seen: u64,
    },
    /// The device's own sample counter began anew: it was switched off and on.
    #[error("the device's sample counter began anew at {seen} after {last}: it was switched off and on")]
    ClockRestart {
        /// Last counter of the old count.
        last: u64,
        /// Counter of this sample.
        seen: u64,
    },
    /// Packets go on and the device's sample counter stands still: the same reading over and over. Said once for each stall.
    #[error("the device's sample counter stands still at {counter}")]
    Stalled {
        /// Where it stands.
        counter: u64,
    },
    /// The device's sample counter moves again.
    #[error("the device's sample counter moves again after {samples} samples")]
    Moving {
        /// Samples with the same counter.
        samples: u64,
    },
    /// No fresh sample for too long: the last one must not be used any more. Said once for each silence.
    #[error("no fresh sample for {} ms", silent.0 / 1_000_000)]
    Stale {
        /// Time since the last one.
        silent: Nanos,
    },
    /// Samples come again.
    #[error("samples come again after {} ms", silent.0 / 1_000_000)]
    Resumed {
        /// How long there was none.
        silent: Nanos,
    },
    /// The status changed.
    #[error("status 0x{status:08x}: {text}")]
    Status {
        /// The word as it came.
        status: u32,
        /// What it amounts to.
        health: Health,
        /// Each bit in words.
        text: String,
    },
    /// All that was known about the stream was dropped.
    #[error("new session: {why}")]
    Session {
        /// Why.
        why: &'static str,
    },
    /// The request to stream was sent again.
    #[error("no answer, the request to stream was sent again ({attempt})")]
    Resent {
        /// 1 for the first repetition.
        attempt: u32,
    },
    /// No answer to any of the requests.
    #[error("no answer to {requests} requests to stream; check address, network and power of the sensor")]
    NoAnswer {
        /// How many were sent.
        requests: u32,
    },
    /// The zero was asked for at the present load, or taken back.
    #[error("software bias {}", if *set { "set: the present load reads zero from now on" } else { "taken back" })]
    Bias {
        /// Whether it was set.
        set: bool,
    },
    /// The device counts differently from what the samples so far were divided by.
    #[error("{what} is {now}, and the samples so far were taken with {before}")]
    Scale {
        /// `counts_per_n`, `counts_per_n_m` or `model`.
        what: &'static str,
        /// Value in use until now.
        before: String,
        /// Value of the device.
        now: String,
    },
    /// Somebody else has asked the device for something: only who hears both directions can say so.
    #[error("{0}")]
    Asked(Asked),
    /// The device answered a command.
    #[error("the device answers: {0}")]
    Answer(String),
    /// The device refused a command.
    #[error("the device refuses: {0}")]
    Refused(String),
}

impl Event {
    /// Stable name of the class: what a fault is seen as from here.
    pub fn class(&self) -> &'static str {
        match self {
            Event::Sample(_) => "ft-sample",
            Event::Malformed(_) => "ft-malformed",
            Event::Duplicate { .. } => "ft-duplicate",
            Event::Gap { .. } => "ft-gap",
            Event::OutOfOrder { .. } => "ft-out-of-order",
            Event::Restart { .. } => "ft-restart",
            Event::ClockBack { .. } => "ft-clock-back",
            Event::ClockRestart { .. } => "ft-clock-restart",
            Event::Stalled { .. } => "ft-stalled",
            Event::Moving { .. } => "ft-moving",
            Event::Stale { .. } => "ft-stale",
            Event::Resumed { .. } => "ft-resumed",
            Event::Status { health: Health::Good, .. } => "ft-good",
            Event::Status { health: Health::Warning, .. } => "ft-warning",
            Event::Status { health: Health::Saturated, .. } => "ft-saturated",
            Event::Status { health: Health::Error, .. } => "ft-error",
            Event::Session { .. } => "ft-session",
            Event::Resent { .. } => "ft-start-resent",
            Event::NoAnswer { .. } => "ft-no-answer",
            Event::Bias { set: true } => "ft-bias-set",
            Event::Bias { set: false } => "ft-bias-cleared",
            Event::Asked(Asked::Start) => "ft-start",
            Event::Asked(Asked::Stop) => "ft-stop",
            Event::Asked(Asked::ResetLatch) => "ft-latch-reset",
            Event::Scale { .. } => "ft-scale",
            Event::Answer(_) => "ft-answer",
            Event::Refused(_) => "ft-refused",
        }
    }
}

/// How often each class came.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    classes: BTreeMap<&'static str, u64>,
    malformed: BTreeMap<&'static str, u64>,
}

impl Tally {
    /// Counts these.
    pub fn count(&mut self, events: &[Event]) {
        for event in events {
            *self.classes.entry(event.class()).or_default() += 1;
            if let Event::Malformed(why) = event {
                *self.malformed.entry(why.id()).or_default() += 1;
            }
        }
    }

    /// Events of this class so far.
    pub fn class(&self, class: &str) -> u64 {
        self.classes.get(class).copied().unwrap_or_default()
    }

    /// Every class that came, with its count.
    pub fn classes(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        self.classes.iter().map(|(class, count)| (*class, *count))
    }

    /// Malformed inputs by kind.
    pub fn malformed(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        self.malformed.iter().map(|(id, count)| (*id, *count))
    }
}
