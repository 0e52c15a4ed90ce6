//! The loop with six axes: the one-axis loop where all lies on z, and what two bodies keep when it does not.

use super::{allocations, cell, check_no_step_allocates, run, start};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sim_core::compensator::{Architecture, AxisPair, HybridSpace};
use sim_core::contact::{Sides, SpringDashpot};
use sim_core::effect::catalog_along;
use sim_core::effects::standard;
use sim_core::force_sensor::{SensorNoise, SpaceCell, WrenchNoise};
use sim_core::frames::Pose;
use sim_core::geometry::Plane;
use sim_core::link::Link;
use sim_core::plant::{Body, BodyMotion, Integrator, Plant, TwoBody};
use sim_core::readout::Readout;
use sim_core::rig::DockingSpace;
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::space::{Axis, Motion, Spatial, Wrench};
use sim_core::time::{Nanos, Step};
use sim_core::trace::{Columns, Trace};

const LAW: SpringDashpot = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 6.0, sides: Sides::One };
const CHASER_KG: f64 = 90.0;

/// The same cell in space: two satellites with the same reduced mass, everything on the z axis, none of it turned.
pub(super) fn aligned() -> DockingSpace<Plane, SpringDashpot> {
    let one = cell();
    let target_kg = CHASER_KG * one.plant.mass_kg / (CHASER_KG - one.plant.mass_kg);
    let body = |mass_kg| Body::new(mass_kg, Matrix3::from_diagonal_element(10.0)).unwrap();
    let (probe, nozzle) = (Pose::at(Vector3::z() * 0.6), Pose::at(Vector3::z() * -0.8));
    let plant = TwoBody::new(body(CHASER_KG), body(target_kg), probe, nozzle, Integrator::ExactHold).unwrap();
    let bias = Wrench { force_n: Vector3::z() * one.sensor.bias_n, torque_n_m: Vector3::zeros() };
    let sensor = SpaceCell::level(one.sensor.tool_weight_n, bias);
    DockingSpace {
        plant,
        link: one.link,
        robot: one.robot,
        readout: one.readout,
        geometry: Plane,
        law: one.law,
        sensor,
        noise: WrenchNoise::NONE,
        compensator: HybridSpace {
            virtual_damping: AxisPair {
                along: Vector3::z() * one.compensator.virtual_damping_n_s_per_m,
                about: Vector3::zeros(),
            },
            dead_band_n: one.compensator.dead_band_n,
            dead_band_n_m: 0.01,
            ..HybridSpace::new(sensor)
        },
    }
}

pub(super) fn level_start(until_s: f64) -> sim_core::closed_loop::Start<Spatial> {
    let one = start(until_s, SensorNoise::NONE);
    sim_core::closed_loop::Start {
        first: Motion {
            position_m: Vector3::z() * one.first.position_m,
            velocity_m_per_s: Vector3::z() * one.first.velocity_m_per_s,
            ..Motion::default()
        },
        from: one.from,
        until: one.until,
        noise: WrenchNoise::NONE,
        streams: one.streams,
    }
}

/// Both runs agree to rounding, and in space nothing leaves the z axis.
///
/// Each of 500 ticks rounds some 8 positions of up to 1 m: at most 4.4e-13 m. A shift of x in a contact of 0.77 s changes the
/// speed by k x 0.77 s / m = 13 x per second, over the second that follows: 17 times that, with the device's own stiffness at
/// most doubled by an effect, 34 times: 1.5e-11 m. Of a force: twice the stiffness times that, and 300 N s/m (the steepest
/// effect) times 1.5e-11 m in a second.
pub(super) fn as_in_space(one: &Trace<Axis>, six: &Trace<Spatial>, label: &str) {
    const SHIFT_M: f64 = 1.5e-11;
    let allowed_n = (2.0 * 1066.0 + 300.0) * SHIFT_M;
    let motions = [(&one.commanded, &six.commanded), (&one.measured, &six.measured), (&one.after, &six.after)];
    for (one, six) in motions {
        assert_eq!(one.len(), six.len());
        for (one, six) in one.iter().zip(six) {
            let off_m = (six.position_m - Vector3::z() * one.position_m).norm();
            assert!(off_m <= SHIFT_M, "{label}: {off_m} m");
            assert!(six.attitude == UnitQuaternion::identity(), "{label}");
        }
    }
    let force = |wrench: &Wrench| {
        assert!(wrench.force_n.x == 0.0 && wrench.torque_n_m == Vector3::zeros(), "{label}: {wrench:?}");
        wrench.force_n.z
    };
    let off_n = |one: f64, six: f64| assert!((one - six).abs() <= allowed_n, "{label}: {one} N, {six} N");
    one.interface.iter().zip(&six.interface).for_each(|(one, six)| off_n(*one, -force(six)));
    one.feedback.iter().zip(&six.feedback).for_each(|(one, six)| off_n(*one, -force(six)));
    one.sensed.iter().zip(&six.sensed).for_each(|(one, six)| off_n(*one, force(six)));
    assert!(one.interface.iter().any(|&force_n| force_n > 1.0), "{label}: it touches");
}

#[test]
fn on_its_axis_the_loop_with_six_axes_is_the_loop_with_one() {
    let one = run(&cell(), &[], &start(2.0, SensorNoise::NONE), Columns::LOG);
    let six = run(&aligned(), &[], &level_start(2.0), Columns::LOG);
    as_in_space(&one, &six, "nominal");
}

/// Nothing cancels by symmetry: interfaces off centre and askew, a tumbling target, a cone, friction, a sensor of its own frame.
pub(super) mod askew {
    use super::*;
    use sim_core::closed_loop::Start;
    use sim_core::contact::{Friction, SMOOTHING_M_PER_S};
    use sim_core::geometry::Cone;

    fn turn(x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))
    }

    pub fn bodies() -> TwoBody {
        let inertia = |xx, yy, zz, xy| Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, zz);
        let chaser = Body::new(60.0, inertia(3.0, 4.0, 5.0, 0.3)).unwrap();
        let target = Body::new(200.0, inertia(20.0, 30.0, 35.0, -2.0)).unwrap();
        let probe = Pose::new(Vector3::new(0.1, -0.2, 0.6), turn(0.02, 0.01, -0.3));
        let nozzle = Pose::new(Vector3::new(-0.3, 0.1, -0.8), turn(3.0, 0.1, 0.2));
        let tumbling = BodyMotion {
            position_m: Vector3::new(0.4, 0.3, -0.2),
            attitude: turn(0.3, -0.5, 0.2),
            velocity_m_per_s: Vector3::new(0.01, -0.02, 0.03),
            rate_rad_per_s: Vector3::new(0.02, 0.03, -0.02),
        };
        TwoBody::new(chaser, target, probe, nozzle, Integrator::ExactHold).unwrap().with_target(tumbling).unwrap()
    }

    pub fn cell() -> DockingSpace<Cone, Friction<SpringDashpot>> {
        let wrench = |force: f64, torque: f64| Wrench {
            force_n: Vector3::new(force, -0.5 * force, 0.7 * force),
            torque_n_m: Vector3::new(-torque, torque, 0.3 * torque),
        };
        let sensor = SpaceCell {
            mounting: turn(0.1, 0.2, 0.7),
            tip_m: Vector3::new(0.01, 0.02, 0.15),
            tool_weight_n: 73.5,
            tool_centre_m: Vector3::new(0.01, -0.02, 0.05),
            gravity: -Vector3::y(),
            bias: wrench(2.1, 0.1),
        };
        DockingSpace {
            plant: bodies(),
            link: Link { dead_time_s: 0.016 },
            robot: StraightLine { corner_s: 0.004, averaging_s: 0.002 },
            readout: Readout { delay_s: 0.0165 },
            geometry: Cone::new(0.2, 0.05, 0.8, 0.02).unwrap(),
            law: Friction::new(LAW, 0.1, SMOOTHING_M_PER_S).unwrap(),
            sensor,
            noise: WrenchNoise::NONE,
            compensator: HybridSpace {
                virtual_damping: AxisPair { along: Vector3::z() * 40.0, about: Vector3::z() * 0.5 },
                onset_m: 0.13,
                dead_band_n: 0.25,
                dead_band_n_m: 0.02,
                ..HybridSpace::new(sensor)
            },
        }
    }

    pub fn start(until_s: f64) -> Start<Spatial> {
        Start {
            first: Motion {
                position_m: Vector3::new(0.03, -0.02, 0.11),
                attitude: turn(0.03, -0.02, 0.4),
                velocity_m_per_s: Vector3::new(0.002, -0.001, 0.035),
                rate_rad_per_s: Vector3::new(-0.01, 0.02, 0.005),
                acceleration_m_per_s2: Vector3::zeros(),
            },
            from: Nanos(0),
            until: Nanos::from_seconds(until_s),
            noise: WrenchNoise::NONE,
            streams: Streams::new(7),
        }
    }
}

/// Linear and angular momentum about the global origin, of chaser and target.
fn momenta(plant: &TwoBody, motions: &[BodyMotion; 2]) -> [(Vector3<f64>, Vector3<f64>); 2] {
    [0, 1].map(|i| {
        let (body, motion) = (&plant.bodies()[i], &motions[i]);
        let linear = motion.velocity_m_per_s * body.mass_kg();
        let spin = motion.attitude * (body.inertia_kg_m2() * motion.rate_rad_per_s);
        (linear, motion.position_m.cross(&linear) + spin)
    })
}

/// The feedback is a wrench at the current probe tip: action and reaction share their point, however late the wrench is.
#[test]
fn both_bodies_keep_their_momentum_in_contact() {
    let rig = askew::cell();
    let start = askew::start(2.0);
    let trace = run(&rig, &[], &start, Columns::LOG);
    let mut state = rig.plant.start(&start.first);
    let before = momenta(&rig.plant, &rig.plant.motions(&state));
    for (i, (feedback, after)) in trace.feedback.iter().zip(&trace.after).enumerate() {
        let step = Step { index: i as u64, now: trace.loop_time[i], dt: Nanos(4_000_000) };
        rig.plant.step(&mut state, step, feedback);
        assert_eq!(rig.plant.motion(&state), *after, "the loop did the same");
    }
    let after = momenta(&rig.plant, &rig.plant.motions(&state));
    // 500 ticks of some 32 roundings of numbers up to 20 N s and N m s.
    let rounding = 500.0 * 32.0 * f64::EPSILON * 20.0;
    let linear = after[0].0 + after[1].0 - before[0].0 - before[1].0;
    let angular = after[0].1 + after[1].1 - before[0].1 - before[1].1;
    assert!(linear.norm() <= rounding && angular.norm() <= rounding, "{linear} {angular}");
    assert!((after[0].0 - before[0].0).norm() > 0.1 && (after[0].1 - before[0].1).norm() > 0.1, "it was pushed");
}

/// Known tool and bias leave nothing, at any attitude, once the pose stands still: the sensor feels exactly the contact.
#[test]
fn a_known_tool_is_taken_out_at_any_attitude() {
    let mut rig = askew::cell();
    rig.compensator = HybridSpace::new(rig.sensor);
    let mut start = askew::start(0.4);
    start.first.velocity_m_per_s = Vector3::zeros();
    start.first.rate_rad_per_s = Vector3::zeros();
    rig.plant = TwoBody::new(
        rig.plant.bodies()[0],
        Body::fixed(),
        Pose::at(Vector3::new(0.1, -0.2, 0.6)),
        Pose::default(),
        Integrator::ExactHold,
    )
    .unwrap();
    // Beside the wall and pressed against it, without friction: what comes back is what the interface carries.
    for depth_m in [-0.01, 0.003] {
        start.first.position_m = Vector3::new(0.03, 0.0, 0.11 + depth_m);
        let trace = run(&rig, &[], &start, Columns::LOG);
        let (felt, truth) = (trace.feedback[0], trace.interface[0]);
        // Two turns there and two back of numbers up to 74 N, and 11 N m.
        let rounding = 64.0 * f64::EPSILON * 74.0;
        assert!((felt.force_n - truth.force_n).norm() <= rounding, "{felt:?} {truth:?}");
        assert!((felt.torque_n_m - truth.torque_n_m).norm() <= rounding, "{felt:?} {truth:?}");
        assert!(trace.sensed[0].force_n.norm() > 70.0, "the weight is there");
    }
}

/// A virtual torsional damper turns what is left of a spin about z into heat: τ_z = -b ω_z, late by 32 ms and a tick.
#[test]
fn virtual_torsional_damping_ends_a_spin() {
    let mut rig = aligned();
    rig.compensator.virtual_damping.about = Vector3::z() * 2.0;
    // A weight that is taken out at an attitude 16 ms old would push across the axis.
    (rig.sensor.tool_weight_n, rig.compensator.known.tool_weight_n) = (0.0, 0.0);
    let mut start = level_start(1.0);
    start.first.rate_rad_per_s = Vector3::z() * 0.05;
    start.first.position_m.z = 0.001;
    start.first.velocity_m_per_s = Vector3::zeros();
    let trace = run(&rig, &[], &start, Columns::LOG);
    let (first, last) = (trace.feedback[0].torque_n_m, trace.after.iter().take_while(|m| m.position_m.z > 0.0).last());
    // The first tick feels the spin of 0.05 rad/s as it was: its attitude is turned back over one tick, exact to rounding.
    assert!((first - Vector3::new(0.0, 0.0, -0.1)).norm() < 1e-12, "{first}");
    let last = last.unwrap();
    assert!(last.rate_rad_per_s.z < 0.05 && last.rate_rad_per_s.z > 0.0, "{last:?}");
    // 250 ticks of some eight roundings of 0.05 rad/s.
    assert!(last.rate_rad_per_s.xy().norm() <= 250.0 * 8.0 * f64::EPSILON * 0.05, "{last:?}");
}

/// The three architectures of thesis Fig. 3.1 are settings: what one does not listen to makes no difference to it.
#[test]
fn each_architecture_listens_to_its_own_contact() {
    let feedback = |architecture: Architecture, sensor_off_n: f64, virtual_damping: f64| {
        let mut rig = askew::cell();
        rig.compensator.architecture = architecture;
        rig.compensator.virtual_damping.along.z = virtual_damping;
        rig.sensor.bias.force_n.x += sensor_off_n;
        run(&rig, &[], &askew::start(2.0), Columns::LOG).feedback
    };
    use Architecture::{Hybrid, PureHardware, PureSoftware};
    assert_eq!(feedback(PureHardware, 0.0, 40.0), feedback(PureHardware, 0.0, 70.0));
    assert_ne!(feedback(PureHardware, 0.0, 40.0), feedback(PureHardware, 1.0, 40.0));
    assert_eq!(feedback(PureSoftware, 0.0, 40.0), feedback(PureSoftware, 1.0, 40.0));
    assert_ne!(feedback(PureSoftware, 0.0, 40.0), feedback(PureSoftware, 0.0, 70.0));
    assert_ne!(feedback(Hybrid, 0.0, 40.0), feedback(Hybrid, 1.0, 40.0));
    assert_ne!(feedback(Hybrid, 0.0, 40.0), feedback(Hybrid, 0.0, 70.0));
    let hybrid = feedback(Hybrid, 0.0, 40.0);
    let first = hybrid.iter().position(|wrench| *wrench != Wrench::default()).unwrap();
    let alone = [PureHardware, PureSoftware].map(|architecture| feedback(architecture, 0.0, 40.0)[first]);
    // Until this tick all three have moved alike: what the hybrid feels is the sum.
    assert_eq!(hybrid[first], alone[0] + alone[1]);
}

#[test]
fn no_step_in_space_allocates() {
    let noise = WrenchNoise { force: [super::NOISE; 3], torque: [super::NOISE; 3] };
    let start = |until_s: f64| sim_core::closed_loop::Start { noise, ..askew::start(until_s) };
    check_no_step_allocates(&askew::cell(), &catalog_along(&standard()), start);
    assert!(allocations(&askew::cell(), &[], &start(0.1), Columns::LOG) > 0, "the state of a run is counted");
}
