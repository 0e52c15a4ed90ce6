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
use alloc::vec::Vec;

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

/// How many times a step asks for: now, one averaging ago, one corner ago, both ago.
const TIMES: usize = 4;

/// A command, and the line that leads on from it once its end is known.
#[derive(Debug, Clone, Copy)]
struct Knot<S: Space> {
    due_s: f64,
    motion: S::Motion,
    duration_s: f64,
    line: <S::Motion as Path>::Line,
}

/// The commands that still matter, as a ring of knots, and the line that each time of a step is on: times only grow, so that
/// most steps find it here.
#[derive(Debug, Clone)]
pub struct StraightLineState<S: Space> {
    /// Grows to KNOTS, never beyond.
    ring: Vec<Knot<S>>,
    /// How many knots were ever put in.
    count: usize,
    cursors: [Cursor<S>; TIMES],
}

/// The line that a time is on.
#[derive(Debug, Clone, Copy)]
struct Cursor<S: Space> {
    from_s: f64,
    duration_s: f64,
    until_s: f64,
    line: <S::Motion as Path>::Line,
    /// The knot from which the line leads on.
    knot: usize,
}

impl<S: Space> StraightLineState<S> {
    /// Finds the line that the time at place `i` is on. A corner belongs to the line that ends there. Beyond the newest command
    /// that one is held; before the oldest the robot came in along its velocity: such a line is good for this time alone.
    fn find(&mut self, i: usize, time_s: f64) {
        let mut knot = self.cursors[i].knot.max(self.count.saturating_sub(KNOTS));
        while knot + 1 < self.count && self.ring[(knot + 1) % KNOTS].due_s < time_s {
            knot += 1;
        }
        let at = &self.ring[knot % KNOTS];
        self.cursors[i] = if knot + 1 == self.count || time_s < at.due_s {
            let line = S::Motion::held(&at.motion.coasted((time_s - at.due_s).min(0.0)));
            Cursor { from_s: time_s, duration_s: 1.0, until_s: f64::NEG_INFINITY, line, knot }
        } else {
            let until_s = self.ring[(knot + 1) % KNOTS].due_s;
            Cursor { from_s: at.due_s, duration_s: at.duration_s, until_s, line: at.line, knot }
        };
    }

    /// The line that the time at place `i` is on, and the share of it.
    #[inline]
    fn on(&mut self, i: usize, time_s: f64) -> (&<S::Motion as Path>::Line, f64) {
        if time_s > self.cursors[i].until_s {
            self.find(i, time_s);
        }
        let at = &self.cursors[i];
        (&at.line, (time_s - at.from_s) / at.duration_s)
    }

    #[inline]
    fn place(&mut self, i: usize, time_s: f64) -> <S::Motion as Path>::Place {
        let (line, share) = self.on(i, time_s);
        S::Motion::place_on(line, share)
    }
}

impl<S: Space> Robot<S> for StraightLine {
    type State = StraightLineState<S>;

    fn start(&self, first: &S::Motion, due_s: f64) -> StraightLineState<S> {
        let line = S::Motion::held(first);
        let cursor = Cursor { from_s: due_s, duration_s: 1.0, until_s: f64::NEG_INFINITY, line, knot: 0 };
        let knot = Knot { due_s, motion: *first, duration_s: 0.0, line };
        let mut ring = Vec::with_capacity(KNOTS);
        ring.push(knot);
        StraightLineState { ring, count: 1, cursors: [cursor; TIMES] }
    }

    #[inline]
    fn accept(&self, state: &mut StraightLineState<S>, due_s: f64, command: &S::Motion) {
        let newest = &mut state.ring[(state.count + KNOTS - 1) % KNOTS];
        // Packets never overtake: one that is late by less than its predecessor waits for it.
        let due_s = due_s.max(newest.due_s + 1e-9);
        newest.duration_s = due_s - newest.due_s;
        newest.line = S::Motion::line(&newest.motion, command, newest.duration_s);
        if state.count < KNOTS {
            state.ring.push(Knot { due_s, motion: *command, duration_s: 0.0, line: S::Motion::held(command) });
        } else {
            let next = &mut state.ring[state.count % KNOTS];
            (next.due_s, next.motion) = (due_s, *command);
        }
        state.count += 1;
    }

    #[inline(always)]
    fn motion(&self, state: &mut StraightLineState<S>, now_s: f64) -> S::Motion {
        let before_s = now_s - self.corner_s;
        let now = Robot::<S>::pose(self, state, now_s);
        let mean_now = (now.place() - state.place(1, now_s - self.averaging_s)) / self.averaging_s;
        let before = state.place(2, before_s);
        let mean_before = (before - state.place(3, before_s - self.averaging_s)) / self.averaging_s;
        now.accelerated((mean_now - mean_before) / self.corner_s)
    }

    #[inline(always)]
    fn pose(&self, state: &mut StraightLineState<S>, now_s: f64) -> S::Motion {
        let (line, share) = state.on(0, now_s);
        S::Motion::on(line, share)
    }

    fn check(&self) -> Result<(), Refusal> {
        positive("corner_s", self.corner_s, "s")?;
        positive("averaging_s", self.averaging_s, "s")?;
        Ok(())
    }
}
