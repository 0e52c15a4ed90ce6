//! The loop itself: parts at their own rates, effects on their wires, any wire clamped to a recording.
//!
//! Within one physics step, at time t: the satellites issue their position, the link receives it, the robot moves, the pose is
//! read back, the interfaces touch, the sensor reads; at a tick of the loop the net force then acts for one tick. A command is
//! the position *before* its tick's force.
//!
//! Replay is clamping: what enters a part is taken from a recording, so that the misfit of what leaves it belongs to that part.
//! Upstream wires that a fit does not change are computed once and clamped in the next run: that is what makes fits cheap.

use crate::effect::{Attached, Rates};
use crate::force_sensor::Noisy;
use crate::refusal::{Refusal, not_negative, positive};
use crate::rig::Rig;
use crate::rng::Streams;
use crate::robot::Robot;
use crate::signals::Wire;
use crate::space::Space;
use crate::time::Nanos;
use crate::trace::{Columns, Trace};
use alloc::vec::Vec;
use run::Run;

mod facility;
pub use facility::{Facility, Reported, Stepped};
mod history;
mod memories;
mod run;

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
        Clamps::NONE
    }
}

impl<S: Space> Clamps<'_, S> {
    /// Nothing is clamped.
    const NONE: Clamps<'static, S> =
        Clamps { commanded: None, achieved: None, measured: None, sensed: None, applied: None };

    /// Whether any wire is clamped.
    fn any(&self) -> bool {
        self.commanded.is_some()
            || self.achieved.is_some()
            || self.measured.is_some()
            || self.sensed.is_some()
            || self.applied.is_some()
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
    pub noise: <S::Wrench as Noisy>::Noise,
    /// Where the randomness comes from.
    pub streams: Streams,
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

impl<'a, S: Space, R: Rig<S>> ClosedLoop<'a, S, R> {
    /// A loop of these parts. Effects on one wire act in their declared order, then by id.
    ///
    /// Panics where [`ClosedLoop::checked`] refuses the clocks.
    pub fn new(rig: &'a R, effects: &'a [Attached<S>], rates: Rates) -> Self {
        if let Err(refusal) = rates.check() {
            panic!("{refusal}");
        }
        let on = WIRES.map(|wire| {
            let mut here: Vec<usize> = (0..effects.len()).filter(|&i| effects[i].wires.contains(&wire)).collect();
            here.sort_by(|&a, &b| (effects[a].order, &effects[a].id).cmp(&(effects[b].order, &effects[b].id)));
            here
        });
        ClosedLoop { rig, effects, rates, on }
    }

    /// The same, for parts and clocks that come from outside: what means nothing is refused with the reason.
    pub fn checked(rig: &'a R, effects: &'a [Attached<S>], rates: Rates) -> Result<Self, Refusal> {
        rates.check()?;
        positive("loop_period_s", rates.loop_period.seconds(), "s")?;
        not_negative("dead_time_s", rig.link().dead_time_s, "s")?;
        not_negative("delay_s", rig.readout().delay_s, "s")?;
        rig.robot().check()?;
        Ok(ClosedLoop::new(rig, effects, rates))
    }

    /// Runs, and fills the columns of `trace` that are asked for.
    pub fn run(&self, start: &Start<S>, clamps: &Clamps<'_, S>, columns: Columns, trace: &mut Trace<S>) {
        let length = start.until - start.from;
        let ticks = |period: Nanos| (length.0 / period.0.max(1)) as usize + 1;
        let rates = &self.rates;
        trace.reserve(columns, ticks(rates.loop_period), ticks(rates.sensor_period), ticks(rates.physics_step));
        // What a run leaves out it does not ask about at each step: each of these is compiled for itself.
        let clamped = columns.achieved || columns.measured || clamps.any();
        match (self.effects.is_empty(), clamped) {
            (true, false) => Run::<S, R, false, false>::new(self, start, clamps, columns).steps(trace),
            (true, true) => Run::<S, R, false, true>::new(self, start, clamps, columns).steps(trace),
            (false, false) => Run::<S, R, true, false>::new(self, start, clamps, columns).steps(trace),
            (false, true) => Run::<S, R, true, true>::new(self, start, clamps, columns).steps(trace),
        }
    }
}
