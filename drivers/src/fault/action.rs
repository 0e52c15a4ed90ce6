//! What a fault does, with its parameters. `id` names it in a file.

use serde::{Deserialize, Serialize};

/// Longest hold or delay, in packets: what is held is memory.
pub(super) const HELD_MAX: u32 = 10_000;
/// Longest packet that a fault may make, in bytes: the longest that UDP carries is shorter.
pub(super) const BYTES_MAX: usize = 65_536;

/// What happens to a packet, or beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "id", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Action {
    /// It is lost.
    Drop {},
    /// It arrives again, so many times more, at once.
    Duplicate {
        /// How many more; one where nothing is said.
        #[serde(default = "one")]
        copies: u32,
    },
    /// It arrives after the packets that follow it.
    Swap {
        /// How many packets overtake it.
        next: u32,
    },
    /// It alone arrives later; others overtake it.
    Hold {
        /// How much later, in packets of the stream.
        cycles: u32,
    },
    /// It arrives later, and what follows queues behind it.
    Delay {
        /// How much later, in packets of the stream.
        cycles: u32,
    },
    /// Delays from a table, in its order and again from its beginning; order is kept, as a network's queue keeps it.
    Jitter {
        /// Delays in µs.
        delays_us: Vec<u32>,
    },
    /// Nothing arrives while it acts; then everything at once.
    SilenceThenBurst {},
    /// Only its beginning arrives.
    Truncate {
        /// How many bytes arrive.
        bytes: usize,
    },
    /// One bit is the other way round.
    FlipBit {
        /// Which bit, from the lowest bit of the first byte; a random one where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bit: Option<usize>,
    },
    /// It arrives with zero bytes behind it, as a KRC2 that sends its whole buffer.
    NulPadding {
        /// Length that arrives, in bytes.
        #[serde(default = "krc2_buffer")]
        bytes: usize,
    },
    /// It waits for the next and arrives with it, in one piece.
    TwoDocuments {},
    /// Its IPOC is wrong by this.
    IpocStep {
        /// Difference in ms.
        step: i64,
    },
    /// Its IPOC is 0.
    IpocZero {},
    /// Its IPOC is that of the packet before.
    IpocPrevious {},
    /// Its IPOC stands between other elements.
    IpocMiddle {},
    /// Its root says another type.
    WrongType {
        /// What it says.
        #[serde(default = "wrong")]
        text: String,
    },
    /// Its root says `TYPE` where it said `Type`, or the other way round.
    TypeSpelling {},
    /// An element has one attribute more.
    AttributeExtra {
        /// Which element; the first with attributes where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        element: Option<String>,
    },
    /// An element lacks its last attribute.
    AttributeAbsent {
        /// Which element; the first with attributes where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        element: Option<String>,
    },
    /// A number has a comma where its point was.
    DecimalComma {
        /// Which element; the first with a decimal point where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        element: Option<String>,
    },
    /// A number is `NaN`.
    Nan {
        /// Which element; the first with a decimal point where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        element: Option<String>,
    },
    /// A number is written with an exponent, its value the same.
    Exponent {
        /// Which element; the first with a decimal point where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        element: Option<String>,
    },
    /// The controller sends the same IPOC again and again.
    IpocFreeze {},
    /// The controller's clock jumps back.
    IpocBack {
        /// By how much, in ms.
        ms: u64,
    },
    /// RSI starts again on the controller, and its clock with it.
    IpocRestart {
        /// First IPOC after the restart.
        first: u64,
    },
    /// The controller's clock passes 2^32 ms.
    IpocCrossing {
        /// Whether it goes on at 0, as 32 bits do, or above 2^32.
        wraps: bool,
    },
    /// Somebody else sends a packet of this stream to its receiver.
    ForeignPeer {},
    /// The receiver's port is closed, and its machine says so.
    IcmpUnreachable {},
    /// The record's status word says this.
    StatusWord {
        /// The whole word.
        status: u32,
    },
    /// Counts are the largest (or smallest) that 32 bits hold; the status word is left alone.
    CountsAtLimits {
        /// Which of Fx Fy Fz Tx Ty Tz, from 0; all where nothing is said.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<u8>,
        /// The smallest instead of the largest.
        #[serde(default)]
        negative: bool,
    },
    /// The sensor counts more finely or coarsely from now on, and nobody reads its calibration again.
    CpfChange {
        /// New counts per old count.
        factor: f64,
    },
    /// The sensor's units change from now on, from N and N m to pounds and pound-inches.
    UnitChange {},
    /// `rdt_sequence` starts again at 1.
    RdtRestart {},
    /// The sampler stands still: `ft_sequence` and counts stay, `rdt_sequence` goes on.
    FtStall {},
    /// `ft_sequence` starts again at 0, as after a power cycle.
    FtRestart {},
    /// Another client starts the stream, and it goes there.
    SecondClient {},
    /// The command that starts the stream is lost.
    LostStart {},
    /// The datagram has this length, cut or filled with zeros.
    Length {
        /// Bytes that arrive; not a multiple of 36.
        bytes: usize,
    },
    /// The sensor's page is not there: 404.
    HttpNotFound {},
    /// The sensor's page comes late.
    HttpSlow {
        /// How late, in ms.
        delay_ms: u32,
    },
    /// The sensor's page ends in its middle.
    HttpHalfPage {},
}

fn one() -> u32 {
    1
}

fn krc2_buffer() -> usize {
    2048
}

fn wrong() -> String {
    "Wrong".to_owned()
}

impl Action {
    /// Whether it lasts to the end of the run where nothing is said, because it changes what sends.
    pub(super) fn lasts(&self) -> bool {
        matches!(self, Action::CpfChange { .. } | Action::UnitChange {})
    }

    /// Why its parameters make no fault, if they make none.
    pub(super) fn flaw(&self) -> Option<String> {
        let within = |name: &str, value: u64, low: u64, high: u64| {
            (value < low || value > high).then(|| format!("{name} = {value} is outside [{low}, {high}]"))
        };
        match self {
            Action::Duplicate { copies } => within("copies", u64::from(*copies), 1, 100),
            Action::Swap { next } => within("next", u64::from(*next), 1, u64::from(HELD_MAX)),
            Action::Hold { cycles } | Action::Delay { cycles } => {
                within("cycles", u64::from(*cycles), 1, u64::from(HELD_MAX))
            }
            Action::Jitter { delays_us } if delays_us.iter().all(|&delay| delay == 0) => {
                Some("delays_us holds no delay above 0 µs".to_owned())
            }
            Action::Jitter { delays_us } => within("entries of delays_us", delays_us.len() as u64, 1, 1_000_000)
                .or_else(|| delays_us.iter().find_map(|&us| within("delays_us", u64::from(us), 0, 1_000_000))),
            Action::NulPadding { bytes } => within("bytes", *bytes as u64, 1, BYTES_MAX as u64),
            Action::Length { bytes } if bytes.is_multiple_of(36) => {
                Some(format!("bytes = {bytes} is a multiple of 36, the length of whole records"))
            }
            Action::Length { bytes } => within("bytes", *bytes as u64, 1, BYTES_MAX as u64),
            Action::IpocStep { step: 0 } => Some("step = 0 ms changes nothing".to_owned()),
            Action::IpocBack { ms } => within("ms", *ms, 1, u64::from(u32::MAX)),
            Action::WrongType { text } => text
                .contains(['"', '<', '>', '&'])
                .then(|| format!("text = {text:?} holds a character that ends an attribute")),
            Action::CountsAtLimits { axis: Some(axis), .. } => within("axis", u64::from(*axis), 0, 5),
            Action::CpfChange { factor } if !(factor.is_finite() && *factor > 0.0) => {
                Some(format!("factor = {factor} is not a finite number above 0"))
            }
            Action::HttpSlow { delay_ms } => within("delay_ms", u64::from(*delay_ms), 1, 600_000),
            _ => None,
        }
    }
}
