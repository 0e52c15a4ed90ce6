//! Recordings: from a file to a [`Session`], or to an [`Error`](crate::error::Error) that says what to do next.
//!
//! ```text
//!  .mcap ─ records (strict) ─┬─ collect ─ quality ─→ Session { series, grade, findings }
//!         damaged? ─ salvage ┘
//!  .csv  ─ csv ──────────────────────── quality ─→ Session
//! ```
//!
//! The usual MCAP readers accept a corrupted file silently, so a file is read with every checksum validated. A file that
//! was cut off is recovered as far as it goes; one with a wrong checksum is refused, unless the caller asks to salvage
//! it. Both are graded, and the [`Grade`] stands beside every verdict.
//!
//! Not covered: a file whose writer left a checksum out (MCAP writes 0 for "not computed"). What that leaves unprotected
//! is a [`Finding`]; counts and positions are then checked against the file's own summary, which catches a lost record
//! but not a changed digit.
//!
//! Memory: the series, one decoded chunk (at most [`RECORD_LENGTH_MAX`] bytes) and no copy of the file.

mod assemble;
mod collect;
mod csv;
mod dispatch;
mod ingest;
mod live;
mod map;
mod map_check;
mod mcap_write;
mod messages;
mod outline;
mod quality;
mod records;
mod rewrite;
mod salvage;
mod schemas;
mod session;
mod stale;
mod survey;

pub use dispatch::{RawMessage, Sink, Tally};
pub use ingest::{ReadOptions, from_bytes, read};
pub use live::{CHUNK_AGE_NS, JsonTopic, LiveWriter, Times};
pub use map::{
    AxisMap, AxisName, Body, Clock, Clocks, CsvMap, ForceSign, ForceUnit, Map, Role, SensorMap, Topics, TorqueUnit,
};
pub(crate) use map_check::clock_of;
pub use mcap_write::{Luggage, write_mcap, write_mcap_with};
pub use records::{RECORD_LENGTH_MAX, read_records};
pub use rewrite::{Copied, Stamped, luggage, rewrite};
pub use session::{Finding, Grade, Kind, Pose, Series, Session, Severity, Twist, Wrench};
