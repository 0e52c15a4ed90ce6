//! Counters on the wire: unwrapped, and every way in which they can go wrong told apart.
//!
//! `delta = (seen - last) mod 2^bits`, after reference/PROTOCOLS.md, section 2.4:
//!
//! | delta | meaning | published |
//! |---|---|---|
//! | 0 | duplicate | no |
//! | 1 | next | yes |
//! | 2 .. 2^(bits-1) - 1 | gap of delta - 1 | yes |
//! | else | out of order; `last` stays | no |
//!
//! A restart looks like 'out of order', or like a gap over the wrap. It is believed when a second value rises from the first:
//! at once where the first is further away than a network reorders, or is the 0 or 1 that counters begin with and was seen
//! before; else after [`REPLAYED_MIN`] values that were all seen before, which no burst of duplicates reaches.
//!
//! Not covered: a restart that lands ahead of `last` without a wrap; it is a gap.

/// How far back a late packet still counts as reordered. Chosen: 64 ms at 1 kHz, longer than a local network holds a packet.
const WINDOW: u64 = 64;
/// Rising values, all seen before, that make a restart within the window. Chosen, above any burst of duplicates.
const REPLAYED_MIN: u32 = 8;

/// What a counter says about its packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The first since the start or a reset: nothing to compare with.
    First,
    /// One more than the last.
    Next,
    /// The same as the last.
    Duplicate,
    /// Ahead of the next by this many.
    Gap {
        /// Packets that are missing.
        lost: u64,
    },
    /// Behind the last one, or not yet believed.
    OutOfOrder,
    /// The counter began anew.
    Restart,
}

/// Values that may be the beginning of a restarted counter.
#[derive(Debug, Clone, Copy)]
struct Suspect {
    value: u64,
    run: u32,
    needed: u32,
}

/// A counter of `bits` bits.
#[derive(Debug, Clone)]
pub struct Sequence {
    mask: u64,
    bits: u32,
    last: Option<u64>,
    /// Bit k: the value `last - k` came.
    came: u64,
    suspect: Option<Suspect>,
}

impl Sequence {
    /// A counter that wraps after `bits` bits: 8 to 64, others are taken as the nearest of these.
    pub fn new(bits: u32) -> Self {
        let bits = bits.clamp(8, 64);
        Sequence { mask: u64::MAX >> (64 - bits), bits, last: None, came: 0, suspect: None }
    }

    /// The last value that was in order, unwrapped: its low bits are those of the wire.
    pub fn last(&self) -> Option<u64> {
        self.last
    }

    /// Forgets all: the next value is the first.
    pub fn reset(&mut self) {
        *self = Sequence::new(self.bits);
    }

    /// Takes the next value of the wire.
    pub fn see(&mut self, raw: u64) -> Step {
        let raw = raw & self.mask;
        let Some(last) = self.last else {
            self.begin(raw);
            return Step::First;
        };
        let delta = raw.wrapping_sub(last) & self.mask;
        if delta == 0 {
            return Step::Duplicate;
        }
        let half = (self.mask >> 1) + 1;
        let wrapped = raw < last & self.mask;
        if delta >= half || (wrapped && delta > self.plausible()) {
            return self.behind(raw, last);
        }
        self.suspect = None;
        self.came = if delta < 64 { (self.came << delta) | 1 } else { 1 };
        self.last = Some(last.wrapping_add(delta));
        if delta == 1 { Step::Next } else { Step::Gap { lost: delta - 1 } }
    }

    /// The longest gap over a wrap that is not rather a restart: 2^20 for 32 bits (2.5 minutes at 7 kHz), 4096 for 16 bits.
    fn plausible(&self) -> u64 {
        self.mask >> (self.bits - (self.bits / 2 + 4).min(self.bits))
    }

    fn begin(&mut self, raw: u64) {
        self.last = Some(raw);
        self.came = 1;
        self.suspect = None;
    }

    fn behind(&mut self, raw: u64, last: u64) -> Step {
        let back = last.wrapping_sub(raw) & self.mask;
        let near = back < WINDOW;
        if near && self.came & (1 << back) == 0 {
            // It fills a gap: late, and nothing else.
            self.came |= 1 << back;
            return Step::OutOfOrder;
        }
        let rises = |from: u64| {
            let rise = raw.wrapping_sub(from) & self.mask;
            rise > 0 && rise <= self.plausible()
        };
        let suspect = match self.suspect {
            Some(suspect) if rises(suspect.value) => Suspect { value: raw, run: suspect.run + 1, ..suspect },
            _ => Suspect { value: raw, run: 1, needed: if !near || raw <= 1 { 2 } else { REPLAYED_MIN } },
        };
        if suspect.run >= suspect.needed {
            self.begin(raw);
            return Step::Restart;
        }
        self.suspect = Some(suspect);
        Step::OutOfOrder
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(bits: u32, raw: &[u64], wanted: &[Step]) -> Sequence {
        let mut sequence = Sequence::new(bits);
        let seen: Vec<Step> = raw.iter().map(|&value| sequence.see(value)).collect();
        assert_eq!(seen, wanted, "{raw:?}");
        sequence
    }

    use Step::{Duplicate, First, Gap, Next, OutOfOrder, Restart};

    #[test]
    fn duplicates_and_gaps_are_told_apart() {
        check(32, &[1, 2, 2, 3, 7, 8], &[First, Next, Duplicate, Next, Gap { lost: 3 }, Next]);
    }

    #[test]
    fn a_late_one_does_not_move_the_last() {
        // A driver that moves it counts the next one as lost again; one that compares unsigned loses 2^32.
        check(32, &[1, 2, 5, 3, 4, 6], &[First, Next, Gap { lost: 2 }, OutOfOrder, OutOfOrder, Next]);
        check(32, &[10, 12, 11, 13], &[First, Gap { lost: 1 }, OutOfOrder, Next]);
    }

    #[test]
    fn every_width_wraps() {
        for bits in [8, 16, 24, 32, 40, 64] {
            let top = u64::MAX >> (64 - bits);
            let sequence = check(bits, &[top - 1, top, 0, 2], &[First, Next, Next, Gap { lost: 1 }]);
            let low = sequence.last().map(|last| last & top);
            assert_eq!(low, Some(2), "the low bits are those of the wire");
            if bits < 64 {
                assert_eq!(sequence.last(), Some(top + 3));
            }
        }
        check(32, &[0xffff_fffe, 1, 0xffff_ffff, 2], &[First, Gap { lost: 2 }, OutOfOrder, Next]);
    }

    #[test]
    fn a_restart_is_believed_at_the_second_value() {
        check(32, &[5000, 1, 2, 3], &[First, OutOfOrder, Restart, Next]);
        // The first of the new ones is lost.
        check(32, &[5000, 2, 4, 5], &[First, OutOfOrder, Restart, Next]);
        // A short session: 1 was seen before, so that it is no late packet.
        check(32, &[1, 2, 3, 1, 2, 3], &[First, Next, Next, OutOfOrder, Restart, Next]);
        // From high up it looks like a gap over the wrap.
        check(32, &[0xf000_0000, 1, 8], &[First, OutOfOrder, Restart]);
        check(16, &[60_000, 1, 2], &[First, OutOfOrder, Restart]);
    }

    #[test]
    fn one_stray_packet_or_a_burst_of_duplicates_is_no_restart() {
        check(32, &[5000, 1, 5001, 2, 5002], &[First, OutOfOrder, Next, OutOfOrder, Next]);
        check(
            32,
            &[100, 101, 102, 103, 101, 102, 103, 104],
            &[First, Next, Next, Next, OutOfOrder, OutOfOrder, Duplicate, Next],
        );
    }

    #[test]
    fn a_long_replay_is_a_restart() {
        let mut sequence = Sequence::new(32);
        (100..160).for_each(|value| {
            sequence.see(value);
        });
        let replay: Vec<Step> = (120..130).map(|value| sequence.see(value)).collect();
        assert_eq!(replay.iter().position(|step| *step == Restart), Some(7));
        assert_eq!(sequence.last(), Some(129));
    }

    #[test]
    fn a_reset_begins_anew() {
        let mut sequence = Sequence::new(16);
        sequence.see(9);
        sequence.reset();
        assert_eq!(sequence.see(3), First);
        assert_eq!(sequence.last(), Some(3));
    }
}
