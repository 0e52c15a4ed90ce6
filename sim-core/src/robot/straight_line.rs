//! A position-controlled robot that moves in a straight line from one command to the next.
//!
//! It reaches a command when it takes effect, and is already moving when a run starts. It rounds each corner over one loop
//! period T: `a(t) = (v̄(t) - v̄(t - T)) / T`, with v̄ the mean velocity over the last two sensor periods.
//!
//! The averaging over two sensor periods was found from free-flight recordings with a known extra tool mass, where it leaves
//! 0.0855 N of a noise of 0.0853 N; the instantaneous velocity leaves 0.228 N.
//!
//! A line is worked out once, when its end is accepted; a step only asks how far along it the time is.
//!
//! Not modelled: bandwidth, resonance, saturation. These are effects.

use super::Robot;
use crate::refusal::{Refusal, positive};
use crate::space::{Path, Space};

/// How many commands it remembers: enough for 200 ms of dead time at 4 ms.
const KNOTS: usize = 64;

/// Straight lines between commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StraightLine {
    /// Period over which a corner is rounded.
    pub corner_s: f64,
    /// Over how long the velocity behind the acceleration is averaged.
    pub averaging_s: f64,
}

/// A command and the line that leads on from it.
#[derive(Debug, Clone, Copy)]
struct Knot<S: Space> {
    due_s: f64,
    /// How long the line takes; unknown until its end is accepted.
    duration_s: f64,
    line: <S::Motion as Path>::Line,
    motion: S::Motion,
}

/// The commands that still matter, as a ring of knots.
#[derive(Debug, Clone)]
pub struct StraightLineState<S: Space> {
    ring: [Knot<S>; KNOTS],
    /// How many knots were ever put in.
    count: usize,
    /// For each time asked for in a step, the knot at or before it: now, one averaging ago, one corner ago, both ago.
    cursors: [usize; 4],
}

/// Where on the path a time is.
enum Spot<'a, S: Space> {
    /// On a line, at this share of it.
    On(&'a <S::Motion as Path>::Line, f64),
    /// On no line: the newest command is held, the oldest one came in along its own velocity.
    Beyond(S::Motion),
}

impl<S: Space> StraightLineState<S> {
    /// Where `time_s` is. A corner belongs to the line that ends there; times only grow from call to call with one `cursor`.
    #[inline]
    fn spot(&mut self, cursor: usize, time_s: f64) -> Spot<'_, S> {
        let mut knot = self.cursors[cursor].max(self.count.saturating_sub(KNOTS));
        while knot + 1 < self.count && self.ring[(knot + 1) % KNOTS].due_s < time_s {
            knot += 1;
        }
        self.cursors[cursor] = knot;
        let at = &self.ring[knot % KNOTS];
        if knot + 1 == self.count || time_s < at.due_s {
            let outside_s = if time_s < at.due_s { time_s - at.due_s } else { 0.0 };
            return Spot::Beyond(at.motion.coasted(outside_s));
        }
        Spot::On(&at.line, (time_s - at.due_s) / at.duration_s)
    }

    #[inline]
    fn pose(&mut self, cursor: usize, time_s: f64) -> S::Motion {
        match self.spot(cursor, time_s) {
            Spot::On(line, share) => S::Motion::on(line, share),
            Spot::Beyond(motion) => motion,
        }
    }

    #[inline]
    fn place(&mut self, cursor: usize, time_s: f64) -> <S::Motion as Path>::Place {
        match self.spot(cursor, time_s) {
            Spot::On(line, share) => S::Motion::place_on(line, share),
            Spot::Beyond(motion) => motion.place(),
        }
    }
}

impl<S: Space> Robot<S> for StraightLine {
    type State = StraightLineState<S>;

    fn start(&self, first: &S::Motion, due_s: f64) -> StraightLineState<S> {
        let knot = Knot { due_s, duration_s: 0.0, line: Default::default(), motion: *first };
        StraightLineState { ring: [knot; KNOTS], count: 1, cursors: [0; 4] }
    }

    #[inline]
    fn accept(&self, state: &mut StraightLineState<S>, due_s: f64, command: &S::Motion) {
        let newest = &mut state.ring[(state.count + KNOTS - 1) % KNOTS];
        // Packets never overtake: one that is late by less than its predecessor waits for it.
        let due_s = due_s.max(newest.due_s + 1e-9);
        newest.duration_s = due_s - newest.due_s;
        newest.line = S::Motion::line(&newest.motion, command, newest.duration_s);
        let next = &mut state.ring[state.count % KNOTS];
        (next.due_s, next.motion) = (due_s, *command);
        state.count += 1;
    }

    #[inline]
    fn motion(&self, state: &mut StraightLineState<S>, now_s: f64) -> S::Motion {
        let before_s = now_s - self.corner_s;
        let now = state.pose(0, now_s);
        let mean_now = (now.place() - state.place(1, now_s - self.averaging_s)) / self.averaging_s;
        let before = state.place(2, before_s);
        let mean_before = (before - state.place(3, before_s - self.averaging_s)) / self.averaging_s;
        now.accelerated((mean_now - mean_before) / self.corner_s)
    }

    #[inline]
    fn pose(&self, state: &mut StraightLineState<S>, now_s: f64) -> S::Motion {
        state.pose(0, now_s)
    }

    fn check(&self) -> Result<(), Refusal> {
        positive("corner_s", self.corner_s, "s")?;
        positive("averaging_s", self.averaging_s, "s")?;
        Ok(())
    }
}
