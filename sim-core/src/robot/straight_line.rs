//! A position-controlled robot that moves in a straight line from one command to the next.
//!
//! It reaches a command when it takes effect, and is already moving when a run starts. It rounds each corner over one loop
//! period T: `a(t) = (v̄(t) - v̄(t - T)) / T`, with v̄ the mean velocity over the last two sensor periods.
//!
//! The averaging over two sensor periods was found from free-flight recordings with a known extra tool mass, where it leaves
//! 0.0855 N of a noise of 0.0853 N; the instantaneous velocity leaves 0.228 N.
//!
//! Not modelled: bandwidth, resonance, saturation. These are effects.

use super::Robot;
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

/// The commands that still matter, as a ring of knots.
#[derive(Debug, Clone)]
pub struct StraightLineState<S: Space> {
    due_s: [f64; KNOTS],
    motion: [S::Motion; KNOTS],
    /// How many knots were ever put in.
    count: usize,
    /// The segment that held the last time asked for: it runs from knot `cursor` to the next one.
    cursor: usize,
}

impl<S: Space> StraightLineState<S> {
    fn at(&self, knot: usize) -> (f64, &S::Motion) {
        (self.due_s[knot % KNOTS], &self.motion[knot % KNOTS])
    }

    fn oldest(&self) -> usize {
        self.count.saturating_sub(KNOTS)
    }

    /// The knot at or before `time_s`, searched from `near`.
    fn segment(&self, time_s: f64, near: usize) -> usize {
        let mut knot = near.clamp(self.oldest(), self.count - 1);
        while knot + 1 < self.count && self.due_s[(knot + 1) % KNOTS] < time_s {
            knot += 1;
        }
        while knot > self.oldest() && self.due_s[knot % KNOTS] >= time_s {
            knot -= 1;
        }
        knot
    }

    /// The pose at `time_s`; a corner belongs to the line that ends there.
    fn pose(&self, time_s: f64, near: usize) -> S::Motion {
        let knot = self.segment(time_s, near);
        let (from_s, from) = self.at(knot);
        if knot + 1 == self.count || time_s < from_s {
            // Beyond the newest command it holds; before the oldest it comes in along the first line.
            let outside_s = if time_s < from_s { time_s - from_s } else { 0.0 };
            return from.coasted(outside_s);
        }
        let (to_s, to) = self.at(knot + 1);
        S::Motion::on_line(from, to, (time_s - from_s) / (to_s - from_s), to_s - from_s)
    }
}

impl<S: Space> Robot<S> for StraightLine {
    type State = StraightLineState<S>;

    fn start(&self, first: &S::Motion, due_s: f64) -> StraightLineState<S> {
        StraightLineState { due_s: [due_s; KNOTS], motion: [*first; KNOTS], count: 1, cursor: 0 }
    }

    fn accept(&self, state: &mut StraightLineState<S>, due_s: f64, command: &S::Motion) {
        let slot = state.count % KNOTS;
        let newest_s = state.due_s[(state.count + KNOTS - 1) % KNOTS];
        // Packets never overtake: one that is late by less than its predecessor waits for it.
        state.due_s[slot] = due_s.max(newest_s + 1e-9);
        state.motion[slot] = *command;
        state.count += 1;
    }

    fn motion(&self, state: &mut StraightLineState<S>, now_s: f64) -> S::Motion {
        state.cursor = state.segment(now_s, state.cursor);
        let near = state.cursor;
        let now = state.pose(now_s, near);
        let mean = |end: &S::Motion, end_s: f64| {
            S::Motion::on_line(&state.pose(end_s - self.averaging_s, near), end, 1.0, self.averaging_s)
        };
        let before_s = now_s - self.corner_s;
        let before = state.pose(before_s, near);
        now.with_acceleration(&mean(&now, now_s), &mean(&before, before_s), self.corner_s)
    }
}
