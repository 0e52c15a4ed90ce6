//! Follows the time stamp of the controller: its step, gaps, repeats, restarts, and its wrap.
//!
//! | what comes | meaning |
//! |---|---|
//! | last + step | the next frame; the step is learned (4 or 12 on a controller, 1 on some simulators), never asserted |
//! | last + n step | n - 1 frames are missing |
//! | last + something else | irregular; three times in a row it is the new step |
//! | last | a repeat: the answer of before is due again |
//! | at most 16 steps behind | late or swapped; three in a row that advance are a restart |
//! | further behind, or more than 5 s ahead | a restart: a new session |
//!
//! A stamp of 32 bits wraps after 49.7 days: two stamps below 2^32 are compared modulo 2^32, others as they are. Source:
//! reference/PROTOCOLS.md, sections 1.6 and 1.7.

/// Furthest that a stamp may be ahead: 5 s in ms, or 5 s of 4 ms steps where a step is longer.
const AHEAD_MAX: u64 = 5000;
const AHEAD_STEPS_MAX: u64 = 1250;
/// Furthest behind, in steps, that a late frame may be.
const BEHIND_STEPS_MAX: u64 = 16;
/// Times in a row after which something new is believed.
const BELIEVED: u32 = 3;
const WRAP: u64 = 1 << 32;

/// What a stamp says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Move {
    /// The first of a session.
    First,
    /// The next frame.
    Next,
    /// Frames are missing.
    Gap { missing: u64 },
    /// It advanced by something that is no multiple of the step.
    Irregular { advance: u64, step: u64 },
    /// The same as before, so many times.
    Repeat { times: u32 },
    /// Behind the last one.
    Behind { by: u64 },
    /// A new session.
    Restart { from: u64 },
}

/// What a stamp says, and what was learned from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Seen {
    pub what: Move,
    /// It passed 2^32.
    pub wrapped: bool,
    /// The step, when it was learned or changed just now.
    pub step: Option<u64>,
    /// Frames that turn out to have been missing before: the step learned first was too long.
    pub missed_before: u64,
}

/// The stamps of one robot.
#[derive(Debug, Clone, Default)]
pub(super) struct Stamps {
    last: Option<u64>,
    unwrapped: u64,
    step: Option<u64>,
    /// Advances that were one step.
    confirmed: u32,
    other: u64,
    others: u32,
    repeats: u32,
    behind: Option<u64>,
    behinds: u32,
}

impl Stamps {
    /// Stamps of this session without the wrap.
    pub fn unwrapped(&self) -> u64 {
        self.unwrapped
    }

    /// The step, as learned so far.
    pub fn step(&self) -> Option<u64> {
        self.step
    }

    /// Takes the stamp of a frame.
    pub fn take(&mut self, stamp: u64) -> Seen {
        let quiet = |what| Seen { what, wrapped: false, step: None, missed_before: 0 };
        let Some(last) = self.last else {
            self.begin(stamp);
            return quiet(Move::First);
        };
        if stamp == last {
            self.repeats += u32::from(self.repeats < u32::MAX);
            return quiet(Move::Repeat { times: self.repeats });
        }
        self.repeats = 0;
        let (ahead, by) = apart(last, stamp);
        let step = self.step.unwrap_or(1);
        if !ahead {
            if by <= step.saturating_mul(BEHIND_STEPS_MAX) && !self.goes_on_behind(stamp) {
                return quiet(Move::Behind { by });
            }
            self.begin(stamp);
            return quiet(Move::Restart { from: last });
        }
        if by > AHEAD_MAX.max(step.saturating_mul(AHEAD_STEPS_MAX)) {
            self.begin(stamp);
            return quiet(Move::Restart { from: last });
        }
        (self.behind, self.behinds) = (None, 0);
        self.last = Some(stamp);
        self.unwrapped = self.unwrapped.saturating_add(by);
        Seen { wrapped: stamp < last, ..self.advance(by) }
    }

    fn begin(&mut self, stamp: u64) {
        *self = Stamps { last: Some(stamp), unwrapped: stamp, ..Stamps::default() };
    }

    /// Whether the stamps behind the last one have become a sequence of their own.
    fn goes_on_behind(&mut self, stamp: u64) -> bool {
        let goes_on = self.behind.is_some_and(|before| before < stamp);
        self.behinds = if goes_on { self.behinds + 1 } else { 1 };
        self.behind = Some(stamp);
        self.behinds >= BELIEVED
    }

    /// It advanced by this much.
    fn advance(&mut self, by: u64) -> Seen {
        let seen = |what| Seen { what, wrapped: false, step: None, missed_before: 0 };
        let Some(step) = self.step else {
            self.step = Some(by);
            return Seen { step: Some(by), ..seen(Move::Next) };
        };
        if by == step {
            self.confirmed += u32::from(self.confirmed < BELIEVED);
            self.others = 0;
            return seen(Move::Next);
        }
        if self.confirmed < BELIEVED && by < step {
            // What was taken for the step was a gap.
            let before =
                if step.is_multiple_of(by) { (step / by - 1).saturating_mul(u64::from(self.confirmed) + 1) } else { 0 };
            (self.step, self.confirmed, self.others) = (Some(by), 0, 0);
            return Seen { step: Some(by), missed_before: before, ..seen(Move::Next) };
        }
        self.others = if self.other == by { self.others + 1 } else { 1 };
        self.other = by;
        let what = if by.is_multiple_of(step) {
            Move::Gap { missing: by / step - 1 }
        } else {
            Move::Irregular { advance: by, step }
        };
        if self.others < BELIEVED {
            return seen(what);
        }
        (self.step, self.confirmed, self.others) = (Some(by), BELIEVED, 0);
        Seen { step: Some(by), ..seen(what) }
    }
}

/// Whether `stamp` is ahead of `last`, and by how much.
fn apart(last: u64, stamp: u64) -> (bool, u64) {
    if last < WRAP && stamp < WRAP {
        let ahead = (stamp + WRAP - last) % WRAP;
        return if ahead < WRAP / 2 { (true, ahead) } else { (false, WRAP - ahead) };
    }
    (stamp > last, stamp.abs_diff(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What each stamp after the first says.
    fn said(stamps: &[u64]) -> Vec<Move> {
        let mut all = Stamps::default();
        stamps.iter().map(|stamp| all.take(*stamp).what).skip(1).collect()
    }

    #[test]
    fn the_step_is_learned() {
        for step in [1, 4, 12, 4000] {
            let mut stamps = Stamps::default();
            for i in 0..10 {
                let seen = stamps.take(680_309_708 + i * step);
                assert_eq!(seen.step, (i == 1).then_some(step));
                assert_eq!(seen.what, if i == 0 { Move::First } else { Move::Next });
            }
            assert_eq!(stamps.unwrapped(), 680_309_708 + 9 * step);
        }
    }

    #[test]
    fn a_gap_at_the_very_beginning_is_found_later() {
        let mut stamps = Stamps::default();
        stamps.take(100);
        assert_eq!(stamps.take(112).step, Some(12));
        let seen = stamps.take(116);
        assert_eq!((seen.what, seen.step, seen.missed_before), (Move::Next, Some(4), 2));
        assert_eq!(stamps.step(), Some(4));
    }

    #[test]
    fn gaps_repeats_and_swaps_have_names() {
        use Move::{Behind, Gap, Irregular, Next, Repeat};
        assert_eq!(said(&[0, 4, 8, 20, 24]), [Next, Next, Gap { missing: 2 }, Next]);
        assert_eq!(said(&[0, 4, 8, 8, 8, 12]), [Next, Next, Repeat { times: 1 }, Repeat { times: 2 }, Next]);
        assert_eq!(said(&[0, 4, 12, 8, 16]), [Next, Gap { missing: 1 }, Behind { by: 4 }, Next]);
        assert_eq!(said(&[0, 4, 8, 13, 17]), [Next, Next, Irregular { advance: 5, step: 4 }, Next]);
    }

    #[test]
    fn another_step_is_believed_after_three() {
        let mut stamps = Stamps::default();
        let seen: Vec<Seen> = [0, 4, 8, 12, 16, 28, 40, 52, 64].map(|stamp| stamps.take(stamp)).to_vec();
        assert_eq!(seen[5].what, Move::Gap { missing: 2 });
        assert_eq!(seen[7].step, Some(12));
        assert_eq!(seen[8].what, Move::Next);
    }

    #[test]
    fn a_jump_is_a_new_session() {
        use Move::{Behind, First, Next, Restart};
        assert_eq!(said(&[0, 4, 5005]), [Next, Restart { from: 4 }]);
        assert_eq!(said(&[9000, 9004, 4, 8]), [Next, Restart { from: 9004 }, Next]);
        // A short way back is late first; the third that goes on from there is a restart.
        let back = [100, 104, 108, 112, 92, 96, 100, 104];
        let by = |by| Behind { by };
        assert_eq!(said(&back), [Next, Next, Next, by(20), by(16), Restart { from: 112 }, Next]);
        assert_eq!(Stamps::default().take(7).what, First);
    }

    #[test]
    fn thirty_two_bits_wrap_and_more_do_not() {
        let top = WRAP - 4;
        let mut stamps = Stamps::default();
        stamps.take(top - 4);
        assert!(!stamps.take(top).wrapped);
        let seen = stamps.take(0);
        assert_eq!((seen.what, seen.wrapped), (Move::Next, true));
        assert_eq!(stamps.unwrapped(), WRAP);
        // A gap over the wrap.
        assert_eq!(said(&[top - 8, top - 4, 4]), [Move::Next, Move::Gap { missing: 2 }]);
        // A stamp that has more bits goes on.
        let mut stamps = Stamps::default();
        stamps.take(top - 4);
        stamps.take(top);
        let seen = stamps.take(WRAP);
        assert_eq!((seen.what, seen.wrapped), (Move::Next, false));
        assert_eq!(said(&[123_645_634_563, 123_645_634_567]), [Move::Next]);
        // Far below the wrap it is a restart, however near to 2^32 the last one was.
        assert_eq!(said(&[4_211_158_252, 4_211_158_256, 1000]), [Move::Next, Move::Restart { from: 4_211_158_256 }]);
        // The ends of the range.
        assert_eq!(said(&[u64::MAX, 0, u64::MAX]), [Move::Restart { from: u64::MAX }, Move::Restart { from: 0 }]);
    }
}
