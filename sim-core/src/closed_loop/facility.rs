//! The facility's half of the loop, stepped by somebody outside: link, robot, read-out, contact, sensor, effects, noise.
//!
//! The satellites and their compensator are not asked: at each tick of the loop the facility reports the pose and the readings,
//! and is then told a command. The same code runs as in a closed loop, in the same order but for one thing: the command of a
//! tick comes after the report of that tick, because whoever answers has seen it. A command takes effect a loop period later at
//! the earliest, so that the bits are the same.
//!
//! Not there: clamps; an effect that looks at the command of the running tick.

use super::run::Run;
use super::{Clamps, ClosedLoop, Start};
use crate::rig::Rig;
use crate::space::Space;
use crate::time::{Clock, Nanos, Step};
use crate::trace::{Columns, Trace};

/// What the facility says at a tick of the loop.
#[derive(Debug, Clone, Copy)]
pub struct Reported<'f, S: Space> {
    /// Time of the tick.
    pub now: Nanos,
    /// The pose that the robot controller has at hand.
    pub measured: S::Motion,
    /// Time of each reading since the tick before, this tick's own included.
    pub sensor_time: &'f [Nanos],
    /// The readings.
    pub sensed: &'f [S::Wrench],
    /// What the interface felt then: the truth that nobody is told.
    pub interface: &'f [S::Wrench],
    /// How deep the interfaces were then: also the truth.
    pub touch: &'f [S::Touch],
}

/// A facility whose parts need not be named.
pub trait Stepped<S: Space> {
    /// Goes on to the next tick of the loop. Without a command since the last one, that one is given again.
    fn report(&mut self) -> Reported<'_, S>;
    /// The command of the tick that was reported last. The very first one is the motion with which the run starts, whatever is
    /// given here: the robot is there already.
    fn command(&mut self, motion: S::Motion);
}

/// See the module.
pub struct Facility<'a, S: Space, R: Rig<S>> {
    run: Run<'a, S, R, true, false>,
    loop_clock: Clock,
    sensor_clock: Clock,
    physics_step: Nanos,
    loop_period: Nanos,
    first: S::Motion,
    next: Step,
    tick: Nanos,
    /// Whether a tick was reported that has no command yet.
    waits: bool,
    trace: Trace<S>,
}

impl<'a, S: Space, R: Rig<S>> Facility<'a, S, R> {
    /// The facility of this loop, at its beginning. [`Start::until`] counts nothing.
    pub fn new(of: &'a ClosedLoop<'a, S, R>, start: &'a Start<S>) -> Self {
        let rates = of.rates;
        let columns = Columns { loop_ticks: false, ..Columns::LOG };
        let mut trace = Trace::default();
        // Twice what a tick holds: then no step allocates.
        let samples = rates.loop_period.0 / rates.sensor_period.0.max(1);
        trace.reserve(columns, 0, 2 * samples as usize + 2, 0);
        Facility {
            run: Run::new(of, start, &Clamps::<S>::NONE, columns),
            loop_clock: Clock::new(rates.loop_period, rates.loop_phase, start.from),
            sensor_clock: Clock::new(rates.sensor_period, rates.sensor_phase, start.from),
            physics_step: rates.physics_step,
            loop_period: rates.loop_period,
            first: start.first,
            next: Step { index: 0, now: start.from, dt: rates.physics_step },
            tick: start.from,
            waits: false,
            trace,
        }
    }

    /// One physics step; whether it was a tick of the loop.
    fn step(&mut self) -> bool {
        let step = self.next;
        let (loop_ticks, sensor_ticks) = (self.loop_clock.ticks(step.now), self.sensor_clock.ticks(step.now));
        if loop_ticks && self.run.loop_index == 0 {
            let first = self.first;
            self.run.issue(Step { index: 0, now: step.now, dt: self.loop_period }, first);
        }
        let achieved = self.run.feel(step.index as usize, step, loop_ticks, sensor_ticks, &mut self.trace);
        self.run.keep(&achieved, &mut self.trace);
        self.next = Step { index: step.index + 1, now: step.now + self.physics_step, ..step };
        if loop_ticks {
            self.tick = step.now;
        }
        loop_ticks
    }
}

impl<S: Space, R: Rig<S>> Stepped<S> for Facility<'_, S, R> {
    fn report(&mut self) -> Reported<'_, S> {
        if self.waits {
            self.command(self.run.signals.commanded);
        }
        self.trace.clear();
        while !self.step() {}
        self.waits = true;
        let trace = &self.trace;
        Reported {
            now: self.tick,
            measured: self.run.signals.measured,
            sensor_time: &trace.sensor_time,
            sensed: &trace.sensed,
            interface: &trace.interface,
            touch: &trace.touch,
        }
    }

    fn command(&mut self, motion: S::Motion) {
        if !self.waits {
            return;
        }
        if self.run.loop_index > 0 {
            let step = Step { index: self.run.loop_index as u64, now: self.tick, dt: self.loop_period };
            self.run.issue(step, motion);
        }
        self.run.loop_index += 1;
        self.waits = false;
    }
}
