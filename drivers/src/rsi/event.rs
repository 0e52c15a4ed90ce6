//! What the PC's side of the exchange has to say.
//!
//! From this side some causes look alike: a frame that was lost, one that the controller never sent, and one that a peer dropped
//! are all `rsi-gap`; a reply that was lost, that was late, or that carried a wrong IPOC or Type is `rsi-late`, because the
//! controller counts them alike.

use core::fmt;

use sim_core::time::Nanos;

use super::malformed::Malformed;
use super::number::BadNumber;

/// Something that happened on the link to one robot.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// The first frame of a session.
    Started {
        /// Its stamp.
        ipoc: u64,
    },
    /// A frame with nothing but a stamp, as a KRC2 sends before the exchange begins. It is not answered.
    Hello {
        /// Its stamp, where it has one.
        ipoc: Option<u64>,
    },
    /// The stamp jumped: the controller began anew. What was known of the old session is forgotten.
    Restarted {
        /// Last stamp of the old session.
        from: u64,
        /// First stamp of the new one.
        to: u64,
    },
    /// The stamp passed 2^32.
    Wrapped {
        /// Stamp after it.
        ipoc: u64,
    },
    /// The step of the stamp was learned, or is another one.
    Step {
        /// Advance per frame, ms on a real controller.
        step: u64,
    },
    /// Frames are missing.
    Gap {
        /// How many.
        missing: u64,
        /// Stamp of the frame after them.
        ipoc: u64,
    },
    /// The stamp advanced by something that is no multiple of its step.
    Irregular {
        /// By how much.
        advance: u64,
        /// The step.
        step: u64,
        /// The stamp.
        ipoc: u64,
    },
    /// The same stamp again.
    Duplicate {
        /// The stamp.
        ipoc: u64,
    },
    /// The same stamp for the third time: the controller's clock stands.
    Frozen {
        /// The stamp.
        ipoc: u64,
    },
    /// A frame that is older than one that came before it. It is not answered.
    OutOfOrder {
        /// Its stamp.
        ipoc: u64,
        /// How far behind the newest.
        behind: u64,
    },
    /// Frames were waiting when they were read: what is measured is old.
    Backlog {
        /// How old the newest frame seems to be.
        lag: Nanos,
    },
    /// A frame came before the one before it was answered.
    Unanswered {
        /// Stamp of the frame that got no answer.
        ipoc: u64,
    },
    /// The controller counted replies as late or invalid.
    Late {
        /// Its count (`Delay D`).
        count: i64,
        /// How many more than in the frame before.
        more: i64,
    },
    /// Nothing came for longer than allowed.
    Silent {
        /// How long.
        lasted: Nanos,
    },
    /// After silence, frames come again.
    Resumed {
        /// How long it was silent.
        lasted: Nanos,
    },
    /// Bytes that are no frame.
    Malformed(Malformed),
    /// A value that is no number.
    Number(BadNumber),
    /// `Type` of the frame is not KUKA.
    ForeignType {
        /// What it is.
        kind: String,
    },
    /// The frame spells `TYPE`, as only simulators do.
    ForeignSpelling,
    /// Something that the configuration names is not in the frame.
    Absent {
        /// Element, or element and attribute.
        name: String,
    },
    /// Something in the frame that the configuration does not name.
    Unexpected {
        /// Element, or element and attribute.
        name: String,
    },
    /// The measured pose is printed with so many decimals.
    Decimals {
        /// Digits after the point; the step of the feedback in mm and degrees.
        printed: usize,
    },
    /// Fewer decimals than printed ever differ from zero.
    Coarse {
        /// Digits after the point.
        printed: usize,
        /// How many of them say something.
        significant: usize,
    },
}

impl Event {
    /// Its name in recordings and counts.
    pub fn class(&self) -> &'static str {
        match self {
            Event::Started { .. } => "rsi-started",
            Event::Hello { .. } => "rsi-hello",
            Event::Restarted { .. } => "rsi-restart",
            Event::Wrapped { .. } => "rsi-wrap",
            Event::Step { .. } => "rsi-step",
            Event::Gap { .. } => "rsi-gap",
            Event::Irregular { .. } => "rsi-irregular",
            Event::Duplicate { .. } => "rsi-duplicate",
            Event::Frozen { .. } => "rsi-frozen",
            Event::OutOfOrder { .. } => "rsi-out-of-order",
            Event::Backlog { .. } => "rsi-backlog",
            Event::Unanswered { .. } => "rsi-unanswered",
            Event::Late { .. } => "rsi-late",
            Event::Silent { .. } => "rsi-silent",
            Event::Resumed { .. } => "rsi-resumed",
            Event::Malformed(_) => "rsi-malformed",
            Event::Number(_) => "rsi-number",
            Event::ForeignType { .. } => "rsi-type",
            Event::ForeignSpelling => "rsi-spelling",
            Event::Absent { .. } => "rsi-absent",
            Event::Unexpected { .. } => "rsi-unexpected",
            Event::Decimals { .. } => "rsi-decimals",
            Event::Coarse { .. } => "rsi-coarse",
        }
    }

    /// Whether it is news of a healthy link rather than an anomaly.
    pub fn is_news(&self) -> bool {
        matches!(
            self,
            Event::Started { .. }
                | Event::Hello { .. }
                | Event::Step { .. }
                | Event::Resumed { .. }
                | Event::Decimals { .. }
        )
    }
}

fn ms(time: Nanos) -> f64 {
    time.seconds() * 1e3
}

impl fmt::Display for Event {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Event::Started { ipoc } => write!(out, "the exchange begins at IPOC {ipoc}"),
            Event::Hello { ipoc: Some(ipoc) } => write!(out, "a first frame with nothing but IPOC {ipoc}"),
            Event::Hello { ipoc: None } => out.write_str("a first frame with nothing but an empty IPOC"),
            Event::Restarted { from, to } => write!(out, "IPOC jumped from {from} to {to}: the controller began anew"),
            Event::Wrapped { ipoc } => write!(out, "IPOC passed 2^32 and is {ipoc}"),
            Event::Step { step } => write!(out, "IPOC advances by {step} per frame"),
            Event::Gap { missing, ipoc } => write!(out, "{missing} frames are missing before IPOC {ipoc}"),
            Event::Irregular { advance, step, ipoc } => {
                write!(out, "IPOC advanced by {advance} to {ipoc}; its step is {step}")
            }
            Event::Duplicate { ipoc } => write!(out, "IPOC {ipoc} came again"),
            Event::Frozen { ipoc } => write!(out, "IPOC stands at {ipoc}"),
            Event::OutOfOrder { ipoc, behind } => write!(out, "IPOC {ipoc} came late, {behind} behind the newest"),
            Event::Backlog { lag } => write!(out, "frames were waiting: the newest is {:.1} ms old", ms(*lag)),
            Event::Unanswered { ipoc } => write!(out, "IPOC {ipoc} got no answer before the next frame"),
            Event::Late { count, more } => {
                write!(out, "the controller counted {more} more replies as late or invalid, {count} in all")
            }
            Event::Silent { lasted } => write!(out, "nothing came for {:.0} ms", ms(*lasted)),
            Event::Resumed { lasted } => write!(out, "frames come again after {:.0} ms", ms(*lasted)),
            Event::Malformed(problem) => write!(out, "no frame: {problem}"),
            Event::Number(problem) => write!(out, "{problem}"),
            Event::ForeignType { kind } => write!(out, "Type of the frame is '{kind}', not KUKA"),
            Event::ForeignSpelling => out.write_str("the frame spells TYPE; a controller writes Type"),
            Event::Absent { name } => {
                write!(out, "{name} is in the configuration and not in the frame; is it of this robot?")
            }
            Event::Unexpected { name } => {
                write!(out, "{name} is in the frame and not in the configuration; is it of this robot?")
            }
            Event::Decimals { printed } => {
                write!(out, "the measured pose has {printed} decimals (parameter Precision of the ETHERNET object)")
            }
            Event::Coarse { printed, significant } => {
                write!(out, "of {printed} printed decimals of the measured pose only {significant} say something")
            }
        }
    }
}
