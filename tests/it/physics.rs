//! Physics against numbers that were computed elsewhere: `reference/PHYSICS.md`, section 2, computed there in Python.

use harness::blocks::{Base, docking_rig};
use harness::model::from_session;
use harness::recording::{ReadOptions, read};
use nalgebra::{UnitQuaternion, Vector3};
use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::force_sensor::SensorNoise;
use sim_core::restitution::from_speeds;
use sim_core::rng::Streams;
use sim_core::robot::{Robot, StraightLine};
use sim_core::space::{Axis, AxisMotion, Motion, Spatial};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// The cell of a recording, with this much virtual damping, and its impact at 35 mm/s without noise.
fn impact(damping_n_s_per_m: f64, sensor_phase: Nanos) -> Trace<Axis> {
    let recording = read(&fixtures::session("cell-a", "learn_01.mcap"), &ReadOptions::default()).unwrap();
    let model = from_session(&recording).unwrap();
    let mut rig = docking_rig(&model, &Base::of(&model), model.plant.mass_kg);
    rig.compensator.virtual_damping_n_s_per_m = damping_n_s_per_m;
    let rates = sim_core::effect::Rates {
        physics_step: Nanos(500_000),
        loop_period: Nanos(4_000_000),
        loop_phase: Nanos(0),
        sensor_period: Nanos(1_000_000),
        sensor_phase,
    };
    let start = Start {
        first: AxisMotion::moving(-0.01, 0.035),
        from: Nanos(0),
        until: Nanos(2_000_000_000),
        noise: SensorNoise::NONE,
        streams: Streams::new(1),
    };
    let mut trace = Trace::default();
    ClosedLoop::new(&rig, &[], rates).run(&start, &Clamps::default(), Columns::LOG, &mut trace);
    trace
}

#[test]
fn damping_takes_energy_and_delay_gives_it() {
    let restitution = |damping: f64| {
        let trace = impact(damping, Nanos(0));
        from_speeds(0.035, trace.after.last().unwrap().velocity_m_per_s)
    };
    let [none, some, much] = [0.0, 20.0, 70.0].map(restitution);
    assert!(none > 1.0, "a lossless spring behind 16 ms of delay creates energy: {none}");
    assert!(some < none && much < some && much < 1.0, "{none} {some} {much}");
}

#[test]
fn the_phase_between_the_clocks_is_a_parameter() {
    let speed = |phase: i64| impact(40.0, Nanos(phase)).after.last().unwrap().velocity_m_per_s;
    // A sample that is half a period older is half a millisecond of delay: 0.5 N s/m of a damping of 40.
    let (same, older) = (speed(0), speed(500_000));
    assert!(older < same, "later samples create energy: {older} {same}");
    assert!((older - same).abs() < 0.01 * same.abs());
}

#[test]
fn a_robot_follows_straight_lines_in_space_too() {
    let robot = StraightLine { corner_s: 0.004, averaging_s: 0.002 };
    let pose = |x: f64, angle: f64| Motion {
        position_m: Vector3::new(x, 0.0, 0.0),
        attitude: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
        ..Motion::default()
    };
    let mut state = Robot::<Spatial>::start(&robot, &pose(0.0, 0.0), 0.016);
    robot.accept(&mut state, 0.020, &pose(0.004, 0.02));
    robot.accept(&mut state, 0.024, &pose(0.004, 0.02));
    let at = Robot::<Spatial>::motion(&robot, &mut state, 0.019);
    assert!((at.position_m.x - 0.003).abs() < 1e-15 && (at.velocity_m_per_s.x - 1.0).abs() < 1e-12);
    assert!((at.attitude.angle() - 0.015).abs() < 1e-9 && (at.rate_rad_per_s.z - 5.0).abs() < 1e-9);
    let rest = Robot::<Spatial>::motion(&robot, &mut state, 0.023);
    assert_eq!(rest.velocity_m_per_s, Vector3::zeros(), "the two last commands are the same");
}
