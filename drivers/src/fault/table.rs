//! What the computer's side reports of each fault, and which faults look alike from there.
//!
//! The classes are those of [`crate::rsi::Event`] and [`crate::ft::Event`], without news of a healthy link (`rsi-started`,
//! `rsi-step`, `rsi-decimals`, `rsi-resumed`, `ft-sample`), and of the socket: `net-stranger`, `net-unreachable` (of
//! `net::Arrival`), `net-page` (of `net::NetError`). A fault that acts once after the first second or so, on a link that is sound
//! otherwise, shows these and no others.
//!
//! | from the computer these look alike | because |
//! |---|---|
//! | any reply that is lost, late, or has a wrong IPOC or Type | the controller counts them all as late, and says no more |
//! | any reply that cannot be read | RSIBad stops the robot; the frames cease |
//! | a frame that waits: `delay`, `jitter`; any reply that is lost | late is all that the controller counts |
//! | a frame that others overtake: `swap`, `hold` | one packet late is one packet overtaken |
//! | `ipoc-back` and `ipoc-restart` | a stamp far behind is a new session |
//! | a comma, an exponent, `NaN` | a value that is no number |
//! | `truncate` and `length` of a record | a wrong length |
//! | `status-word` (saturated) and `counts-at-limits` | either way the reading is clipped |
//!
//! | silent from here | who finds it |
//! |---|---|
//! | `cpf-change`, `unit-change` | the stream does not carry its units: the scale of the force, which `diagnose` fits |
//! | a bit of a count, in RDT | a jump of the force: RDT has no checksum |
//! | a short delay of the sensor's stream | device time against time of receipt, which a recording keeps |
//! | a correction that a reply lacks, or has too many of | HOLDON 1 holds it, and a robot that reads by name passes over more |
//!
//! Where a class depends on a parameter: a bit that flips may as well hit a digit, and then it is a wrong value that nobody sees;
//! a silence is one only if it lasts longer than the driver allows; a frozen IPOC is a duplicate until it comes the third time;
//! `ipoc-crossing` without a wrap is none; a slow page is late only beyond the limit of the request; with HOLDON 0, or on iiQKA,
//! a reply with other names is seen; a computer that is slower than a burst answers the newest frame alone, and says
//! `rsi-unanswered` of the others. For what a second socket, a closed port or a web server does, the row names the least.

use super::action::Action;
use super::wire_fault::Stream;

/// Who performs a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// [`super::Faulty`]: it changes, delays or drops bytes.
    Bytes,
    /// The robot's controller: its own clock jumps.
    Controller,
    /// A second socket that sends to the stream's receiver.
    ForeignSocket,
    /// The receiver's port closed, so that its machine answers with ICMP.
    ClosedPort,
    /// A second client of the sensor.
    SecondClient,
    /// The sensor's web server.
    Http,
}

/// A fault on a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Its name in a file.
    pub id: &'static str,
    /// The stream.
    pub on: Stream,
    /// Who performs it.
    pub needs: Needs,
    /// Classes of the events that the computer's side reports, sorted; none if it cannot see the fault at all.
    pub classes: &'static [&'static str],
}

const fn row_of(id: &'static str, on: Stream, needs: Needs, classes: &'static [&'static str]) -> Row {
    Row { id, on, needs, classes }
}

/// Every fault on every stream that can have it, sorted by stream.
pub const TABLE: &[Row] = &[
    row_of("drop", Stream::RsiFrame, Needs::Bytes, &["rsi-gap", "rsi-late"]),
    row_of("duplicate", Stream::RsiFrame, Needs::Bytes, &["rsi-duplicate"]),
    row_of("swap", Stream::RsiFrame, Needs::Bytes, &["rsi-gap", "rsi-late", "rsi-out-of-order"]),
    row_of("hold", Stream::RsiFrame, Needs::Bytes, &["rsi-gap", "rsi-late", "rsi-out-of-order"]),
    row_of("delay", Stream::RsiFrame, Needs::Bytes, &["rsi-late"]),
    row_of("jitter", Stream::RsiFrame, Needs::Bytes, &["rsi-late"]),
    row_of("silence-then-burst", Stream::RsiFrame, Needs::Bytes, &["rsi-backlog", "rsi-late", "rsi-silent"]),
    row_of("truncate", Stream::RsiFrame, Needs::Bytes, &["rsi-gap", "rsi-late", "rsi-malformed"]),
    row_of("flip-bit", Stream::RsiFrame, Needs::Bytes, &["rsi-gap", "rsi-late", "rsi-malformed"]),
    row_of("nul-padding", Stream::RsiFrame, Needs::Bytes, &[]),
    row_of("two-documents", Stream::RsiFrame, Needs::Bytes, &["rsi-late", "rsi-unanswered"]),
    row_of("ipoc-step", Stream::RsiFrame, Needs::Bytes, &["rsi-duplicate", "rsi-gap", "rsi-late"]),
    row_of("ipoc-zero", Stream::RsiFrame, Needs::Bytes, &["rsi-late", "rsi-restart"]),
    row_of("ipoc-previous", Stream::RsiFrame, Needs::Bytes, &["rsi-duplicate", "rsi-gap", "rsi-late"]),
    row_of("ipoc-middle", Stream::RsiFrame, Needs::Bytes, &[]),
    row_of("wrong-type", Stream::RsiFrame, Needs::Bytes, &["rsi-type"]),
    row_of("type-spelling", Stream::RsiFrame, Needs::Bytes, &["rsi-spelling"]),
    row_of("attribute-extra", Stream::RsiFrame, Needs::Bytes, &["rsi-unexpected"]),
    row_of("attribute-absent", Stream::RsiFrame, Needs::Bytes, &["rsi-absent"]),
    row_of("decimal-comma", Stream::RsiFrame, Needs::Bytes, &["rsi-number"]),
    row_of("nan", Stream::RsiFrame, Needs::Bytes, &["rsi-number"]),
    row_of("exponent", Stream::RsiFrame, Needs::Bytes, &["rsi-number"]),
    row_of("ipoc-freeze", Stream::RsiFrame, Needs::Controller, &["rsi-duplicate", "rsi-frozen"]),
    row_of("ipoc-back", Stream::RsiFrame, Needs::Controller, &["rsi-restart"]),
    row_of("ipoc-restart", Stream::RsiFrame, Needs::Controller, &["rsi-restart"]),
    row_of("ipoc-crossing", Stream::RsiFrame, Needs::Controller, &["rsi-wrap"]),
    row_of("foreign-peer", Stream::RsiFrame, Needs::ForeignSocket, &["net-stranger"]),
    row_of("drop", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("duplicate", Stream::RsiReply, Needs::Bytes, &[]),
    row_of("swap", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("hold", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("delay", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("jitter", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("silence-then-burst", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("truncate", Stream::RsiReply, Needs::Bytes, &["rsi-silent"]),
    row_of("flip-bit", Stream::RsiReply, Needs::Bytes, &["rsi-silent"]),
    row_of("nul-padding", Stream::RsiReply, Needs::Bytes, &[]),
    row_of("two-documents", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("ipoc-step", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("ipoc-zero", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("ipoc-previous", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("ipoc-middle", Stream::RsiReply, Needs::Bytes, &[]),
    row_of("wrong-type", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("type-spelling", Stream::RsiReply, Needs::Bytes, &["rsi-late"]),
    row_of("attribute-extra", Stream::RsiReply, Needs::Bytes, &[]),
    row_of("attribute-absent", Stream::RsiReply, Needs::Bytes, &[]),
    row_of("decimal-comma", Stream::RsiReply, Needs::Bytes, &["rsi-silent"]),
    row_of("nan", Stream::RsiReply, Needs::Bytes, &["rsi-silent"]),
    row_of("exponent", Stream::RsiReply, Needs::Bytes, &["rsi-silent"]),
    row_of("foreign-peer", Stream::RsiReply, Needs::ForeignSocket, &[]),
    row_of("icmp-unreachable", Stream::RsiReply, Needs::ClosedPort, &["net-unreachable"]),
    row_of("drop", Stream::Ft, Needs::Bytes, &["ft-gap"]),
    row_of("duplicate", Stream::Ft, Needs::Bytes, &["ft-duplicate"]),
    row_of("swap", Stream::Ft, Needs::Bytes, &["ft-gap", "ft-out-of-order"]),
    row_of("hold", Stream::Ft, Needs::Bytes, &["ft-gap", "ft-out-of-order"]),
    row_of("delay", Stream::Ft, Needs::Bytes, &[]),
    row_of("jitter", Stream::Ft, Needs::Bytes, &[]),
    row_of("silence-then-burst", Stream::Ft, Needs::Bytes, &["ft-resumed", "ft-stale"]),
    row_of("truncate", Stream::Ft, Needs::Bytes, &["ft-gap", "ft-malformed"]),
    row_of("flip-bit", Stream::Ft, Needs::Bytes, &[]),
    row_of("status-word", Stream::Ft, Needs::Bytes, &["ft-good", "ft-saturated"]),
    row_of("counts-at-limits", Stream::Ft, Needs::Bytes, &["ft-good", "ft-saturated"]),
    row_of("cpf-change", Stream::Ft, Needs::Bytes, &[]),
    row_of("unit-change", Stream::Ft, Needs::Bytes, &[]),
    row_of("rdt-restart", Stream::Ft, Needs::Bytes, &["ft-out-of-order", "ft-restart"]),
    row_of("ft-stall", Stream::Ft, Needs::Bytes, &["ft-moving", "ft-stalled"]),
    row_of("ft-restart", Stream::Ft, Needs::Bytes, &["ft-clock-back", "ft-clock-restart"]),
    row_of("length", Stream::Ft, Needs::Bytes, &["ft-gap", "ft-malformed"]),
    row_of("foreign-peer", Stream::Ft, Needs::ForeignSocket, &["net-stranger"]),
    row_of("second-client", Stream::Ft, Needs::SecondClient, &["ft-stale"]),
    row_of("lost-start", Stream::FtRequest, Needs::Bytes, &["ft-start-resent"]),
    row_of("icmp-unreachable", Stream::FtRequest, Needs::ClosedPort, &["net-unreachable"]),
    row_of("http-not-found", Stream::Http, Needs::Http, &["net-page"]),
    row_of("http-slow", Stream::Http, Needs::Http, &["net-page"]),
    row_of("http-half-page", Stream::Http, Needs::Http, &["net-page"]),
];

/// The row of this fault on this stream.
pub fn row(id: &str, on: Stream) -> Option<&'static Row> {
    TABLE.iter().find(|row| row.id == id && row.on == on)
}

/// The other faults that the driver reports with the same classes: from the computer alone they cannot be told apart.
pub fn alike(row: &Row) -> impl Iterator<Item = &'static Row> {
    TABLE.iter().filter(move |other| other.classes == row.classes && (other.id, other.on) != (row.id, row.on))
}

impl Action {
    /// Its name in a file.
    pub fn id(&self) -> &'static str {
        match self {
            Action::Drop { .. } => "drop",
            Action::Duplicate { .. } => "duplicate",
            Action::Swap { .. } => "swap",
            Action::Hold { .. } => "hold",
            Action::Delay { .. } => "delay",
            Action::Jitter { .. } => "jitter",
            Action::SilenceThenBurst { .. } => "silence-then-burst",
            Action::Truncate { .. } => "truncate",
            Action::FlipBit { .. } => "flip-bit",
            Action::NulPadding { .. } => "nul-padding",
            Action::TwoDocuments { .. } => "two-documents",
            Action::IpocStep { .. } => "ipoc-step",
            Action::IpocZero { .. } => "ipoc-zero",
            Action::IpocPrevious { .. } => "ipoc-previous",
            Action::IpocMiddle { .. } => "ipoc-middle",
            Action::WrongType { .. } => "wrong-type",
            Action::TypeSpelling { .. } => "type-spelling",
            Action::AttributeExtra { .. } => "attribute-extra",
            Action::AttributeAbsent { .. } => "attribute-absent",
            Action::DecimalComma { .. } => "decimal-comma",
            Action::Nan { .. } => "nan",
            Action::Exponent { .. } => "exponent",
            Action::IpocFreeze { .. } => "ipoc-freeze",
            Action::IpocBack { .. } => "ipoc-back",
            Action::IpocRestart { .. } => "ipoc-restart",
            Action::IpocCrossing { .. } => "ipoc-crossing",
            Action::ForeignPeer { .. } => "foreign-peer",
            Action::IcmpUnreachable { .. } => "icmp-unreachable",
            Action::StatusWord { .. } => "status-word",
            Action::CountsAtLimits { .. } => "counts-at-limits",
            Action::CpfChange { .. } => "cpf-change",
            Action::UnitChange { .. } => "unit-change",
            Action::RdtRestart { .. } => "rdt-restart",
            Action::FtStall { .. } => "ft-stall",
            Action::FtRestart { .. } => "ft-restart",
            Action::SecondClient { .. } => "second-client",
            Action::LostStart { .. } => "lost-start",
            Action::Length { .. } => "length",
            Action::HttpNotFound { .. } => "http-not-found",
            Action::HttpSlow { .. } => "http-slow",
            Action::HttpHalfPage { .. } => "http-half-page",
        }
    }
}
