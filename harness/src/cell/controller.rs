//! Controllers under test: what one sees and what it commands, in SI; and the reference controller.
//!
//! The reference controller is the software half of a docking simulator: satellites, compensation, virtual contact, as the model
//! says them. Its answer to a cycle is where the satellites are at that cycle, before the cycle's force acts: so a recording of
//! it is what the closed loop of the model would have made.

use crate::blocks;
use crate::model::Model;
use crate::recording::{Pose, Twist, Wrench};
use crate::simulate;
use sim_core::compensator::{Compensation, Compensator, Heard, Hybrid, HybridState};
use sim_core::plant::{Plant, PointMass, PointMassState};
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::{Nanos, Step};

/// What a controller sees in one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Number of the cycle, from 0.
    pub cycle: u64,
    /// Probe relative to the nozzle, as the robots report it.
    pub pose: Pose,
    /// Readings since the cycle before, oldest first, in axes parallel to the nozzle's.
    pub wrenches: &'a [Wrench],
}

/// What a controller commands in one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Probe relative to the nozzle.
    pub pose: Pose,
    /// Velocity of the simulated satellites after this cycle, if it says so.
    pub twist: Option<Twist>,
}

/// A controller under test.
pub trait Controller {
    /// One cycle: what was seen, and what is commanded now.
    fn cycle(&mut self, seen: &Seen<'_>) -> Command;
}

/// What the reference controller does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Task {
    /// The loop is closed: an approach, and what follows.
    #[default]
    Dock,
    /// It commands the pose that it began with.
    Rest,
    /// The loop is open: several sines in z and in pitch about the pose that it began with.
    Excite,
}

/// The reference controller, along one axis.
#[derive(Debug, Clone)]
pub struct Reference {
    task: Task,
    period: Nanos,
    first: AxisMotion,
    plant: PointMass,
    satellites: PointMassState,
    compensator: Hybrid<Compensation>,
    software: Option<HybridState<<Compensation as sim_core::compensator::DelayCompensation>::State>>,
    sample_n: Option<f64>,
    before: Option<AxisMotion>,
}

impl Reference {
    /// As the model says, beginning with this motion along z.
    pub fn new(model: &Model, first: AxisMotion, task: Task) -> Self {
        let (plant, compensator) = blocks::software(model);
        Reference {
            task,
            period: Nanos::from_seconds(model.timing.loop_period_s),
            first,
            satellites: plant.start(&first),
            plant,
            compensator,
            software: None,
            sample_n: None,
            before: None,
        }
    }

    /// What was reported, as a motion: its velocity is the difference to the cycle before.
    fn measured(&mut self, pose: &Pose) -> AxisMotion {
        let [x, _, _, w] = pose.orientation_xyzw;
        let pitch_rad = 2.0 * libm::atan2(x, w);
        let position_m = pose.position_m[2];
        let period_s = self.period.seconds();
        let (velocity, rate) = self.before.map_or((self.first.velocity_m_per_s, 0.0), |before| {
            ((position_m - before.position_m) / period_s, (pitch_rad - before.pitch_rad) / period_s)
        });
        let measured = AxisMotion { pitch_rad, pitch_rate_rad_per_s: rate, ..AxisMotion::moving(position_m, velocity) };
        self.before = Some(measured);
        measured
    }

    /// The satellites' position now; then they feel this cycle.
    fn dock(&mut self, cycle: u64, measured: &AxisMotion) -> AxisMotion {
        let now = Nanos(cycle as i64 * self.period.0);
        let step = Step { index: cycle, now, dt: self.period };
        let begin = || Compensator::<Axis>::start(&self.compensator, measured, self.period.seconds());
        let mut state = self.software.take().unwrap_or_else(begin);
        let commanded = self.compensator.command(&mut state, step, self.plant.motion(&self.satellites));
        let heard =
            Heard { sensed: self.sample_n.as_ref(), commanded: &commanded, measured, interface: &0.0, applied: 0.0 };
        let net_n = self.compensator.feedback(&mut state, step, heard);
        self.plant.step(&mut self.satellites, step, &net_n);
        self.software = Some(state);
        commanded
    }
}

impl Controller for Reference {
    fn cycle(&mut self, seen: &Seen<'_>) -> Command {
        let measured = self.measured(&seen.pose);
        self.sample_n = seen.wrenches.last().map(|wrench| wrench.force_n[2]).or(self.sample_n);
        let still = AxisMotion { velocity_m_per_s: 0.0, ..self.first };
        let commanded = match self.task {
            Task::Dock => self.dock(seen.cycle, &measured),
            Task::Rest => still,
            Task::Excite => {
                let excited = simulate::excitation(seen.cycle as f64 * self.period.seconds());
                AxisMotion {
                    position_m: still.position_m + excited.position_m,
                    pitch_rad: still.pitch_rad + excited.pitch_rad,
                    ..still
                }
            }
        };
        let linear_m_per_s = [0.0, 0.0, self.satellites.velocity_m_per_s];
        let twist = (self.task == Task::Dock).then_some(Twist { linear_m_per_s, angular_rad_per_s: [0.0; 3] });
        Command { pose: simulate::pose(commanded.position_m, commanded.pitch_rad), twist }
    }
}
