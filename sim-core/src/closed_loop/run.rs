//! One run: the state of every part, and what happens at a physics step.

use super::history::History;
use super::memories::Memories;
use super::{Clamps, ClosedLoop, Start};
use crate::compensator::{Compensator, Heard};
use crate::contact::ContactLaw;
use crate::effect::Reads;
use crate::force_sensor::{ForceSensor, Noisy};
use crate::geometry::Geometry;
use crate::plant::Plant;
use crate::rig::Rig;
use crate::rng::Stream;
use crate::robot::Robot;
use crate::signals::{Received, Signals};
use crate::space::{Path, Space};
use crate::time::{Clock, Nanos, Step};
use crate::trace::{Columns, Trace};

/// Everything that changes while a loop runs. Without `EFFECTS` nobody can look at a wire between the ticks of its readers;
/// without `CLAMPED` no wire is clamped, and no column wants every physics step.
pub(super) struct Run<'a, S: Space, R: Rig<S>, const EFFECTS: bool, const CLAMPED: bool> {
    of: &'a ClosedLoop<'a, S, R>,
    start: &'a Start<S>,
    clamps: &'a Clamps<'a, S>,
    columns: Columns,
    /// Whether anything reads the robot's acceleration.
    accelerated: bool,
    /// Whether effects look at the achieved motion.
    seen: bool,
    /// Whether the read-back is looked at between the ticks of the loop.
    watched: bool,
    silent: bool,
    pub(super) signals: Signals<S>,
    memories: Memories,
    satellites: <R::Plant as Plant<S>>::State,
    robot: <R::Robot as Robot<S>>::State,
    history: History<S>,
    compensator: <R::Compensator as Compensator<S>>::State,
    noise_random: Stream,
    slow: <S::Wrench as Noisy>::Slow,
    sample: Option<S::Wrench>,
    pub(super) loop_index: usize,
    sensor_index: usize,
}

impl<'a, S: Space, R: Rig<S>, const EFFECTS: bool, const CLAMPED: bool> Run<'a, S, R, EFFECTS, CLAMPED> {
    pub fn new(of: &'a ClosedLoop<'a, S, R>, start: &'a Start<S>, clamps: &'a Clamps<'a, S>, columns: Columns) -> Self {
        let (rig, rates) = (of.rig, &of.rates);
        let signals = first_signals(rig, start, clamps);
        let first_due_s = rig.link().due_s(rates.loop_phase, &signals.received);
        let reads = of.effects.iter().map(|attached| attached.effect.reads()).max().unwrap_or(Reads::Loads);
        let accelerated = columns.achieved
            || columns.measured
            || reads == Reads::Accelerations
            || rig.sensor().reads_acceleration()
            || rig.compensator().reads_acceleration();
        Run {
            of,
            start,
            clamps,
            columns,
            accelerated,
            seen: reads != Reads::Loads || !of.on[1].is_empty(),
            watched: columns.measured || reads != Reads::Loads || !of.on[2].is_empty(),
            silent: S::Wrench::silent(&start.noise),
            memories: Memories::new(of.effects, rates, start, &signals),
            satellites: rig.plant().start(&start.first),
            robot: rig.robot().start(&signals.received.motion, first_due_s),
            history: History::new(rig.readout().delay_s, rates.physics_step),
            compensator: rig.compensator().start(&signals.measured, rates.loop_period.seconds()),
            noise_random: start.streams.named("sensor/noise"),
            slow: Default::default(),
            sample: None,
            loop_index: 0,
            sensor_index: 0,
            signals,
        }
    }

    /// Every physics step, from first to last.
    pub fn steps(&mut self, trace: &mut Trace<S>) {
        let (start, rates) = (self.start, &self.of.rates);
        let mut loop_clock = Clock::new(rates.loop_period, rates.loop_phase, start.from);
        let mut sensor_clock = Clock::new(rates.sensor_period, rates.sensor_phase, start.from);
        let steps = (start.until - start.from).0 / rates.physics_step.0;
        let mut now = start.from;
        for index in 0..steps as usize {
            let step = Step { index: index as u64, now, dt: rates.physics_step };
            let (loop_ticks, sensor_ticks) = (loop_clock.ticks(now), sensor_clock.ticks(now));
            if loop_ticks {
                self.command(now);
            }
            let achieved = self.feel(index, step, loop_ticks, sensor_ticks, trace);
            if loop_ticks {
                self.feed_back(now, trace);
            }
            self.keep(&achieved, trace);
            now = now + rates.physics_step;
        }
    }

    /// The robot moves, its pose is read back, the interfaces touch, the sensor reads.
    #[inline(always)]
    pub fn feel(
        &mut self,
        index: usize,
        step: Step,
        loop_ticks: bool,
        sensor_ticks: bool,
        trace: &mut Trace<S>,
    ) -> S::Motion {
        let achieved = self.follow(index, step);
        self.read_back(index, step, &achieved, loop_ticks);
        if EFFECTS || loop_ticks || sensor_ticks {
            self.touch(step, &achieved);
        }
        if sensor_ticks {
            self.sense(step.now, trace);
        }
        achieved
    }

    /// The read-back remembers the pose.
    #[inline(always)]
    pub fn keep(&mut self, achieved: &S::Motion, trace: &mut Trace<S>) {
        if self.reads_back() {
            // Last in the step: copied as a whole right after it was put together, it would stall the processor.
            self.history.push(achieved);
        }
        if CLAMPED && self.columns.achieved {
            trace.achieved.push(self.signals.achieved);
        }
        if CLAMPED && self.columns.measured {
            trace.measured_steps.push(self.signals.measured);
        }
    }

    /// The satellites issue their position, and the robot receives it.
    #[inline(always)]
    fn command(&mut self, now: Nanos) {
        let rig = self.of.rig;
        let step = Step { index: self.loop_index as u64, now, dt: self.of.rates.loop_period };
        let commanded = match self.clamps.commanded {
            Some(recorded) if CLAMPED => recorded[self.loop_index.min(recorded.len() - 1)],
            _ => rig.compensator().command(&mut self.compensator, step, rig.plant().motion(&self.satellites)),
        };
        self.issue(step, commanded);
    }

    /// The robot receives this command.
    #[inline(always)]
    pub fn issue(&mut self, step: Step, commanded: S::Motion) {
        let rig = self.of.rig;
        self.signals.commanded = commanded;
        let mut fresh = rig.link().receive::<S>(&self.signals.commanded);
        if EFFECTS {
            let seen = &self.signals;
            self.memories.each(self.of.effects, &self.of.on[0], step, |effect, context| {
                effect.received(context, seen, &mut fresh);
            });
        }
        self.signals.received = fresh;
        let due_s = rig.link().due_s(step.now, &fresh);
        if self.loop_index == 0 {
            self.robot = rig.robot().start(&fresh.motion, due_s);
        } else {
            rig.robot().accept(&mut self.robot, due_s, &fresh.motion);
        }
    }

    /// The robot moves. Values that go on in the same step are handed on as values: read back from where they were just stored
    /// in smaller pieces, they would stall the processor.
    #[inline(always)]
    fn follow(&mut self, index: usize, step: Step) -> S::Motion {
        if CLAMPED && let Some(recorded) = self.clamps.achieved {
            self.signals.achieved = recorded[index];
            return recorded[index];
        }
        let robot = self.of.rig.robot();
        let now_s = step.now.seconds();
        let achieved =
            if self.accelerated { robot.motion(&mut self.robot, now_s) } else { robot.pose(&mut self.robot, now_s) };
        if CLAMPED || (EFFECTS && self.seen) {
            self.signals.achieved = achieved;
        }
        if !EFFECTS || self.of.on[1].is_empty() {
            return achieved;
        }
        let mut out = achieved;
        self.memories.each(self.of.effects, &self.of.on[1], step, |effect, context| {
            effect.achieved(context, &self.signals, &mut out);
            self.signals.achieved = out;
        });
        out
    }

    /// Whether the read-back has a reader in this run.
    #[inline(always)]
    fn reads_back(&self) -> bool {
        !CLAMPED
            || (self.clamps.measured.is_none()
                && (self.clamps.achieved.is_none() || self.columns.loop_ticks || self.columns.measured))
    }

    /// The pose is read back.
    #[inline(always)]
    fn read_back(&mut self, index: usize, step: Step, achieved: &S::Motion, loop_ticks: bool) {
        if index == 0 {
            // Only now is it known what the effects make of the first pose.
            self.history.fill(achieved);
        }
        if CLAMPED && let Some(recorded) = self.clamps.measured {
            self.signals.measured = recorded[index];
            return;
        }
        if !self.reads_back() {
            return;
        }
        if loop_ticks || ((EFFECTS || CLAMPED) && self.watched) {
            self.signals.measured = self.history.read(achieved);
        }
        if EFFECTS && !self.of.on[2].is_empty() {
            self.memories.each(self.of.effects, &self.of.on[2], step, |effect, context| {
                let mut out = self.signals.measured;
                effect.measured(context, &self.signals, &mut out);
                self.signals.measured = out;
            });
        }
    }

    /// The interfaces touch, and the sensor feels it.
    #[inline(always)]
    fn touch(&mut self, step: Step, achieved: &S::Motion) {
        let (rig, effects, on) = (self.of.rig, self.of.effects, &self.of.on);
        let (signals, memories) = (&mut self.signals, &mut self.memories);
        let mut touch = rig.geometry().touch(achieved);
        if EFFECTS || self.columns.sensor_ticks {
            signals.touch = touch;
        }
        if EFFECTS && !on[3].is_empty() {
            let mut out = touch;
            memories.each(effects, &on[3], step, |effect, context| {
                effect.touch(context, signals, &mut out);
                signals.touch = out;
            });
            touch = out;
        }
        let mut contact = rig.law().force(&touch);
        if EFFECTS {
            signals.contact = contact;
        }
        if EFFECTS && !on[4].is_empty() {
            let mut out = contact;
            memories.each(effects, &on[4], step, |effect, context| {
                effect.contact(context, signals, &mut out);
                signals.contact = out;
            });
            contact = out;
        }
        let interface = rig.law().clamped(&touch, &contact);
        signals.interface = interface;
        let sensed = rig.sensor().reading(achieved, &interface);
        signals.sensed = sensed;
        if EFFECTS && !on[5].is_empty() {
            let mut out = sensed;
            memories.each(effects, &on[5], step, |effect, context| {
                effect.sensed(context, signals, &mut out);
                signals.sensed = out;
            });
        }
    }

    /// A tick of the sensor.
    #[inline(always)]
    fn sense(&mut self, now: Nanos, trace: &mut Trace<S>) {
        let reading = match self.clamps.sensed {
            Some(recorded) if CLAMPED => recorded[self.sensor_index.min(recorded.len() - 1)],
            _ if self.silent => self.signals.sensed,
            _ => self.signals.sensed.noisy(&self.start.noise, &mut self.slow, &mut self.noise_random),
        };
        self.sample = Some(reading);
        self.sensor_index += 1;
        if self.columns.sensor_ticks {
            trace.sensor_tick(now, &self.signals, reading);
        }
    }

    /// The net force acts on the satellites for one tick.
    #[inline(always)]
    fn feed_back(&mut self, now: Nanos, trace: &mut Trace<S>) {
        let (rig, signals) = (self.of.rig, &mut self.signals);
        let step = Step { index: self.loop_index as u64, now, dt: self.of.rates.loop_period };
        let applied = match self.clamps.applied {
            Some(all) if CLAMPED => all[self.loop_index.min(all.len() - 1)],
            _ => S::Wrench::default(),
        };
        let heard = Heard {
            sensed: self.sample.as_ref(),
            commanded: &signals.commanded,
            measured: &signals.measured,
            interface: &signals.interface,
            applied,
        };
        signals.feedback = rig.compensator().feedback(&mut self.compensator, step, heard);
        rig.plant().step(&mut self.satellites, step, &signals.feedback);
        self.loop_index += 1;
        if self.columns.loop_ticks {
            trace.loop_tick(now, signals, rig.plant().motion(&self.satellites));
        }
    }
}

/// The wires as they are when a run begins: everything has been moving along the first motion for ever.
fn first_signals<S: Space, R: Rig<S>>(rig: &R, start: &Start<S>, clamps: &Clamps<'_, S>) -> Signals<S> {
    let first = start.first;
    let achieved = match clamps.achieved {
        Some(recorded) => recorded[0],
        None => first.coasted(-rig.link().dead_time_s),
    };
    let measured = match clamps.measured {
        Some(recorded) => recorded[0],
        None => achieved.coasted(-rig.readout().delay_s),
    };
    let touch = rig.geometry().touch(&achieved);
    let contact = rig.law().force(&touch);
    let interface = rig.law().clamped(&touch, &contact);
    let sensed = rig.sensor().reading(&achieved, &interface);
    let received = Received { motion: first, late_s: 0.0, lost: false };
    let feedback = S::Wrench::default();
    Signals { commanded: first, received, achieved, measured, touch, contact, interface, sensed, feedback }
}
