//! The blocks of the loop with their inputs clamped to a recording: what a model says of each wire, with no feedback to blur it.
//!
//! The path of the robot follows from the recorded command, the reading of the sensor from that path. A fit that changes only
//! the contact keeps the path that it has.

use crate::case::Case;
use crate::model::{Chosen, Device, Model};
use sim_core::closed_loop::{Clamps, ClosedLoop, Facility, Start, Stepped};
use sim_core::compensator::{Compensation, DelayCompensation, Hybrid, Uncompensated};
use sim_core::contact::{ContactLaw, Sides, SpringDashpot};
use sim_core::effect::{Attached, Context, Effect, Rates};
pub use sim_core::force_sensor::GRAVITY_M_PER_S2;
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::rig::{DockingAxis, DriveAxis};
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::signals::{Received, Signals, Wire};
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};
use std::sync::Arc;

/// The values that every model has, effects or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base {
    /// Mass, for a drive; a docking cell takes it from the recording.
    pub mass_kg: f64,
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Damping.
    pub damping_n_s_per_m: f64,
    /// A constant force that resists positive motion.
    pub offset_n: f64,
}

impl Base {
    /// The model's own.
    pub fn of(model: &Model) -> Self {
        Base {
            mass_kg: model.plant.mass_kg,
            stiffness_n_per_m: model.contact.stiffness_n_per_m,
            damping_n_s_per_m: model.contact.damping_n_s_per_m,
            offset_n: model.contact.offset_n,
        }
    }
}

/// The rig of a docking cell with these base values and this mass: a spring and a dashpot, no compensation, whatever else the
/// model says; [`Cell::run`] has the model's own.
pub fn docking_rig(model: &Model, base: &Base, mass_kg: f64) -> DockingAxis {
    let law = SpringDashpot {
        stiffness_n_per_m: base.stiffness_n_per_m,
        damping_n_s_per_m: base.damping_n_s_per_m,
        sides: model.contact.release.sides(),
    };
    rig(model, mass_kg, law, Uncompensated)
}

fn rig<L, D>(model: &Model, mass_kg: f64, law: L, delay: D) -> DockingAxis<L, Hybrid<D>> {
    let weight_n = model.sensor.tool_mass_kg * GRAVITY_M_PER_S2;
    DockingAxis {
        plant: PointMass { mass_kg, integrator: model.plant.integrator },
        link: Link { dead_time_s: model.timing.command_delay_s },
        robot: StraightLine { corner_s: model.timing.loop_period_s, averaging_s: 2.0 * model.timing.sensor_period_s },
        readout: Readout { delay_s: model.timing.measurement_delay_s },
        law,
        sensor: AxisCell { tool_weight_n: weight_n, bias_n: model.sensor.bias_n },
        noise: SensorNoise::NONE,
        compensator: Hybrid {
            bias_n: model.sensor.bias_n,
            tool_weight_n: weight_n,
            virtual_stiffness_n_per_m: model.virtual_contact.stiffness_n_per_m,
            virtual_damping_n_s_per_m: model.virtual_contact.damping_n_s_per_m,
            dead_band_n: model.virtual_contact.dead_band_n,
            architecture: model.virtual_contact.architecture,
            virtual_pose: model.virtual_contact.pose,
            delay,
        },
    }
}

/// The software half of a cell: satellites and compensator, as the model says them.
pub fn software(model: &Model) -> (PointMass, Hybrid<Compensation>) {
    let law = SpringDashpot { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0, sides: Sides::One };
    let rig = rig(model, model.plant.mass_kg, law, model.compensation);
    (rig.plant, rig.compensator)
}

/// A docking cell: a model, and what differs from it in one run.
#[derive(Debug, Clone, Copy)]
pub struct Cell<'a> {
    /// The model.
    pub model: &'a Model,
    /// Its base values, as they were in this run.
    pub base: Base,
    /// Mass of the satellites.
    pub mass_kg: f64,
    /// Offset of the sensor that the compensator does not know of.
    pub sensor_offset_n: f64,
    /// Offset that the compensator takes out and the sensor does not have.
    pub believed_offset_n: f64,
}

/// How a loop is run.
struct Run<'r> {
    effects: &'r [Attached<Axis>],
    rates: Rates,
    start: &'r Start<Axis>,
    clamps: &'r Clamps<'r, Axis>,
    columns: Columns,
}

impl<'a> Cell<'a> {
    /// The model's own values, with this mass.
    pub fn of(model: &'a Model, mass_kg: f64) -> Self {
        Cell { model, base: Base::of(model), mass_kg, sensor_offset_n: 0.0, believed_offset_n: 0.0 }
    }

    /// Runs the loop. Which parts the model names is asked once, not in every step.
    pub fn run(
        &self,
        effects: &[Attached<Axis>],
        rates: Rates,
        start: &Start<Axis>,
        clamps: &Clamps<'_, Axis>,
        columns: Columns,
        trace: &mut Trace<Axis>,
    ) {
        let (base, contact) = (&self.base, &self.model.contact);
        let device = contact.law.device(base.stiffness_n_per_m, base.damping_n_s_per_m, contact.release.sides());
        let run = Run { effects, rates, start, clamps, columns };
        match device.expect("the model was checked, and a fit turns its stiffness no further than zero") {
            Device::SpringDashpot(law) => self.run_on(law, &run, trace),
            Device::Hertz(law) => self.run_on(law, &run, trace),
            Device::HuntCrossley(law) => self.run_on(law, &run, trace),
            Device::Table(law) => self.run_on(law, &run, trace),
        }
    }

    /// Hands the facility's half of the loop to `work`, which steps it with commands of its own.
    pub fn facility(
        &self,
        effects: &[Attached<Axis>],
        rates: Rates,
        start: &Start<Axis>,
        work: &mut dyn FnMut(&mut dyn Stepped<Axis>),
    ) {
        let (base, contact) = (&self.base, &self.model.contact);
        let device = contact.law.device(base.stiffness_n_per_m, base.damping_n_s_per_m, contact.release.sides());
        match device.expect("the model was checked") {
            Device::SpringDashpot(law) => self.facility_on(law, effects, rates, start, work),
            Device::Hertz(law) => self.facility_on(law, effects, rates, start, work),
            Device::HuntCrossley(law) => self.facility_on(law, effects, rates, start, work),
            Device::Table(law) => self.facility_on(law, effects, rates, start, work),
        }
    }

    fn facility_on<L: ContactLaw<Axis>>(
        &self,
        law: L,
        effects: &[Attached<Axis>],
        rates: Rates,
        start: &Start<Axis>,
        work: &mut dyn FnMut(&mut dyn Stepped<Axis>),
    ) {
        let mut rig = rig(self.model, self.mass_kg, law, Uncompensated);
        rig.sensor.bias_n += self.sensor_offset_n;
        let looped = ClosedLoop::new(&rig, effects, rates);
        work(&mut Facility::new(&looped, start));
    }

    fn run_on<L: ContactLaw<Axis>>(&self, law: L, run: &Run<'_>, trace: &mut Trace<Axis>) {
        match self.model.compensation {
            Compensation::None(none) => self.run_with(law, none, run, trace),
            some => self.run_with(law, some, run, trace),
        }
    }

    fn run_with<L: ContactLaw<Axis>, D: DelayCompensation>(
        &self,
        law: L,
        delay: D,
        run: &Run<'_>,
        trace: &mut Trace<Axis>,
    ) {
        let mut rig = rig(self.model, self.mass_kg, law, delay);
        rig.sensor.bias_n += self.sensor_offset_n;
        rig.compensator.bias_n += self.believed_offset_n;
        ClosedLoop::new(&rig, run.effects, run.rates).run(run.start, run.clamps, run.columns, trace);
    }
}

/// The rig of a driven axis.
pub fn drive_rig(base: &Base) -> DriveAxis {
    DriveAxis {
        plant: PointMass::of_mass(base.mass_kg),
        link: Link { dead_time_s: 0.0 },
        readout: Readout { delay_s: 0.0 },
        law: SpringDashpot {
            stiffness_n_per_m: base.stiffness_n_per_m,
            damping_n_s_per_m: base.damping_n_s_per_m,
            sides: Sides::Two,
        },
        sensor: AxisCell { tool_weight_n: 0.0, bias_n: 0.0 },
    }
}

/// Effects that happen by chance, packet by packet. No block predicts them: a recording tells which packets they were.
pub const RANDOM: [&str; 2] = ["command-loss", "command-jitter"];

/// Whether an effect happens by chance.
pub fn is_random(chosen: &Chosen) -> bool {
    RANDOM.contains(&chosen.kind.id.as_ref())
}

/// Whether an effect changes the robot's path or its report.
pub fn is_on_path(wires: &[Wire]) -> bool {
    wires.iter().any(|wire| matches!(wire, Wire::Received | Wire::Achieved | Wire::Measured))
}

/// Whether an effect changes the force.
pub fn is_on_force(wires: &[Wire]) -> bool {
    wires.iter().any(|wire| matches!(wire, Wire::Touch | Wire::Contact | Wire::Sensed | Wire::Recorder))
}

fn attached(effects: &[Chosen], on: fn(&[Wire]) -> bool) -> Vec<Attached<Axis>> {
    effects.iter().filter(|chosen| on(&chosen.kind.wires) && !is_random(chosen)).map(Chosen::attach).collect()
}

fn start(case: &Case) -> Start<Axis> {
    // Blocks with clamped inputs are free of randomness: the seed is never drawn from.
    Start { first: case.first, from: Nanos(0), until: case.until, noise: SensorNoise::NONE, streams: Streams::new(0) }
}

/// The robot's path under the recorded commands.
#[derive(Debug, Clone, Default)]
pub struct Path {
    /// Achieved motion at each physics step.
    pub achieved: Vec<AxisMotion>,
    /// Reported position at each tick of the loop.
    pub measured_m: Vec<f64>,
}

/// A link's past, packet by packet, as it was decoded from a recording: a fault schedule that is replayed.
#[derive(Debug, Clone)]
pub struct Schedule(pub Arc<[Received<Axis>]>);

impl Effect<Axis> for Schedule {
    fn received(&self, context: Context<'_>, _seen: &Signals<Axis>, out: &mut Received<Axis>) {
        if let Some(packet) = self.0.get(context.step.index as usize) {
            *out = *packet;
        }
    }
}

impl Schedule {
    fn attach(&self) -> Attached<Axis> {
        // First on its wire: whatever else is late comes on top.
        let effect = Box::new(self.clone());
        Attached { id: "decoded schedule".into(), wires: vec![Wire::Received], order: 0, effect }
    }
}

/// Ticks at which the robot holds, having got no command.
#[derive(Debug, Clone)]
pub struct Held(pub Arc<[bool]>);

impl Effect<Axis> for Held {
    fn received(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut Received<Axis>) {
        if self.0.get(context.step.index as usize) == Some(&true) {
            *out = Received { motion: seen.received.motion, late_s: 0.0, lost: true };
        }
    }
}

impl Held {
    /// Ready to run; `None` if the robot never holds.
    pub fn attach(held: &[bool]) -> Option<Attached<Axis>> {
        let any = held.iter().any(|held| *held);
        // After a decoded schedule (by its name): what is known for sure counts.
        let effect = || Box::new(Held(held.into()));
        any.then(|| Attached { id: "held".into(), wires: vec![Wire::Received], order: 0, effect: effect() })
    }
}

/// The path block: recorded command in, achieved and reported pose out.
pub fn path(model: &Model, case: &Case, effects: &[Chosen], schedule: Option<&Schedule>) -> Path {
    let mut attached = attached(effects, is_on_path);
    attached.extend(schedule.map(Schedule::attach));
    attached.extend(Held::attach(&case.settled.held));
    let mut trace = Trace::default();
    let clamps = Clamps { commanded: Some(&case.commanded), ..Clamps::default() };
    let columns = Columns { loop_ticks: true, sensor_ticks: false, achieved: true, measured: false };
    Cell::of(model, case.mass_kg).run(&attached, case.rates, &start(case), &clamps, columns, &mut trace);
    let measured_m = trace.measured.iter().map(|motion| motion.position_m).collect();
    Path { achieved: trace.achieved, measured_m }
}

/// The force block: achieved motion in, reading out, one for each tick of the sensor, without noise.
pub fn force(
    model: &Model,
    case: &Case,
    path: &Path,
    base: &Base,
    effects: &[Chosen],
    trace: &mut Trace<Axis>,
) -> Vec<f64> {
    let cell = Cell { base: *base, ..Cell::of(model, case.mass_kg) };
    let attached = attached(effects, is_on_force);
    trace.clear();
    let clamps = Clamps { achieved: Some(&path.achieved), ..Clamps::default() };
    let late_s: f64 = attached.iter().map(|attached| attached.effect.stamp_offset_s()).sum();
    let late = late_s / case.rates.sensor_period.seconds();
    // The first samples of a late stream were taken before its first stamp: the sensor ticks that much earlier, as far as the run goes.
    let sooner = (libm::floor(late) as i64).clamp(0, case.rates.sensor_phase.0 / case.rates.sensor_period.0);
    let sensor_phase = Nanos(case.rates.sensor_phase.0 - sooner * case.rates.sensor_period.0);
    let rates = Rates { sensor_phase, ..case.rates };
    cell.run(&attached, rates, &start(case), &clamps, Columns::FORCE, trace);
    let mut sensed = stamped(&trace.sensed, late - sooner as f64);
    sensed.truncate(case.sensed_n.value.len());
    sensed
}

/// The samples as the recorder stamps them: `late` sample periods late, on the straight line between two samples.
pub fn stamped(samples: &[f64], late: f64) -> Vec<f64> {
    if late == 0.0 {
        return samples.to_vec();
    }
    let last = samples.len() as f64 - 1.0;
    let at = |tick: usize| {
        let place = (tick as f64 - late).clamp(0.0, last);
        let whole = libm::floor(place) as usize;
        let next = samples[(whole + 1).min(samples.len() - 1)];
        samples[whole] + (next - samples[whole]) * (place - whole as f64)
    };
    (0..samples.len()).map(at).collect()
}

/// The drive: applied force in, position out, one for each tick, from this motion on.
pub fn drive(
    case: &Case,
    span: std::ops::Range<usize>,
    first: AxisMotion,
    base: &Base,
    effects: &[Chosen],
    trace: &mut Trace<Axis>,
) -> Vec<f64> {
    let rig = drive_rig(base);
    let attached: Vec<Attached<Axis>> = effects.iter().map(Chosen::attach).collect();
    let applied: Vec<f64> = case.applied_n[span.clone()].iter().map(|force_n| force_n - base.offset_n).collect();
    let rates = Rates {
        sensor_phase: Nanos(i64::MAX / 2 / case.rates.physics_step.0 * case.rates.physics_step.0),
        ..case.rates
    };
    let until = Nanos(span.len() as i64 * rates.loop_period.0);
    let start = Start { first, from: Nanos(0), until, noise: SensorNoise::NONE, streams: Streams::new(0) };
    let columns = Columns { loop_ticks: true, sensor_ticks: false, achieved: false, measured: false };
    trace.clear();
    let clamps = Clamps { applied: Some(&applied), ..Clamps::default() };
    ClosedLoop::new(&rig, &attached, rates).run(&start, &clamps, columns, trace);
    trace.commanded.iter().map(|motion| motion.position_m).collect()
}
