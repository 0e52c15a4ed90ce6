//! The facility's half of the loop, with the satellites outside, gives the bits of the closed loop.

use super::cell;
use sim_core::closed_loop::{Clamps, ClosedLoop, Facility, Start, Stepped};
use sim_core::compensator::{Compensator, Heard};
use sim_core::effect::{Attached, Rates, Where};
use sim_core::effects::standard;
use sim_core::force_sensor::SensorNoise;
use sim_core::plant::Plant;
use sim_core::rig::DockingAxis;
use sim_core::rng::Streams;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::{Nanos, Step};
use sim_core::trace::{Columns, Trace};

const RATES: Rates = Rates {
    physics_step: Nanos(500_000),
    loop_period: Nanos(4_000_000),
    loop_phase: Nanos(0),
    sensor_period: Nanos(1_000_000),
    sensor_phase: Nanos(1_000_000),
};

fn start() -> Start<Axis> {
    Start {
        first: AxisMotion::moving(-0.008, 0.035),
        from: Nanos(0),
        until: Nanos(1_600_000_000),
        noise: SensorNoise { white_n: 0.08, slow_n: 0.02, memory: 0.95, quantum_n: 1e-3 },
        streams: Streams::new(7),
    }
}

/// The satellites outside: what a controller at the other end of the wire computes.
fn outside(facility: &mut dyn Stepped<Axis>, rig: &DockingAxis, start: &Start<Axis>) -> Trace<Axis> {
    let (mut trace, mut sample) = (Trace::<Axis>::default(), None);
    let mut satellites = rig.plant.start(&start.first);
    let mut software = None;
    for index in 0..(start.until.0 / RATES.loop_period.0) as u64 {
        let seen = facility.report();
        let step = Step { index, now: seen.now, dt: RATES.loop_period };
        trace.sensed.extend(seen.sensed);
        sample = seen.sensed.last().copied().or(sample);
        let measured = seen.measured;
        let state = software.get_or_insert_with(|| rig.compensator.start(&measured, RATES.loop_period.seconds()));
        let commanded = rig.compensator.command(state, step, rig.plant.motion(&satellites));
        facility.command(commanded);
        let heard = Heard {
            sensed: sample.as_ref(),
            commanded: &commanded,
            measured: &measured,
            interface: &0.0,
            applied: 0.0,
        };
        let net_n = rig.compensator.feedback(state, step, heard);
        rig.plant.step(&mut satellites, step, &net_n);
        trace.commanded.push(commanded);
        trace.measured.push(measured);
        trace.feedback.push(net_n);
    }
    trace
}

fn bits(values: impl Iterator<Item = f64>) -> Vec<u64> {
    values.map(f64::to_bits).collect()
}

#[test]
fn stepped_from_outside_it_gives_the_bits_of_the_closed_loop() {
    let (rig, start) = (cell(), start());
    let catalog = standard();
    let kinds = catalog.kinds().iter().filter(|kind| kind.rigs != Where::Drive);
    let sets = kinds.map(|kind| {
        let values: Vec<f64> = kind.params.iter().map(|param| param.starts[0]).collect();
        (kind.id.to_string(), vec![kind.attach(&values)])
    });
    let none: (String, Vec<Attached<Axis>>) = ("nominal".into(), Vec::new());
    for (id, effects) in std::iter::once(none).chain(sets) {
        let looped = ClosedLoop::new(&rig, &effects, RATES);
        let mut whole = Trace::default();
        looped.run(&start, &Clamps::default(), Columns::LOG, &mut whole);
        let halves = outside(&mut Facility::new(&looped, &start), &rig, &start);
        let position = |trace: &Trace<Axis>| {
            let both = trace.commanded.iter().chain(&trace.measured);
            bits(both.map(|motion| motion.position_m).chain(trace.feedback.iter().copied()))
        };
        assert!(position(&whole) == position(&halves), "{id}: poses and net forces");
        // The closed loop ends with the readings up to its last physics step, the facility with its last report.
        let length = halves.sensed.len();
        assert!(length + 4 >= whole.sensed.len() && length > 1500, "{id}: {length} of {}", whole.sensed.len());
        let sensed = |trace: &Trace<Axis>| bits(trace.sensed[..length].iter().copied());
        assert!(sensed(&whole) == sensed(&halves), "{id}: readings");
    }
}

#[test]
fn a_step_allocates_nothing() {
    let (rig, start) = (cell(), start());
    let effects: Vec<Attached<Axis>> = Vec::new();
    let looped = ClosedLoop::new(&rig, &effects, RATES);
    let mut facility = Facility::new(&looped, &start);
    // The robot takes its place at the first tick.
    facility.report();
    facility.command(start.first);
    let mut position_m = 0.0;
    let counted = allocation_counter::measure(|| {
        for tick in 0..1000 {
            position_m += facility.report().measured.position_m;
            facility.command(AxisMotion::moving(-0.008 + 1e-5 * f64::from(tick), 0.0025));
        }
    });
    assert_eq!(counted.count_total, 0, "{position_m}");
}

#[test]
fn a_command_that_is_not_given_is_given_again() {
    let (rig, start) = (cell(), start());
    let effects: Vec<Attached<Axis>> = Vec::new();
    let looped = ClosedLoop::new(&rig, &effects, RATES);
    let mut facility = Facility::new(&looped, &start);
    let still = AxisMotion::moving(-0.005, 0.0);
    for _ in 0..3 {
        facility.report();
        facility.command(still);
    }
    // Dead time and read-back are 32 ms: eight ticks, and one for the line that leads there.
    let reported: Vec<f64> = (0..12).map(|_| facility.report().measured.position_m).collect();
    assert!(reported[0] < -0.007, "{reported:?}");
    assert!((reported[11] + 0.005).abs() < 1e-15, "{reported:?}");
}
