//! The loop itself: parts at their own rates, effects on their wires, any wire clamped to a recording.
//!
//! Within one physics step, at time t: the satellites issue their position, the link receives it, the robot moves, the pose is
//! read back, the interfaces touch, the sensor reads; at a tick of the loop the net force then acts for one tick. A command is
//! the position *before* its tick's force.
//!
//! Replay is clamping: what enters a part is taken from a recording, so that the misfit of what leaves it belongs to that part.
//! Upstream wires that a fit does not change are computed once and clamped in the next run: that is what makes fits cheap.

use crate::compensator::{Compensator, Heard};
use crate::contact::ContactLaw;
use crate::delay;
use crate::effect::{Attached, Context, Effect, Rates};
use crate::force_sensor::{ForceSensor, SensorNoise};
use crate::geometry::Geometry;
use crate::plant::Plant;
use crate::rig::Rig;
use crate::rng::{Stream, Streams};
use crate::robot::Robot;
use crate::signals::{Received, Signals, Wire};
use crate::space::{Path, Space};
use crate::time::{Nanos, Step};
use crate::trace::{Columns, Trace};
use alloc::vec;
use alloc::vec::Vec;

/// Wires that are taken from a recording or from an earlier run instead of from their parts.
#[derive(Debug, Clone, Copy)]
pub struct Clamps<'a, S: Space> {
    /// One commanded motion for each tick of the loop.
    pub commanded: Option<&'a [S::Motion]>,
    /// One achieved motion for each physics step.
    pub achieved: Option<&'a [S::Motion]>,
    /// One measured motion for each physics step.
    pub measured: Option<&'a [S::Motion]>,
    /// One reading for each tick of the sensor.
    pub sensed: Option<&'a [S::Wrench]>,
    /// A force that drives the rig from outside, one for each tick of the loop.
    pub applied: Option<&'a [S::Wrench]>,
}

impl<S: Space> Default for Clamps<'_, S> {
    fn default() -> Self {
        Clamps { commanded: None, achieved: None, measured: None, sensed: None, applied: None }
    }
}

/// How long, from where, and with which randomness.
#[derive(Debug, Clone, Copy)]
pub struct Start<S: Space> {
    /// The satellites' motion at time zero; the robot has been following it for ever.
    pub first: S::Motion,
    /// Time of the first step: a multiple of the physics step. Anything but zero needs the achieved motion clamped.
    pub from: Nanos,
    /// Time after the last step.
    pub until: Nanos,
    /// Noise of the sensor, which the loop feels.
    pub noise: SensorNoise,
    /// Where the randomness comes from.
    pub streams: Streams,
}

/// Adds the sensor's noise to a reading; spaces say how.
pub trait Noisy: Sized {
    /// A noisy sample of this analogue reading.
    fn noisy(&self, noise: &SensorNoise, slow: &mut f64, random: &mut Stream) -> Self;
}

impl Noisy for f64 {
    fn noisy(&self, noise: &SensorNoise, slow: &mut f64, random: &mut Stream) -> f64 {
        noise.sample(*self, slow, random)
    }
}

/// A rig, its effects and its clocks.
pub struct ClosedLoop<'a, S: Space, R: Rig<S>> {
    rig: &'a R,
    effects: &'a [Attached<S>],
    rates: Rates,
    /// For each wire, the effects on it in their order.
    on: [Vec<usize>; 6],
}

/// The wires on which effects act in the loop, in the order of the loop.
const WIRES: [Wire; 6] = [Wire::Received, Wire::Achieved, Wire::Measured, Wire::Touch, Wire::Contact, Wire::Sensed];

/// What the effects remember, and their random numbers.
struct Memories {
    numbers: Vec<f64>,
    span: Vec<(usize, usize)>,
    random: Vec<Stream>,
}

impl<'a, S: Space, R: Rig<S>> ClosedLoop<'a, S, R>
where
    S::Wrench: Noisy,
{
    /// A loop of these parts. Effects on one wire act in their declared order, then by id.
    pub fn new(rig: &'a R, effects: &'a [Attached<S>], rates: Rates) -> Self {
        let step = rates.physics_step.0;
        assert!(step > 0, "the physics step is positive");
        for time in [rates.loop_period, rates.loop_phase, rates.sensor_period, rates.sensor_phase] {
            assert!(time.0 % step == 0, "the physics step {step} ns divides every period and phase");
        }
        let on = WIRES.map(|wire| {
            let mut here: Vec<usize> = (0..effects.len()).filter(|&i| effects[i].wires.contains(&wire)).collect();
            here.sort_by(|&a, &b| (effects[a].order, &effects[a].id).cmp(&(effects[b].order, &effects[b].id)));
            here
        });
        ClosedLoop { rig, effects, rates, on }
    }

    /// Runs, and fills the columns of `trace` that are asked for.
    pub fn run(&self, start: &Start<S>, clamps: &Clamps<'_, S>, columns: Columns, trace: &mut Trace<S>) {
        let rates = &self.rates;
        let mut signals = self.first_signals(start, clamps);
        let mut memories = self.memories(start, &signals);
        let plant = self.rig.plant();
        let mut satellites = plant.start(&start.first);
        let first_due_s = self.rig.link().due_s(rates.loop_phase, &signals.received);
        let mut robot = self.rig.robot().start(&signals.received.motion, first_due_s);
        let mut history = History::<S>::new(&signals.achieved, self.rig.readout().delay_s, rates.physics_step);
        let mut compensator = self.rig.compensator().start(&signals.measured, rates.loop_period.seconds());
        let mut noise_random = start.streams.named("sensor/noise");
        let (mut slow, mut sample, mut loop_index, mut sensor_index) = (0.0, None, 0_usize, 0_usize);

        let length = start.until - start.from;
        let ticks = |period: Nanos| (length.0 / period.0.max(1)) as usize + 1;
        trace.reserve(columns, ticks(rates.loop_period), ticks(rates.sensor_period), ticks(rates.physics_step));
        let steps = length.0 / rates.physics_step.0;
        for index in 0..steps as usize {
            let now = Nanos(start.from.0 + index as i64 * rates.physics_step.0);
            let loop_ticks = now.ticks(rates.loop_period, rates.loop_phase);
            let sensor_ticks = now.ticks(rates.sensor_period, rates.sensor_phase);
            if loop_ticks {
                let step = Step { index: loop_index as u64, now, dt: rates.loop_period };
                signals.commanded = match clamps.commanded {
                    Some(recorded) => recorded[loop_index.min(recorded.len() - 1)],
                    None => self.rig.compensator().command(&mut compensator, step, plant.motion(&satellites)),
                };
                self.receive(step, &mut memories, &mut signals);
                let due_s = self.rig.link().due_s(now, &signals.received);
                if loop_index == 0 {
                    robot = self.rig.robot().start(&signals.received.motion, due_s);
                } else {
                    self.rig.robot().accept(&mut robot, due_s, &signals.received.motion);
                }
            }
            let step = Step { index: index as u64, now, dt: rates.physics_step };
            match clamps.achieved {
                Some(recorded) => signals.achieved = recorded[index],
                None => {
                    signals.achieved = self.rig.robot().motion(&mut robot, now.seconds());
                    self.rewrite(1, step, &mut memories, &mut signals);
                }
            }
            if index == 0 {
                // Only now is it known what the effects make of the first pose.
                history = History::new(&signals.achieved, self.rig.readout().delay_s, rates.physics_step);
            }
            match clamps.measured {
                Some(recorded) => signals.measured = recorded[index],
                None if clamps.achieved.is_none() || columns.loop_ticks || columns.measured => {
                    signals.measured = history.push_and_read(signals.achieved);
                    self.rewrite(2, step, &mut memories, &mut signals);
                }
                None => {}
            }
            signals.touch = self.rig.geometry().touch(&signals.achieved);
            self.rewrite(3, step, &mut memories, &mut signals);
            signals.contact = self.rig.law().force(&signals.touch);
            self.rewrite(4, step, &mut memories, &mut signals);
            signals.interface = self.rig.law().clamped(&signals.touch, &signals.contact);
            signals.sensed = self.rig.sensor().reading(&signals.achieved, &signals.interface);
            self.rewrite(5, step, &mut memories, &mut signals);
            if sensor_ticks {
                let reading = match clamps.sensed {
                    Some(recorded) => recorded[sensor_index.min(recorded.len() - 1)],
                    None => signals.sensed.noisy(&start.noise, &mut slow, &mut noise_random),
                };
                sample = Some(reading);
                sensor_index += 1;
                if columns.sensor_ticks {
                    trace.sensor_tick(now, &signals, reading);
                }
            }
            if loop_ticks {
                let step = Step { index: loop_index as u64, now, dt: rates.loop_period };
                let applied = clamps.applied.map_or(S::Wrench::default(), |all| all[loop_index.min(all.len() - 1)]);
                let heard = Heard {
                    sensed: sample.as_ref(),
                    commanded: &signals.commanded,
                    measured: &signals.measured,
                    interface: &signals.interface,
                    applied,
                };
                signals.feedback = self.rig.compensator().feedback(&mut compensator, step, heard);
                plant.step(&mut satellites, step, &signals.feedback);
                loop_index += 1;
                if columns.loop_ticks {
                    trace.loop_tick(now, &signals, plant.motion(&satellites));
                }
            }
            if columns.achieved {
                trace.achieved.push(signals.achieved);
            }
            if columns.measured {
                trace.measured_steps.push(signals.measured);
            }
        }
    }

    /// The wires as they are when a run begins: everything has been moving along the first motion for ever.
    fn first_signals(&self, start: &Start<S>, clamps: &Clamps<'_, S>) -> Signals<S> {
        let first = start.first;
        let achieved = match clamps.achieved {
            Some(recorded) => recorded[0],
            None => first.coasted(-self.rig.link().dead_time_s),
        };
        let measured = match clamps.measured {
            Some(recorded) => recorded[0],
            None => achieved.coasted(-self.rig.readout().delay_s),
        };
        let touch = self.rig.geometry().touch(&achieved);
        let contact = self.rig.law().force(&touch);
        let interface = self.rig.law().clamped(&touch, &contact);
        let sensed = self.rig.sensor().reading(&achieved, &interface);
        let received = Received { motion: first, late_s: 0.0, lost: false };
        let commanded = first;
        Signals {
            commanded,
            received,
            achieved,
            measured,
            touch,
            contact,
            interface,
            sensed,
            feedback: S::Wrench::default(),
        }
    }

    fn memories(&self, start: &Start<S>, first: &Signals<S>) -> Memories {
        let mut span = Vec::with_capacity(self.effects.len());
        let mut end = 0;
        for attached in self.effects {
            let length = attached.effect.memory(&self.rates);
            span.push((end, end + length));
            end += length;
        }
        let mut numbers = vec![0.0; end];
        for (attached, &(from, to)) in self.effects.iter().zip(&span) {
            attached.effect.begin(&mut numbers[from..to], &self.rates, first);
        }
        let random = self.effects.iter().map(|attached| start.streams.named(&attached.id)).collect();
        Memories { numbers, span, random }
    }

    /// The command as the robot gets it.
    fn receive(&self, step: Step, memories: &mut Memories, signals: &mut Signals<S>) {
        let mut fresh = self.rig.link().receive::<S>(&signals.commanded);
        for &i in &self.on[0] {
            let (effect, context) = memories.context(self.effects, i, step);
            effect.received(context, signals, &mut fresh);
        }
        signals.received = fresh;
    }

    /// Lets the effects on a wire rewrite its part's fresh output.
    fn rewrite(&self, wire: usize, step: Step, memories: &mut Memories, signals: &mut Signals<S>) {
        for &i in &self.on[wire] {
            let (effect, context) = memories.context(self.effects, i, step);
            match WIRES[wire] {
                Wire::Achieved => {
                    let mut out = signals.achieved;
                    effect.achieved(context, signals, &mut out);
                    signals.achieved = out;
                }
                Wire::Measured => {
                    let mut out = signals.measured;
                    effect.measured(context, signals, &mut out);
                    signals.measured = out;
                }
                Wire::Touch => {
                    let mut out = signals.touch;
                    effect.touch(context, signals, &mut out);
                    signals.touch = out;
                }
                Wire::Contact => {
                    let mut out = signals.contact;
                    effect.contact(context, signals, &mut out);
                    signals.contact = out;
                }
                _ => {
                    let mut out = signals.sensed;
                    effect.sensed(context, signals, &mut out);
                    signals.sensed = out;
                }
            }
        }
    }
}

impl Memories {
    fn context<'m, 'e, S: Space>(
        &'m mut self,
        effects: &'e [Attached<S>],
        i: usize,
        step: Step,
    ) -> (&'e dyn Effect<S>, Context<'m>) {
        let (from, to) = self.span[i];
        let context = Context { step, memory: &mut self.numbers[from..to], random: &mut self.random[i] };
        (effects[i].effect.as_ref(), context)
    }
}

/// The achieved poses of the recent past: the read-back's memory.
struct History<S: Space> {
    ring: Vec<S::Motion>,
    head: usize,
    delay_steps: f64,
}

impl<S: Space> History<S> {
    fn new(first: &S::Motion, delay_s: f64, physics_step: Nanos) -> Self {
        let step_s = physics_step.seconds();
        let length = delay::slots(delay_s, step_s) - 1;
        // Slot i was filled (length - i) steps before the first push.
        let ring = (0..length).map(|i| first.coasted(-((length - i) as f64) * step_s)).collect();
        History { ring, head: 0, delay_steps: delay::steps(delay_s, step_s) }
    }

    fn push_and_read(&mut self, newest: S::Motion) -> S::Motion {
        let length = self.ring.len();
        self.ring[self.head] = newest;
        let at = |age: usize| &self.ring[(self.head + length - age) % length];
        let whole = libm::floor(self.delay_steps) as usize;
        let share = self.delay_steps - whole as f64;
        let out = if share == 0.0 { *at(whole) } else { S::Motion::blend(at(whole), at(whole + 1), share) };
        self.head = (self.head + 1) % length;
        out
    }
}
