//! The loop itself: what a step may cost, what a run may leave out, and what it refuses.

mod along;
mod facility;
mod space;

use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::compensator::Hybrid;
use sim_core::contact::{Sides, SpringDashpot};
use sim_core::effect::{Attached, Catalog, Kind, Rates, Reads};
use sim_core::effects::standard;
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::rig::{DockingAxis, Rig};
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::space::{Axis, AxisMotion, Space};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};
use std::hint::black_box;

const NOISE: SensorNoise = SensorNoise { white_n: 0.08, slow_n: 0.02, memory: 0.99, quantum_n: 1e-3 };

/// Every wire of the facility: 63.2 kg, 1066 N/m, 16 ms there and 16 ms back.
fn cell() -> DockingAxis {
    DockingAxis {
        plant: PointMass::of_mass(63.2),
        link: Link { dead_time_s: 0.016 },
        robot: StraightLine { corner_s: 0.004, averaging_s: 0.002 },
        readout: Readout { delay_s: 0.016 },
        law: SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 6.0, sides: Sides::One },
        sensor: AxisCell { tool_weight_n: 73.5, bias_n: 2.1 },
        noise: SensorNoise::NONE,
        compensator: Hybrid {
            bias_n: 2.1,
            tool_weight_n: 73.5,
            virtual_damping_n_s_per_m: 40.0,
            dead_band_n: 0.25,
            ..Hybrid::default()
        },
    }
}

fn rates() -> Rates {
    Rates {
        physics_step: Nanos(1_000_000),
        loop_period: Nanos(4_000_000),
        loop_phase: Nanos(0),
        sensor_period: Nanos(1_000_000),
        sensor_phase: Nanos(0),
    }
}

/// Begins so that no physics step lies at the onset of the contact, where rounding would decide.
fn start(until_s: f64, noise: SensorNoise) -> Start<Axis> {
    Start {
        first: AxisMotion::moving(-0.010_13, 0.035),
        from: Nanos(0),
        until: Nanos::from_seconds(until_s),
        noise,
        streams: Streams::new(7),
    }
}

fn run<S: Space, R: Rig<S>>(rig: &R, effects: &[Attached<S>], start: &Start<S>, columns: Columns) -> Trace<S> {
    let mut trace = Trace::default();
    ClosedLoop::new(rig, effects, rates()).run(start, &Clamps::default(), columns, &mut trace);
    trace
}

/// The kind with its parameters where a fit would start.
fn started<S: Space>(kind: &Kind<S>) -> Attached<S> {
    let values: Vec<f64> = kind.params.iter().map(|param| param.starts[0]).collect();
    kind.attach(&values)
}

/// Allocations of a run of this length whose trace has its memory already.
fn allocations<S: Space, R: Rig<S>>(rig: &R, effects: &[Attached<S>], start: &Start<S>, columns: Columns) -> u64 {
    let looped = ClosedLoop::new(rig, effects, rates());
    let mut trace = Trace::default();
    looped.run(start, &Clamps::default(), columns, &mut trace);
    trace.clear();
    allocation_counter::measure(|| looped.run(start, &Clamps::default(), columns, &mut trace)).count_total
}

/// A run allocates its state once, however long it is: a step allocates nothing.
fn check_no_step_allocates<S: Space, R: Rig<S>>(rig: &R, catalog: &Catalog<S>, start: impl Fn(f64) -> Start<S>) {
    let all = Columns { loop_ticks: true, sensor_ticks: true, achieved: true, measured: true };
    let none = Columns { loop_ticks: false, sensor_ticks: false, achieved: false, measured: false };
    let mut cases: Vec<Vec<Attached<S>>> = vec![vec![]];
    cases.extend(catalog.kinds().iter().map(|kind| vec![started(kind)]));
    cases.push(catalog.kinds().iter().map(started).collect());
    for effects in &cases {
        for columns in [none, Columns::LOG, all] {
            let [short, long] = [0.5, 2.0].map(|until_s| allocations(rig, effects, &start(until_s), columns));
            assert_eq!(short, long, "{:?}", effects.iter().map(|effect| &effect.id).collect::<Vec<_>>());
            // The history, the robot's commands before the first tick and from then on, and for effects their numbers, spans and
            // streams.
            assert!(long <= 6, "{long} allocations");
        }
    }
}

#[test]
fn no_step_of_a_loop_allocates() {
    let counted = allocation_counter::measure(|| drop(black_box(Vec::<u8>::with_capacity(10))));
    assert_eq!(counted.count_total, 1, "the counter counts");
    check_no_step_allocates(&cell(), &standard(), |until_s| start(until_s, NOISE));
}

/// A run computes accelerations, and motions between ticks, only where something says that it reads them. Whoever says no must
/// tell the truth: the same run with all of them gives the same log.
#[test]
fn who_reads_little_makes_nothing_of_the_rest() {
    let with = Columns { achieved: true, measured: true, ..Columns::LOG };
    for kind in standard().kinds() {
        let effects = [started(kind)];
        let [lean, full] = [Columns::LOG, with].map(|columns| run(&cell(), &effects, &start(2.0, NOISE), columns));
        let bare = Trace { achieved: Vec::new(), measured_steps: Vec::new(), ..full.clone() };
        assert_eq!(lean.fingerprint(), bare.fingerprint(), "{}", kind.id);
        assert!(full.achieved.iter().any(|motion| motion.acceleration_m_per_s2 != 0.0));
        let reads = match kind.id.as_ref() {
            "tool-inertia" => Reads::Accelerations,
            "tool-weight" => Reads::Motions,
            _ => Reads::Loads,
        };
        assert_eq!(effects[0].effect.reads(), reads, "{}", kind.id);
    }
}

/// Clocks that tick at their phases, and in a run that begins late at the ticks that are left.
#[test]
fn clocks_tick_at_their_phase_and_period() {
    let shifted = Rates { loop_phase: Nanos(3_000_000), sensor_phase: Nanos(1_000_000), ..rates() };
    let achieved = vec![AxisMotion::moving(-0.01, 0.0); 15];
    let clamps = Clamps { achieved: Some(&achieved), ..Clamps::default() };
    for (from, first_loop, first_sensor) in [(0, 3, 1), (1, 3, 1), (3, 3, 3), (4, 7, 4)] {
        let run = Start { from: Nanos(from * 1_000_000), until: Nanos(15_000_000), ..start(0.0, NOISE) };
        let mut trace = Trace::default();
        ClosedLoop::new(&cell(), &[], shifted).run(&run, &clamps, Columns::LOG, &mut trace);
        let ticks = |first: i64, period: i64| (0..).map(move |i| Nanos((first + i * period) * 1_000_000));
        let loops: Vec<Nanos> = ticks(first_loop, 4).take_while(|time| time.0 < 15_000_000).collect();
        let sensors: Vec<Nanos> = ticks(first_sensor, 1).take_while(|time| time.0 < 15_000_000).collect();
        assert_eq!((&trace.loop_time, &trace.sensor_time), (&loops, &sensors), "from {from} ms");
    }
}

#[test]
fn a_loop_without_meaning_is_refused() {
    let refused = |change: &dyn Fn(&mut DockingAxis, &mut Rates)| {
        let (mut rig, mut rates) = (cell(), rates());
        change(&mut rig, &mut rates);
        ClosedLoop::checked(&rig, &[], rates).map(|_| ()).unwrap_err().to_string()
    };
    assert!(ClosedLoop::checked(&cell(), &[], rates()).is_ok());
    assert_eq!(
        refused(&|_, rates| rates.physics_step = Nanos(3_000_000)),
        "physics_step_s = 0.003 s does not divide the period of the loop"
    );
    assert_eq!(refused(&|_, rates| rates.physics_step = Nanos(0)), "physics_step_s = 0 s is not above 0");
    assert_eq!(
        refused(&|_, rates| rates.sensor_phase = Nanos(500_000)),
        "physics_step_s = 0.001 s does not divide the phase of the sensor"
    );
    assert_eq!(refused(&|_, rates| rates.loop_period = Nanos(0)), "loop_period_s = 0 s is not above 0");
    assert_eq!(refused(&|rig, _| rig.link.dead_time_s = -0.001), "dead_time_s = -0.001 s is below 0");
    assert_eq!(refused(&|rig, _| rig.readout.delay_s = f64::NAN), "delay_s = NaN s is not a finite number");
    assert_eq!(refused(&|rig, _| rig.robot.averaging_s = 0.0), "averaging_s = 0 s is not above 0");
}
