//! Every effect of the catalogue, in one impact on the docking cell: off is nothing, on has the right sign and size, what is
//! passive creates no energy, and nobody touches another's random numbers.
#![expect(clippy::disallowed_methods, reason = "the oracle is another implementation than libm")]

use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::compensator::Hybrid;
use sim_core::contact::{Sides, SpringDashpot};
use sim_core::effect::{Attached, Kind, Rates};
use sim_core::effects::standard;
use sim_core::energy::observed_j;
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::rig::DockingAxis;
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::signals::Wire;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

mod exact;
mod tidy;

/// Approach speed of the impact.
const SPEED_M_PER_S: f64 = 0.035;
/// Stiffness of the device.
const STIFFNESS_N_PER_M: f64 = 1066.0;
/// White noise of the recorded cells (PHYSICS.md, correction 5).
const NOISE: SensorNoise = SensorNoise { white_n: 0.08, ..SensorNoise::NONE };
/// All columns.
const ALL: Columns = Columns { loop_ticks: true, sensor_ticks: true, achieved: true, measured: true };

/// 4 ms loop, 1 ms sensor, 0.5 ms physics.
fn rates() -> Rates {
    Rates {
        physics_step: Nanos(500_000),
        loop_period: Nanos(4_000_000),
        loop_phase: Nanos(0),
        sensor_period: Nanos(1_000_000),
        sensor_phase: Nanos(0),
    }
}

/// The cell of thesis 4.4: 63.2 kg, 1066 N/m, 6 N s/m of its own and 40 N s/m virtual, 16 ms there and 16 ms back.
fn cell() -> DockingAxis {
    DockingAxis {
        plant: PointMass::of_mass(63.2),
        link: Link { dead_time_s: 0.016 },
        robot: StraightLine { corner_s: 0.004, averaging_s: 0.002 },
        readout: Readout { delay_s: 0.016 },
        law: SpringDashpot { stiffness_n_per_m: STIFFNESS_N_PER_M, damping_n_s_per_m: 6.0, sides: Sides::One },
        sensor: AxisCell { tool_weight_n: 0.0, bias_n: 0.0 },
        noise: SensorNoise::NONE,
        compensator: Hybrid {
            bias_n: 0.0,
            tool_weight_n: 0.0,
            virtual_stiffness_n_per_m: 0.0,
            virtual_damping_n_s_per_m: 40.0,
            dead_band_n: 0.25,
            ..Hybrid::default()
        },
    }
}

/// Two seconds from 20 mm before contact: an approach, one contact of some 0.7 s, and a departure.
fn impact(rig: &DockingAxis, effects: &[Attached<Axis>], noise: SensorNoise, clamps: &Clamps<'_, Axis>) -> Trace<Axis> {
    let start = Start {
        first: AxisMotion::moving(-0.02, SPEED_M_PER_S),
        from: Nanos(0),
        until: Nanos(2_000_000_000),
        noise,
        streams: Streams::new(7),
    };
    let mut trace = Trace::default();
    ClosedLoop::new(rig, effects, rates()).run(&start, clamps, ALL, &mut trace);
    trace
}

/// The closed loop with these effects.
fn closed(effects: &[Attached<Axis>], noise: SensorNoise) -> Trace<Axis> {
    impact(&cell(), effects, noise, &Clamps::default())
}

/// The commands of `nominal` again, whatever the effects do.
fn same_commands(effects: &[Attached<Axis>], nominal: &Trace<Axis>) -> Trace<Axis> {
    let clamps = Clamps { commanded: Some(&nominal.commanded), ..Clamps::default() };
    impact(&cell(), effects, SensorNoise::NONE, &clamps)
}

/// The kind with its parameters where a fit would start.
fn started(kind: &Kind<Axis>) -> Attached<Axis> {
    let values: Vec<f64> = kind.params.iter().map(|param| param.starts[0]).collect();
    kind.attach(&values)
}

fn attached(id: &str, values: &[f64]) -> Attached<Axis> {
    standard().get(id).expect("a kind of the catalogue").attach(values)
}

/// What the satellites felt that the contact absorbed, in J.
fn felt_energy_j(trace: &Trace<Axis>) -> f64 {
    let means = trace.commanded.iter().zip(&trace.after);
    let means: Vec<f64> = means.map(|(a, b)| (a.velocity_m_per_s + b.velocity_m_per_s) / 2.0).collect();
    observed_j(&trace.feedback, &means, 0.004)
}

/// What the device itself absorbed, in J, at the ticks of the sensor: every second physics step.
fn interface_energy_j(trace: &Trace<Axis>) -> f64 {
    let speeds: Vec<f64> = trace.achieved.iter().step_by(2).map(|motion| motion.velocity_m_per_s).collect();
    observed_j(&trace.interface, &speeds, 0.001)
}

/// The tick of the sensor at which the contact is deepest.
fn deepest(trace: &Trace<Axis>) -> usize {
    let depth = |&i: &usize| trace.touch[i].depth_m;
    (0..trace.touch.len()).max_by(|a, b| depth(a).total_cmp(&depth(b))).expect("a run has ticks")
}

fn depth_max_m(trace: &Trace<Axis>) -> f64 {
    trace.touch[deepest(trace)].depth_m
}

fn force_at_depth_n(trace: &Trace<Axis>) -> f64 {
    trace.interface[deepest(trace)]
}

fn reading_at_depth_n(trace: &Trace<Axis>) -> f64 {
    trace.sensed[deepest(trace)]
}

/// The reported pose after 0.4 s of free flight.
fn reported_in_flight_m(trace: &Trace<Axis>) -> f64 {
    trace.measured[100].position_m
}

/// How much the reported path bends from tick to tick, in all.
fn bends_m(trace: &Trace<Axis>) -> f64 {
    let bend = |w: &[AxisMotion]| (w[2].position_m - 2.0 * w[1].position_m + w[0].position_m).abs();
    trace.measured.windows(3).map(bend).sum()
}

/// The reading 40 ms after the nominal touch, where it grows fastest.
fn early_reading_n(trace: &Trace<Axis>) -> f64 {
    trace.sensed[628]
}

/// What an effect does to an observable.
enum Change {
    Rises,
    Falls,
    /// By this much, which follows from the nominal run.
    By(fn(&Trace<Axis>) -> f64),
}

use Change::{By, Falls, Rises};

/// Whether the loop is closed or gets the nominal commands again.
#[derive(Clone, Copy, PartialEq)]
enum Run {
    Closed,
    Same,
}

/// An effect, its parameters, how it runs, what is looked at, and how that changes.
type Row = (&'static str, &'static [f64], Run, fn(&Trace<Axis>) -> f64, Change);

const ROWS: &[Row] = &[
    ("asymmetric-damping", &[10.0], Run::Same, interface_energy_j, Rises),
    ("asymmetric-damping", &[10.0], Run::Closed, felt_energy_j, Rises),
    // Late, so that the loop creates energy: k δ of damping less.
    ("command-delay", &[0.004], Run::Closed, felt_energy_j, Falls),
    ("command-delay", &[0.004], Run::Same, reported_in_flight_m, By(|_| -SPEED_M_PER_S * 0.004)),
    ("command-jitter", &[0.001], Run::Same, bends_m, Rises),
    ("command-loss", &[0.02, 0.9], Run::Same, bends_m, Rises),
    ("contact-gap", &[5e-4], Run::Same, force_at_depth_n, By(|_| -STIFFNESS_N_PER_M * 5e-4)),
    ("contact-gap", &[-5e-4], Run::Same, force_at_depth_n, By(|_| STIFFNESS_N_PER_M * 5e-4)),
    ("contact-preload", &[0.5], Run::Same, force_at_depth_n, By(|_| 0.5)),
    ("coulomb-friction", &[0.3], Run::Same, interface_energy_j, Rises),
    ("coulomb-friction", &[0.3], Run::Closed, felt_energy_j, Rises),
    ("end-stop", &[0.003, 2e3], Run::Same, force_at_depth_n, By(|t| 2e3 * (depth_max_m(t) - 0.003))),
    ("force-bias", &[0.1], Run::Same, reading_at_depth_n, By(|_| 0.1)),
    ("force-bias-drift", &[0.02], Run::Same, reading_at_depth_n, By(|t| 0.02 * t.sensor_time[deepest(t)].seconds())),
    ("force-delay", &[0.004], Run::Closed, felt_energy_j, Falls),
    ("force-delay", &[0.004], Run::Same, early_reading_n, By(|t| t.sensed[624] - t.sensed[628])),
    ("force-lag", &[15.0, 1.0], Run::Closed, felt_energy_j, Falls),
    ("force-lag", &[15.0, 2.0], Run::Closed, felt_energy_j, Falls),
    // The reading is negative in contact: late is less negative.
    ("force-lag", &[15.0, 1.0], Run::Same, early_reading_n, Rises),
    ("force-scale", &[1.02], Run::Same, reading_at_depth_n, By(|t| 0.02 * reading_at_depth_n(t))),
    ("hunt-crossley", &[1e3], Run::Same, interface_energy_j, Rises),
    ("hunt-crossley", &[1e3], Run::Closed, felt_energy_j, Rises),
    ("hysteresis", &[0.3, 5e-4], Run::Same, interface_energy_j, Rises),
    ("hysteresis", &[0.3, 5e-4], Run::Closed, felt_energy_j, Rises),
    ("maxwell-branch", &[300.0, 0.15], Run::Same, interface_energy_j, Rises),
    ("maxwell-branch", &[300.0, 0.15], Run::Closed, felt_energy_j, Rises),
    ("measurement-delay", &[0.003], Run::Same, reported_in_flight_m, By(|_| -SPEED_M_PER_S * 0.003)),
    ("measurement-delay", &[0.00325], Run::Same, reported_in_flight_m, By(|_| -SPEED_M_PER_S * 0.00325)),
    ("measurement-delay", &[-0.003], Run::Same, reported_in_flight_m, By(|_| SPEED_M_PER_S * 0.003)),
    // The same lag as 16 ms of delay: 2 ζ / ωₙ at 10 Hz and 0.5.
    ("robot-second-order", &[10.0, 0.5], Run::Closed, felt_energy_j, Falls),
    (
        "robot-second-order",
        &[10.0, 0.5],
        Run::Same,
        reported_in_flight_m,
        By(|_| -SPEED_M_PER_S / (20.0 * std::f64::consts::PI)),
    ),
    (
        "stiffness-hardening",
        &[3e6],
        Run::Same,
        force_at_depth_n,
        By(|t| 3e6 * depth_max_m(t) * depth_max_m(t) * depth_max_m(t)),
    ),
    ("stiffness-hardening", &[3e6], Run::Closed, depth_max_m, Falls),
    (
        "stiffness-power-law",
        &[1.1],
        Run::Same,
        force_at_depth_n,
        By(|t| STIFFNESS_N_PER_M * depth_max_m(t) * ((depth_max_m(t) / 0.005).powf(0.1) - 1.0)),
    ),
    // It slows down in contact, so that the flange holds the mass back.
    ("tool-inertia", &[1.0], Run::Same, reading_at_depth_n, By(|t| -t.achieved[2 * deepest(t)].acceleration_m_per_s2)),
    // Nothing turns in this run; `a_turned_tool_weighs_its_sine` turns it.
    ("tool-weight", &[1.0], Run::Same, reading_at_depth_n, By(|_| 0.0)),
];

/// Rounding of sums over 4000 steps of numbers of order one; the free oscillation of 10 Hz and 0.5 that the start of a run
/// excites has fallen to 0.14 mm × exp(-31.4 × 0.37) when it is looked at, less than 2e-9 m.
fn tolerance(id: &str, observed: f64) -> f64 {
    if id == "robot-second-order" { 2e-9 } else { 4000.0 * f64::EPSILON * observed.abs().max(1.0) }
}

#[test]
fn sign_and_size_are_as_derived() {
    let nominal = closed(&[], SensorNoise::NONE);
    for (id, values, run, observe, change) in ROWS {
        let effects = [attached(id, values)];
        let changed = match run {
            Run::Closed => closed(&effects, SensorNoise::NONE),
            Run::Same => same_commands(&effects, &nominal),
        };
        let (before, after) = (observe(&nominal), observe(&changed));
        println!("{id} {values:?}: {before:.6} -> {after:.6}");
        match change {
            Rises => assert!(after > before, "{id} {values:?} should raise {before}, gives {after}"),
            Falls => assert!(after < before, "{id} {values:?} should lower {before}, gives {after}"),
            By(expected) => {
                let miss = after - before - expected(&nominal);
                assert!(miss.abs() <= tolerance(id, before), "{id} {values:?}: {before} -> {after}, off by {miss:e}");
            }
        }
    }
    for kind in standard().kinds().iter().filter(|kind| kind.wires != [Wire::Recorder]) {
        assert!(ROWS.iter().any(|row| row.0 == kind.id), "{} has no row", kind.id);
    }
}

#[test]
fn off_is_the_identity_to_the_last_bit() {
    let nominal = closed(&[], NOISE).fingerprint();
    for kind in standard().kinds() {
        let off = kind.attach(&kind.off());
        assert_eq!(off.effect.stamp_offset_s().to_bits(), 0.0_f64.to_bits(), "{}", kind.id);
        assert_eq!(closed(&[off], NOISE).fingerprint(), nominal, "{} is not off", kind.id);
    }
}

#[test]
fn on_changes_the_run_and_two_runs_are_the_same() {
    let nominal = closed(&[], NOISE).fingerprint();
    for kind in standard().kinds() {
        let once = closed(&[started(kind)], NOISE).fingerprint();
        assert_eq!(once, closed(&[started(kind)], NOISE).fingerprint(), "{} differs from run to run", kind.id);
        // Nothing turns here, and a weight across the axis is not felt.
        let in_loop = kind.wires != [Wire::Recorder] && kind.id != "tool-weight";
        assert_eq!(once != nominal, in_loop, "{}: a loop effect is felt, a recorder effect is not", kind.id);
    }
    // The recorder's only effect says what it does.
    assert_eq!(attached("clock-offset", &[0.002]).effect.stamp_offset_s().to_bits(), 0.002_f64.to_bits());
}

/// Pairs (force, travel) at the ticks of the sensor are an upper sum of a force that grows along the path, so that the
/// comparison is exact up to rounding: no term for the sampling is needed.
#[test]
fn passive_effects_create_no_energy() {
    let nominal = closed(&[], SensorNoise::NONE);
    let again = same_commands(&[], &nominal);
    let terms = again.interface.iter().zip(again.achieved.iter().step_by(2));
    let moved: f64 = terms.map(|(force, motion)| (force * motion.velocity_m_per_s * 0.001).abs()).sum();
    let rounding_j = nominal.interface.len() as f64 * f64::EPSILON * moved;
    let passive = [
        "asymmetric-damping",
        "contact-preload",
        "coulomb-friction",
        "end-stop",
        "hunt-crossley",
        "hysteresis",
        "maxwell-branch",
        "stiffness-hardening",
    ];
    for id in passive {
        let catalog = standard();
        let kind = catalog.get(id).expect("a kind of the catalogue");
        for choice in 0..kind.params.iter().map(|param| param.starts.len()).max().unwrap_or(1) {
            let values: Vec<f64> = kind.params.iter().map(|p| p.starts[choice.min(p.starts.len() - 1)].abs()).collect();
            let extra_j =
                interface_energy_j(&same_commands(&[kind.attach(&values)], &nominal)) - interface_energy_j(&again);
            println!("{id} {values:?}: {extra_j:e} J");
            assert!(extra_j >= -rounding_j, "{id} {values:?} created {} J", -extra_j);
        }
    }
}

#[test]
fn nobody_shifts_another_ones_random_numbers() {
    let jitter = || attached("command-jitter", &[0.001]);
    let loss = || attached("command-loss", &[0.1, 0.5]);
    let late = |trace: &Trace<Axis>| -> Vec<u64> { trace.received.iter().map(|r| r.late_s.to_bits()).collect() };
    let lost = |trace: &Trace<Axis>| -> Vec<bool> { trace.received.iter().map(|r| r.lost).collect() };
    let alone = late(&closed(&[jitter()], NOISE));
    let lost_alone = lost(&closed(&[loss()], NOISE));
    assert!(lost_alone.contains(&true), "nothing was lost");
    assert_eq!(lost(&closed(&[jitter(), loss()], NOISE)), lost_alone, "jitter shifted the losses");
    for kind in standard().kinds().iter().filter(|kind| kind.id != "command-jitter") {
        let one = closed(&[jitter(), started(kind)], NOISE);
        let other = closed(&[started(kind), jitter()], NOISE);
        assert_eq!(one.fingerprint(), other.fingerprint(), "{}: the order of the list matters", kind.id);
        if kind.id != "command-delay" {
            assert_eq!(late(&one), alone, "{} shifted the jitter's numbers", kind.id);
        }
    }
}

/// {read-out δ, force delay δ} and {command delay δ} give the same commands (PHYSICS.md, correction 2). Not the same bits, since
/// the robot asks for its pose at other times: a rounding of 2e-17 m in each of 4000 steps.
#[test]
fn two_late_readings_are_one_late_command() {
    let command = closed(&[attached("command-delay", &[0.004])], SensorNoise::NONE);
    let delays = [attached("measurement-delay", &[0.004]), attached("force-delay", &[0.004])];
    let readings = closed(&delays, SensorNoise::NONE);
    let miss = command.commanded.iter().zip(&readings.commanded).map(|(a, b)| (a.position_m - b.position_m).abs());
    let worst = miss.fold(0.0, f64::max);
    assert!(worst <= 4000.0 * 2e-17, "the commands differ by {worst:e} m");
}
