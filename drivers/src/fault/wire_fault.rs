//! One fault as a file names it: `[[fault]]` with `id`, `on`, `at` and the parameters of its [`Action`].

use super::action::{Action, HELD_MAX};
use super::{schedule::Event, table};
use serde::{Deserialize, Serialize};

/// A stream of packets in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Stream {
    /// `Rob` documents, from a robot's controller to the computer.
    RsiFrame,
    /// `Sen` documents, from the computer to a robot's controller.
    RsiReply,
    /// Records, from the sensor to the computer.
    Ft,
    /// Commands, from the computer to the sensor.
    FtRequest,
    /// The sensor's pages.
    Http,
}

impl Stream {
    /// As a file writes it.
    pub fn id(self) -> &'static str {
        match self {
            Stream::RsiFrame => "rsi-frame",
            Stream::RsiReply => "rsi-reply",
            Stream::Ft => "ft",
            Stream::FtRequest => "ft-request",
            Stream::Http => "http",
        }
    }
}

/// From which packet on a fault acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "at is the number of a packet (0, 1, ...) or \"first-contact\"")]
pub enum At {
    /// The packet with this number: the cycle on an RSI link, the sample on a sensor's stream, the request on others.
    Number(u64),
    /// The first packet after this event.
    Event(Event),
}

/// A fault of one stream.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Written")]
pub struct WireFault {
    /// What it does.
    #[serde(flatten)]
    pub action: Action,
    /// To which stream.
    pub on: Stream,
    /// On whose link, if a cell has two robots; the first robot's where nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// From which packet on.
    pub at: At,
    /// On how many packets: one where nothing is said, or all that follow if it changes what sends.
    #[serde(rename = "for", skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
    /// On every n-th packet, counted from the first.
    pub every: u64,
    /// With which probability on each of them, drawn from the run's seed.
    pub chance: f64,
}

/// What stands in a file, before it is judged.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Written {
    #[serde(flatten)]
    action: Action,
    on: Stream,
    #[serde(default)]
    robot: Option<String>,
    at: At,
    #[serde(default, rename = "for")]
    count: Option<u64>,
    #[serde(default = "always")]
    every: u64,
    #[serde(default = "certain")]
    chance: f64,
}

fn always() -> u64 {
    1
}

fn certain() -> f64 {
    1.0
}

/// Why something is no fault.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FaultError {
    /// A fault that this stream cannot have.
    #[error("fault {id:?} cannot act on {on:?}; it acts on {allowed}")]
    Stream {
        /// The fault.
        id: &'static str,
        /// The stream that was asked for.
        on: &'static str,
        /// The streams that it knows.
        allowed: String,
    },
    /// A parameter that is out of bounds.
    #[error("fault {id:?}: {flaw}")]
    Parameter {
        /// The fault.
        id: &'static str,
        /// Name, value and limit.
        flaw: String,
    },
}

impl TryFrom<Written> for WireFault {
    type Error = FaultError;

    fn try_from(written: Written) -> Result<Self, FaultError> {
        let Written { action, on, robot, at, count, every, chance } = written;
        let fault = WireFault { action, on, robot, at, count, every, chance };
        fault.check()?;
        Ok(fault)
    }
}

impl WireFault {
    /// A fault that acts once, on the packet with this number.
    pub fn once(action: Action, on: Stream, number: u64) -> Result<Self, FaultError> {
        let at = At::Number(number);
        let fault = WireFault { action, on, robot: None, at, count: None, every: always(), chance: certain() };
        fault.check()?;
        Ok(fault)
    }

    /// Its name in a file.
    pub fn id(&self) -> &'static str {
        self.action.id()
    }

    /// Whether the list of faults has this name; other names are effects of the catalogue, or nothing.
    pub fn knows(id: &str) -> bool {
        table::TABLE.iter().any(|row| row.id == id)
    }

    fn check(&self) -> Result<(), FaultError> {
        let id = self.id();
        let flaw = |flaw: String| Err(FaultError::Parameter { id, flaw });
        if table::row(id, self.on).is_none() {
            let allowed: Vec<&str> = table::TABLE.iter().filter(|row| row.id == id).map(|row| row.on.id()).collect();
            return Err(FaultError::Stream { id, on: self.on.id(), allowed: allowed.join(", ") });
        }
        if self.count == Some(0) {
            return flaw("for = 0 packets: it would never act; leave the fault out".to_owned());
        }
        let silence = if self.action == (Action::SilenceThenBurst {}) { self.count.unwrap_or(1) } else { 0 };
        if silence > u64::from(HELD_MAX) {
            return flaw(format!(
                "for = {silence} packets of silence is outside [1, {HELD_MAX}]: they are held in memory"
            ));
        }
        if self.every == 0 {
            return flaw("every = 0 is below 1".to_owned());
        }
        if !(self.chance > 0.0 && self.chance <= 1.0) {
            return flaw(format!("chance = {} is outside (0, 1]", self.chance));
        }
        self.action.flaw().map_or(Ok(()), flaw)
    }
}

impl core::fmt::Display for WireFault {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(out, "{} on {}", self.id(), self.on.id())?;
        if let Some(robot) = &self.robot {
            write!(out, " of {robot}")?;
        }
        match self.at {
            At::Number(number) => write!(out, " at {number}"),
            At::Event(Event::FirstContact) => write!(out, " at first contact"),
        }
    }
}
