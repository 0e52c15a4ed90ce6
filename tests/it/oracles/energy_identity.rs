//! O8: `reference/PHYSICS.md`, section 4.1: what a held force changes of the energy of a step, exactly; momentum with it.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sim_core::audit::{Account, Audit, axis_energy_defect};
use sim_core::frames::Pose;
use sim_core::plant::{Body, BodyMotion, Integrator, Plant, PointMass, TwoBody};
use sim_core::rng::Streams;
use sim_core::space::{AxisMotion, Motion, Wrench};
use sim_core::time::{Nanos, Step};

/// The tolerance of the oracle.
const RELATIVE: f64 = 1e-12;
const TICK: Step = Step { index: 0, now: Nanos(0), dt: Nanos(4_000_000) };

/// 63.2 kg at 0.035 m/s on 1066 N/m without loss, at 250 Hz: the reference scale of section 1.5.
#[test]
fn along_one_axis_the_mean_velocity_balances_every_tick() {
    let plant = PointMass::of_mass(63.2);
    let mut state = plant.start(&AxisMotion::moving(0.0, 0.035));
    let tick_s = TICK.dt.seconds();
    let (mut mean_j, mut before_j, mut squares_n2) = (0.0, 0.0, 0.0);
    let start_j: f64 = 0.5 * 63.2 * 0.035 * 0.035;
    assert!((start_j - 38.7e-3).abs() < 0.05e-3, "38.7 mJ: {start_j}");
    loop {
        let force_n = 1066.0 * state.position_m;
        let before = state.velocity_m_per_s;
        plant.step(&mut state, TICK, &force_n);
        let after = state.velocity_m_per_s;
        assert!(axis_energy_defect(63.2, before, after, tick_s, force_n) < RELATIVE);
        mean_j += tick_s * force_n * 0.5 * (before + after);
        before_j += tick_s * force_n * before;
        squares_n2 += force_n * force_n;
        if state.position_m <= 0.0 {
            break;
        }
    }
    let left_j = 0.5 * 63.2 * state.velocity_m_per_s * state.velocity_m_per_s;
    assert!((start_j - left_j - mean_j).abs() < RELATIVE * start_j, "the ticks add up");
    // With the velocity before the tick the sum is off by Σ F² T² / (2m): 1.0 to 1.3 mJ there.
    let bias_j = squares_n2 * tick_s * tick_s / (2.0 * 63.2);
    assert!((before_j - mean_j - bias_j).abs() < RELATIVE * start_j);
    assert!((0.95e-3..1.35e-3).contains(&bias_j), "{bias_j}");
}

/// Any wrench, tumbling bodies, interfaces askew: the energy of every tick is the work of the mean rates.
#[test]
fn in_six_axes_energy_and_momentum_balance_every_tick() {
    let chaser = Body::new(60.0, Matrix3::new(3.0, 0.3, 0.1, 0.3, 4.0, 0.2, 0.1, 0.2, 5.0)).unwrap();
    let target = Body::new(200.0, Matrix3::new(20.0, -2.0, 0.0, -2.0, 30.0, 1.0, 0.0, 1.0, 35.0)).unwrap();
    let turn = |x: f64, y: f64, z: f64| UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z));
    let probe = Pose::new(Vector3::new(0.1, -0.2, 0.6), turn(0.02, 0.01, -0.3));
    let nozzle = Pose::new(Vector3::new(-0.3, 0.1, -0.8), turn(3.0, 0.1, 0.2));
    let tumbling = BodyMotion { rate_rad_per_s: Vector3::new(0.05, 0.08, -0.06), ..BodyMotion::default() };
    let first = Motion { velocity_m_per_s: Vector3::new(0.002, -0.001, 0.035), ..Motion::default() };
    for integrator in [Integrator::SemiImplicit, Integrator::ExactHold] {
        let mut random = Streams::new(8).named("wrench");
        let mut any = || Vector3::from_fn(|_, _| 2.0 * random.uniform() - 1.0);
        let bodies = TwoBody::new(chaser, target, probe, nozzle, integrator).unwrap();
        let bodies = bodies.with_target(tumbling).unwrap();
        let mut state = bodies.start(&first);
        let mut audit = Audit::default();
        for _ in 0..10_000 {
            let wrench = Wrench { force_n: any() * 10.0, torque_n_m: any() };
            let (before, pushes) = (state, bodies.pushes(&state, &wrench));
            bodies.step(&mut state, TICK, &wrench);
            audit.take(&Account::of(&bodies, &before, &state, TICK.dt.seconds(), &pushes));
        }
        assert!(audit.closes(RELATIVE), "{integrator:?} {audit:?}");
        assert_eq!((audit.injected_n_s.norm(), audit.injected_n_m_s.norm()), (0.0, 0.0));
    }
}
