//! What happens inside the controller, as only it can know, and how it stops.
//!
//! | stop | KRC4, KRC5, iiQKA print | KRC2 prints |
//! |---|---|---|
//! | timeout | `KSS29002 Signal flow (running): Object ETHERNET1 returns error RSITimeout` | `SEN: RSI execution error <execute> - RSI stopped`, `ERX: Defined timeout limit was reached. Answer from server missed!` |
//! | bad reply | the same with `RSIBad` | `SEN: …`, `Executing object 1000000` |
//! | monitor | `Stop by $CORRECTION function` | the same |
//! | commanded | nothing that is documented | the same |
//!
//! Source: reference/PROTOCOLS.md, section 1.6. Inferred: which of its messages belongs to the monitor, and that KRC2 names the
//! object for a bad reply.

use super::controller_settings::Family;
use super::{BadNumber, Malformed};
use core::fmt;

/// Something that the controller did or refused. A real one says nothing of most of them.
#[derive(Debug, Clone, PartialEq)]
pub enum ControllerEvent {
    /// A reply was not taken.
    Refused(Refusal),
    /// No reply was taken in this cycle; the count after it.
    Late {
        /// What `Delay D` says from now on.
        count: u32,
    },
    /// Late, and outputs with HOLDON 0 fell to 0 that were not 0: the robot is sent home in one cycle.
    Fell {
        /// How many outputs.
        outputs: usize,
    },
    /// A correction has begun to saturate.
    Limited,
    /// More replies are late than the warning allows (KRC2).
    Warning {
        /// Late ones in the window.
        count: u32,
    },
    /// The end of this run of RSI.
    Stopped(Stop),
}

/// Why a reply was not taken.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// `Type` is not SENTYPE: dropped without a trace.
    Type {
        /// What it says; at most 40 characters of it.
        got: String,
    },
    /// Its IPOC is not that of this cycle's frame.
    Ipoc {
        /// That of the frame; `None` if none was sent.
        expected: Option<u64>,
        /// That of the reply; `None` if it has none.
        got: Option<u64>,
    },
    /// It holds an element or attribute that the configuration does not know (RSI 6 only).
    Mapping {
        /// Element, or element and attribute.
        name: String,
    },
    /// It is no document.
    Malformed(Malformed),
    /// It is a document of the other direction.
    Direction,
    /// A value is no number.
    Number(BadNumber),
}

impl Refusal {
    /// Whether the ETHERNET object answers it with RSIBad.
    pub fn is_bad(&self) -> bool {
        matches!(self, Refusal::Malformed(_) | Refusal::Direction | Refusal::Number(_))
    }
}

/// Why RSI stopped.
#[derive(Debug, Clone, PartialEq)]
pub enum StopReason {
    /// More late replies than allowed.
    Timeout {
        /// How many.
        late: u32,
    },
    /// A reply that cannot be read, and why.
    Bad(Refusal),
    /// The correction is longer than POSCORRMON allows.
    Monitor {
        /// Length or angle.
        value: f64,
        /// Its limit.
        limit: f64,
        /// Of both.
        unit: &'static str,
    },
    /// The computer asked for it.
    Commanded,
}

/// RSI has stopped, and sends no more.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Why.
    pub reason: StopReason,
    /// In which cycle, from 0.
    pub cycle: u64,
    /// What the controller prints.
    pub messages: &'static [&'static str],
}

impl Stop {
    pub(super) fn new(reason: StopReason, cycle: u64, family: Family) -> Self {
        let krc2 = family == Family::Krc2;
        let messages: &[&str] = match reason {
            StopReason::Timeout { .. } if krc2 => &[
                "SEN: RSI execution error <execute> - RSI stopped",
                "ERX: Defined timeout limit was reached. Answer from server missed!",
            ],
            StopReason::Timeout { .. } => {
                &["KSS29002 Signal flow (running): Object ETHERNET1 returns error RSITimeout"]
            }
            StopReason::Bad(_) if krc2 => {
                &["SEN: RSI execution error <execute> - RSI stopped", "Executing object 1000000"]
            }
            StopReason::Bad(_) => &["KSS29002 Signal flow (running): Object ETHERNET1 returns error RSIBad"],
            StopReason::Monitor { .. } => &["Stop by $CORRECTION function"],
            StopReason::Commanded => &[],
        };
        Stop { reason, cycle, messages }
    }
}

impl ControllerEvent {
    /// Its class, for counts and reports.
    pub fn class(&self) -> &'static str {
        match self {
            ControllerEvent::Refused(Refusal::Type { .. }) => "controller-wrong-type",
            ControllerEvent::Refused(Refusal::Ipoc { .. }) => "controller-wrong-ipoc",
            ControllerEvent::Refused(Refusal::Mapping { .. }) => "controller-mapping",
            ControllerEvent::Refused(_) => "controller-bad-reply",
            ControllerEvent::Late { .. } => "controller-late",
            ControllerEvent::Fell { .. } => "controller-fell-to-zero",
            ControllerEvent::Limited => "controller-limited",
            ControllerEvent::Warning { .. } => "controller-warning",
            ControllerEvent::Stopped(_) => "controller-stopped",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ipoc = |value: &Option<u64>| value.map_or_else(|| "none".to_owned(), |value| value.to_string());
        match self {
            Refusal::Type { got } => write!(out, "a reply of Type '{got}' is dropped: it is not SENTYPE"),
            Refusal::Ipoc { expected, got } => {
                write!(out, "a reply with IPOC {} is refused: the frame has {}", ipoc(got), ipoc(expected))
            }
            Refusal::Mapping { name } => write!(out, "a reply with '{name}' is refused: RECEIVE does not name it"),
            Refusal::Malformed(why) => write!(out, "a reply is no document: {why}"),
            Refusal::Direction => write!(out, "a reply is a <Rob>, not a <Sen>"),
            Refusal::Number(why) => write!(out, "a reply holds no number: {why}"),
        }
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "RSI stopped in cycle {}: ", self.cycle)?;
        match &self.reason {
            StopReason::Timeout { late } => write!(out, "{late} late replies")?,
            StopReason::Bad(refusal) => refusal.fmt(out)?,
            StopReason::Monitor { value, limit, unit } => {
                write!(out, "a correction of {value:.3} {unit} exceeds {limit} {unit}")?;
            }
            StopReason::Commanded => write!(out, "the computer asked for it")?,
        }
        self.messages.iter().try_for_each(|message| write!(out, " | {message}"))
    }
}

impl fmt::Display for ControllerEvent {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ControllerEvent::Refused(refusal) => refusal.fmt(out),
            ControllerEvent::Late { count } => write!(out, "no reply was taken in time: Delay D = {count}"),
            ControllerEvent::Fell { outputs } => {
                write!(out, "{outputs} outputs with HOLDON 0 fell to zero: the robot is sent home in one cycle")
            }
            ControllerEvent::Limited => write!(out, "a correction saturates; a real controller says nothing"),
            ControllerEvent::Warning { count } => write!(out, "RSIWARNING: {count} late replies in the window"),
            ControllerEvent::Stopped(stop) => stop.fmt(out),
        }
    }
}
