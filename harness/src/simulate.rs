//! A cell in memory: what its recorder would have written, had this model with these effects been the truth.
//!
//! There is no physics here: the closed loop of `sim_core` runs with the parts that the model describes, and what a log holds is
//! written down as sessions. What is taken over from a real cell is how it is recorded: noise of the sensor (felt by the loop),
//! noise of the read-out (not felt), rounding to whole mN and µm, and the declared repeatability, drawn anew for each run.
//!
//! Truth and model share code here. A diagnosis of such sessions tests the diagnosis, never the physics.
//!
//! Not simulated: the two axes across, which hold the weight and nothing else; noise of the attitude.

use crate::blocks::{Base, Cell, GRAVITY_M_PER_S2};
use crate::files::sha256_hex;
use crate::model::{Chosen, Model, Parts};
use crate::recording::{Grade, Kind, Pose, Series, Session, Twist, Wrench};
use sim_core::closed_loop::{Clamps, Start};
use sim_core::effect::{Attached, Rates};
use sim_core::force_sensor::SensorNoise;
use sim_core::recorder::{LogChannel, stamped};
use sim_core::rng::Streams;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Rounding of the recorded force, as the recorded cells have it.
pub(crate) const FORCE_QUANTUM_N: f64 = 1e-3;
/// Rounding of the recorded position, as the recorded cells have it.
pub(crate) const POSITION_QUANTUM_M: f64 = 1e-6;
/// What is left of the slow part of the noise after one sample, as the recorded cells declare it.
const SLOW_MEMORY: f64 = 0.95;
/// Where the robot waits and is excited: far from contact.
const WAITING_M: f64 = -0.15;
/// How long the recorder runs on after an impact. Chosen.
const AFTER_S: f64 = 0.4;
/// Time of the first run: any date will do, and it is never the clock's.
const FIRST_NS: i64 = 1_770_000_000_000_000_000;
/// From the start of one run to the start of the next.
const BETWEEN_NS: i64 = 600_000_000_000;

/// What is done in one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// At rest for this long.
    Rest {
        /// Length of the recording.
        duration_s: f64,
    },
    /// In free flight, loop open: several sines in z and in pitch, which turns the tool's weight into a force along z.
    Excite {
        /// Length of the recording.
        duration_s: f64,
    },
    /// An approach and a contact, loop closed.
    Impact {
        /// Approach speed, before scatter.
        speed_m_per_s: f64,
        /// Simulated mass over the model's.
        mass_ratio: f64,
        /// Distance from the contact plane at the start; positive.
        distance_m: f64,
    },
}

/// One run of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Its name: of the recording, and of its random streams.
    pub name: &'static str,
    /// What is done.
    pub task: Task,
}

impl Run {
    /// An impact from 8 mm before contact.
    pub const fn impact(name: &'static str, speed_m_per_s: f64, mass_ratio: f64) -> Self {
        Run { name, task: Task::Impact { speed_m_per_s, mass_ratio, distance_m: 0.008 } }
    }
}

/// Six impacts at three speeds, two of them repeated, one with more mass.
pub const LEARN: [Run; 6] = [
    Run::impact("learn_01", 0.014, 1.0),
    Run::impact("learn_02", 0.026, 1.0),
    Run::impact("learn_03", 0.042, 1.0),
    Run::impact("learn_04", 0.026, 1.0),
    Run::impact("learn_05", 0.014, 1.6),
    Run::impact("learn_06", 0.042, 1.0),
];

/// A recording at rest and one in free flight.
pub const AUX: [Run; 2] = [
    Run { name: "static", task: Task::Rest { duration_s: 4.0 } },
    Run { name: "excite", task: Task::Excite { duration_s: 6.0 } },
];

/// Three impacts at other speeds.
pub const TEST: [Run; 3] =
    [Run::impact("test_07", 0.020, 1.0), Run::impact("test_08", 0.036, 1.0), Run::impact("test_09", 0.030, 1.6)];

/// Runs the plan on a cell that is this model with these effects in it.
///
/// Each run has random streams of its own, named after the seed and the run: what else is in the plan changes nothing.
pub fn cell(model: &Model, effects: &[Chosen], plan: &[Run], seed: u64) -> Vec<Session> {
    plan.iter().enumerate().map(|(nth, run)| recorded(model, effects, run, nth, seed)).collect()
}

/// What differs from run to run, as drawn.
struct Scatter {
    speed: f64,
    stiffness: f64,
    damping: f64,
    offset_n: f64,
}

impl Scatter {
    fn draw(model: &Model, streams: &Streams) -> Self {
        let repeat = &model.repeatability;
        let normal = |name: &str| streams.named(name).normal();
        Scatter {
            speed: 1.0 + repeat.approach_speed_ratio * normal("repeatability/speed"),
            stiffness: 1.0 + repeat.stiffness_ratio * normal("repeatability/stiffness"),
            damping: 1.0 + repeat.damping_ratio * normal("repeatability/damping"),
            offset_n: repeat.force_offset_n * normal("repeatability/offset"),
        }
    }
}

fn recorded(model: &Model, effects: &[Chosen], run: &Run, nth: usize, seed: u64) -> Session {
    // A seed for each run: 53 bits of the stream that bears its name.
    let streams = Streams::new((Streams::new(seed).named(run.name).uniform() * 9_007_199_254_740_992.0) as u64);
    let scatter = Scatter::draw(model, &streams);
    let rates = rates(model);
    let (first, until, commanded) = task(model, run, scatter.speed, &rates);
    let mass_kg = match run.task {
        Task::Impact { mass_ratio, .. } => model.plant.mass_kg * mass_ratio,
        _ => model.plant.mass_kg,
    };
    let nominal = Base::of(model);
    let base = Base {
        stiffness_n_per_m: nominal.stiffness_n_per_m * scatter.stiffness,
        damping_n_s_per_m: nominal.damping_n_s_per_m * scatter.damping,
        ..nominal
    };
    // The compensator goes on believing the declared bias.
    let cell = Cell { base, sensor_offset_n: scatter.offset_n, ..Cell::of(model, mass_kg) };
    let attached: Vec<Attached<Axis>> = effects.iter().map(Chosen::attach).collect();
    let start = Start { first, from: Nanos(0), until, noise: noise(model), streams };
    let clamps = Clamps { commanded: commanded.as_deref(), ..Clamps::default() };
    let mut trace = Trace::default();
    cell.run(&attached, rates, &start, &clamps, Columns::LOG, &mut trace);
    let late_s = attached.iter().map(|attached| attached.effect.stamp_offset_s()).sum();
    let kind = match run.task {
        Task::Rest { .. } => Kind::Static,
        Task::Excite { .. } => Kind::FreeFlight,
        Task::Impact { .. } => Kind::Impact,
    };
    let label = Label { name: run.name, kind, start_ns: FIRST_NS + nth as i64 * BETWEEN_NS };
    written(model, &label, mass_kg, &trace, late_s, &streams)
}

/// The sensor's noise, as the model declares it.
pub(crate) fn noise(model: &Model) -> SensorNoise {
    SensorNoise {
        white_n: model.sensor.white_sigma_n,
        slow_n: model.sensor.slow_sigma_n,
        memory: SLOW_MEMORY,
        quantum_n: FORCE_QUANTUM_N,
    }
}

/// The clocks of the model: the first sample of the sensor ends its first period.
pub(crate) fn rates(model: &Model) -> Rates {
    let sensor_period = Nanos::from_seconds(model.timing.sensor_period_s);
    Rates {
        physics_step: Nanos::from_seconds(model.timing.physics_step_s),
        loop_period: Nanos::from_seconds(model.timing.loop_period_s),
        loop_phase: Nanos(0),
        sensor_period,
        sensor_phase: sensor_period,
    }
}

/// First motion, end, and the commands where the loop is open.
fn task(model: &Model, run: &Run, speed_scatter: f64, rates: &Rates) -> (AxisMotion, Nanos, Option<Vec<AxisMotion>>) {
    let period_s = rates.loop_period.seconds();
    let whole = |duration_s: f64| Nanos(libm::ceil(duration_s / period_s) as i64 * rates.loop_period.0);
    let waiting = AxisMotion::moving(WAITING_M, 0.0);
    match run.task {
        Task::Rest { duration_s } => (waiting, whole(duration_s), Some(vec![waiting])),
        Task::Excite { duration_s } => {
            let until = whole(duration_s);
            let ticks = until.0 / rates.loop_period.0;
            (waiting, until, Some((0..ticks).map(|tick| excited(tick as f64 * period_s)).collect()))
        }
        Task::Impact { speed_m_per_s, mass_ratio, distance_m } => {
            let speed_m_per_s = speed_m_per_s * speed_scatter;
            // Half a period on the device: only the length of the recording depends on it.
            let contact_s = PI * libm::sqrt(model.plant.mass_kg * mass_ratio / model.contact.stiffness_n_per_m);
            let until = whole(distance_m / speed_m_per_s + contact_s + AFTER_S);
            (AxisMotion::moving(-distance_m, speed_m_per_s), until, None)
        }
    }
}

fn excited(time_s: f64) -> AxisMotion {
    let excited = excitation(time_s);
    AxisMotion { position_m: WAITING_M + excited.position_m, ..excited }
}

/// Three sines each, incommensurable, of the size that the recorded cells use (9 mm, 0.11 rad). Chosen.
pub(crate) fn excitation(time_s: f64) -> AxisMotion {
    let sines = |parts: [(f64, f64); 3]| -> f64 {
        parts.iter().map(|(size, frequency_hz)| size * libm::sin(2.0 * PI * frequency_hz * time_s)).sum()
    };
    let position_m = sines([(0.005, 0.41), (0.003, 0.97), (0.001, 2.3)]);
    AxisMotion { pitch_rad: sines([(0.06, 0.53), (0.04, 1.31), (0.02, 3.1)]), ..AxisMotion::moving(position_m, 0.0) }
}

/// What a recording is called, what was done in it, and when.
pub(crate) struct Label<'a> {
    /// Its name.
    pub name: &'a str,
    /// What was done.
    pub kind: Kind,
    /// Time of its beginning, in ns.
    pub start_ns: i64,
}

/// The stage outside the loop: read-out noise, rounding, stamps, and the record of what the operator believes.
pub(crate) fn written(
    model: &Model,
    label: &Label<'_>,
    mass_kg: f64,
    trace: &Trace<Axis>,
    late_s: f64,
    streams: &Streams,
) -> Session {
    let weight_n = model.sensor.tool_mass_kg * GRAVITY_M_PER_S2;
    let loop_ns: Vec<i64> = trace.loop_time.iter().map(|time| time.0).collect();
    let channel = LogChannel { sigma: model.readout.position_sigma_m, quantum: POSITION_QUANTUM_M };
    let mut random = streams.named("recorder/position");
    let measured =
        trace.measured.iter().map(|motion| pose(channel.written(motion.position_m, &mut random), motion.pitch_rad));
    let measured = Series { time_ns: loop_ns.clone(), value: measured.collect() };
    let commanded = trace.commanded.iter().map(|motion| pose(motion.position_m, motion.pitch_rad)).collect();
    let wrench = |reading: &f64| Wrench { force_n: [0.0, -weight_n, *reading], torque_n_m: [0.0; 3] };
    let twist = |motion: &AxisMotion| Twist {
        linear_m_per_s: [0.0, 0.0, motion.velocity_m_per_s],
        angular_rad_per_s: [0.0; 3],
    };
    let kind = label.kind;
    let twist = || Series { time_ns: loop_ns.clone(), value: trace.after.iter().map(twist).collect() };
    // There is no file: what would be its bytes are the numbers that it would hold.
    let numbers = trace.sensed.iter().copied().chain(measured.value.iter().map(|pose| pose.position_m[2]));
    let bytes: Vec<u8> = label.name.bytes().chain(numbers.flat_map(f64::to_le_bytes)).collect();
    Session {
        file: format!("{}.simulated", label.name).into(),
        sha256: sha256_hex(&bytes),
        start_ns: label.start_ns,
        kind,
        believed: believed(model, mass_kg, kind),
        twist: (kind == Kind::Impact).then(twist),
        commanded: Some(Series { time_ns: loop_ns.clone(), value: commanded }),
        measured: Some(measured),
        sensed: Some(Series {
            time_ns: trace.sensor_time.iter().map(|time| stamped(*time, late_s).0).collect(),
            value: trace.sensed.iter().map(wrench).collect(),
        }),
        applied: None,
        grade: Grade::A,
        findings: Vec::new(),
    }
}

/// A pose along the axis, with its pitch.
pub(crate) fn pose(z_m: f64, pitch_rad: f64) -> Pose {
    let half_rad = 0.5 * pitch_rad;
    Pose { position_m: [0.0, 0.0, z_m], orientation_xyzw: [libm::sin(half_rad), 0.0, 0.0, libm::cos(half_rad)] }
}

/// The metadata record `session`: what [`crate::model::from_session`] turns into this model again.
pub(crate) fn believed(model: &Model, mass_kg: f64, kind: Kind) -> BTreeMap<String, String> {
    let numbers = [
        ("reduced_mass_kg", mass_kg),
        ("device_stiffness_n_per_m", model.contact.stiffness_n_per_m),
        ("device_damping_n_s_per_m", model.contact.damping_n_s_per_m),
        ("virtual_stiffness_n_per_m", model.virtual_contact.stiffness_n_per_m),
        ("virtual_damping_n_s_per_m", model.virtual_contact.damping_n_s_per_m),
        ("dead_band_n", model.virtual_contact.dead_band_n),
        ("command_delay_s", model.timing.command_delay_s),
        ("measurement_delay_s", model.timing.measurement_delay_s),
        ("loop_period_s", model.timing.loop_period_s),
        ("ft_period_s", model.timing.sensor_period_s),
        ("ft_force_sigma_n", model.sensor.white_sigma_n),
        ("ft_force_slow_sigma_n", model.sensor.slow_sigma_n),
        ("position_sigma_m", model.readout.position_sigma_m),
        ("tool_mass_kg", model.sensor.tool_mass_kg),
    ];
    let mut record: BTreeMap<String, String> =
        numbers.into_iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    record.insert("ft_bias".into(), format!("[0.0, 0.0, {}]", model.sensor.bias_n));
    record.extend(Parts::text(model).map(|text| (Parts::KEY.to_owned(), text)));
    record.insert("kind".into(), kind.id().into());
    record
}
