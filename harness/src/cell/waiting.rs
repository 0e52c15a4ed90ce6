//! Which answer belongs to which frame: by its stamp, not by when it comes.
//!
//! | stamp of an answer | what it is |
//! |---|---|
//! | that of the frame that waits | its answer |
//! | that of a frame that was answered | a spare: the robot has gone on |
//! | that of a frame that was given up | late; the frame that waits goes on waiting |
//! | another, or none | a wrong answer to the frame that waits, which the robot will refuse |

use drivers::rsi::Telegram;
use sim_core::time::Nanos;
use std::collections::VecDeque;

/// Stamps that are remembered: an answer is at most some cycles late. Chosen: a quarter of a second.
const STAMPS_MAX: usize = 64;

/// What an answer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// To the frame that waits, which was sent then.
    Answer(Nanos),
    /// To a frame that was given up.
    Late,
    /// To a frame that was answered.
    Spare,
    /// Nothing waits.
    Unasked,
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub(super) struct Waiting {
    /// The frame that waits: its stamp, if it can be read, and when it was sent.
    frame: Option<(Option<u64>, Nanos)>,
    answered: VecDeque<u64>,
    given_up: VecDeque<u64>,
}

/// The stamp of a document.
fn stamp(document: &[u8]) -> Option<u64> {
    Some(Telegram::decode(document).ok()?.ipoc()?.value)
}

fn remember(stamps: &mut VecDeque<u64>, stamp: Option<u64>) {
    stamps.extend(stamp);
    if stamps.len() > STAMPS_MAX {
        stamps.pop_front();
    }
}

impl Waiting {
    /// A frame has been sent; one that still waited is given up.
    pub fn sent(&mut self, frame: &[u8], at: Nanos) {
        self.give_up();
        let stamp = stamp(frame);
        for stamps in [&mut self.answered, &mut self.given_up] {
            // The same frame again may be answered again.
            stamps.retain(|known| Some(*known) != stamp);
        }
        self.frame = Some((stamp, at));
    }

    /// An answer has come.
    pub fn heard(&mut self, answer: &[u8]) -> Heard {
        let stamp = stamp(answer);
        let waits_for = self.frame.and_then(|(waits_for, _)| waits_for);
        let is_own = stamp.is_some() && stamp == waits_for;
        if let Some(stamp) = stamp.filter(|_| !is_own) {
            if self.answered.contains(&stamp) {
                return Heard::Spare;
            }
            if self.given_up.contains(&stamp) {
                return Heard::Late;
            }
        }
        let Some((_, at)) = self.frame.take() else { return Heard::Unasked };
        // A wrong answer leaves the frame's own stamp unsettled: whoever is one frame behind always answers the last one.
        remember(&mut self.answered, waits_for.filter(|_| is_own));
        Heard::Answer(at)
    }

    /// Whether a frame waits.
    pub fn waits(&self) -> bool {
        self.frame.is_some()
    }

    /// The frame that waits is given up; whether there was one.
    pub fn give_up(&mut self) -> bool {
        let Some((stamp, _)) = self.frame.take() else { return false };
        remember(&mut self.given_up, stamp);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(stamp: u64) -> Vec<u8> {
        format!("<Rob Type=\"KUKA\"><IPOC>{stamp}</IPOC></Rob>").into_bytes()
    }

    fn answer(stamp: u64) -> Vec<u8> {
        format!("<Sen Type=\"ImFree\"><IPOC>{stamp}</IPOC></Sen>").into_bytes()
    }

    #[test]
    fn an_answer_counts_for_its_own_frame_alone() {
        let mut waiting = Waiting::default();
        assert_eq!(waiting.heard(&answer(4)), Heard::Unasked);
        waiting.sent(&frame(4), Nanos(1));
        assert_eq!(waiting.heard(&answer(4)), Heard::Answer(Nanos(1)));
        assert_eq!(waiting.heard(&answer(4)), Heard::Spare, "the same answer again");
        waiting.sent(&frame(8), Nanos(2));
        assert_eq!(waiting.heard(&answer(4)), Heard::Spare);
        assert!(waiting.waits());
        waiting.sent(&frame(12), Nanos(3));
        assert_eq!((waiting.heard(&answer(8)), waiting.waits()), (Heard::Late, true));
        assert_eq!(waiting.heard(&answer(12)), Heard::Answer(Nanos(3)));
        waiting.sent(&frame(12), Nanos(4));
        assert_eq!(waiting.heard(&answer(12)), Heard::Answer(Nanos(4)), "a frame that comes again is answered again");
    }

    #[test]
    fn a_wrong_answer_is_one_and_whoever_is_a_frame_behind_stays_so() {
        let mut waiting = Waiting::default();
        for cycle in 1..10 {
            waiting.sent(&frame(4 * cycle), Nanos(0));
            assert_eq!(waiting.heard(&answer(4 * cycle - 4)), Heard::Answer(Nanos(0)), "{cycle}");
        }
        waiting.sent(&frame(400), Nanos(0));
        assert_eq!(waiting.heard(b"no document"), Heard::Answer(Nanos(0)));
        assert!(!waiting.give_up());
    }

    #[test]
    fn what_is_remembered_is_bounded() {
        let mut waiting = Waiting::default();
        for cycle in 0..1000 {
            waiting.sent(&frame(cycle), Nanos(0));
            if cycle % 2 == 0 {
                waiting.heard(&answer(cycle));
            }
        }
        assert!(waiting.answered.len() <= STAMPS_MAX && waiting.given_up.len() <= STAMPS_MAX);
    }
}
