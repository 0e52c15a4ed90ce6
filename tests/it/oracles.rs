//! Every oracle of the physics: a number that was computed or published elsewhere, with its source, and the tolerance that its
//! source allows. A deviation carries `DIFFERENCE:` and the reason.

use crate::compensators::bench::{
    Device, MASS_KG, SPEED_M_PER_S, STIFFNESS_N_PER_M, bench, computed_exit_m_per_s, restitution,
};
use sim_core::compensator::{Hybrid, Release, Software, Uncompensated};
use sim_core::restitution::from_speeds;
use sim_core::time::Nanos;

// O1 -------------------------------------------------------------------------------------------------------------------

// O2 -------------------------------------------------------------------------------------------------------------------

// O3 -------------------------------------------------------------------------------------------------------------------

// O4 -------------------------------------------------------------------------------------------------------------------

/// `reference/PHYSICS.md`, section 2.3: table 1 of Li et al. 2026 (doi 10.1061/JAEEEZ.ASENG-6727), 300 kg, 3 Hz, 5 mm/s.
///
/// Their restitution in space is that of release at zero depth. Four digits are printed; the tolerance is that of the source.
#[test]
fn o4_restitution_behind_a_pure_delay_of_the_force() {
    let (mass_kg, stiffness_n_per_m, speed_m_per_s) = (300.0, 106.59e3, 0.005);
    for (ratio, cells) in [
        (0.0, [(0.0030, 1.0928), (0.0035, 1.1090), (0.0040, 1.1255)]),
        (0.1, [(0.0030, 0.7973), (0.0035, 0.8093), (0.0040, 0.8216)]),
    ] {
        let damping_n_s_per_m = 2.0 * ratio * f64::sqrt(stiffness_n_per_m * mass_kg);
        for (dead_time_s, published) in cells {
            let contact = Software { stiffness_n_per_m, damping_n_s_per_m, dead_time_s, release: Release::ZeroDepth };
            let exit = computed_exit_m_per_s(mass_kg, contact, 1e-4, speed_m_per_s, Nanos(100_000), 0.5);
            let found = from_speeds(speed_m_per_s, exit);
            assert!((found - published).abs() < 2e-4, "{ratio} {dead_time_s}: {found} {published}");
        }
    }
}

// O5 -------------------------------------------------------------------------------------------------------------------

// O6 -------------------------------------------------------------------------------------------------------------------

/// `reference/PHYSICS.md`, section 2.4: damping, then for each loop the energy that a contact absorbs in mJ, and its restitution.
///
/// The loops: 16 and 32 ms without sampling, and both with a loop of 4 ms whose force is held and whose pose is valid at the end
/// of its tick. Restitution ±0.5 %, as the source asks; an energy is E (1 - e²), so that it may differ by E 2 e² 0.5 %, and by
/// half a printed digit.
#[test]
fn o6_restitution_and_energy_of_four_loops() {
    let energy_mj = 0.5e3 * MASS_KG * SPEED_M_PER_S * SPEED_M_PER_S;
    for (damping_n_s_per_m, cells) in [
        (0.0, [(-8.9, 1.110), (-19.8, 1.229), (-12.7, 1.152), (-24.3, 1.276)]),
        (20.0, [(1.3, 0.983), (-7.3, 1.091), (-1.8, 1.023), (-11.0, 1.134)]),
        (40.0, [(9.4, 0.871), (2.5, 0.967), (6.8, 0.907), (-0.4, 1.006)]),
        (70.0, [(18.4, 0.724), (13.6, 0.805), (16.7, 0.755), (11.4, 0.840)]),
    ] {
        let continuous = |dead_time_s: f64| {
            let release = Release::ZeroDepth;
            let contact = Software { stiffness_n_per_m: STIFFNESS_N_PER_M, damping_n_s_per_m, dead_time_s, release };
            let exit = computed_exit_m_per_s(MASS_KG, contact, 0.01, SPEED_M_PER_S, Nanos(1_000_000), 3.0);
            from_speeds(SPEED_M_PER_S, exit)
        };
        let sampled = |dead_time_s: f64| {
            let device = Device { damping_n_s_per_m, ..Device::SPRING };
            restitution(&bench(device, Hybrid::<Uncompensated>::default(), dead_time_s, 0.016), 0.0)
        };
        let found = [continuous(0.016), continuous(0.032), sampled(0.020), sampled(0.036)];
        for (e, (absorbed_mj, published)) in found.into_iter().zip(cells) {
            assert!((e / published - 1.0).abs() < 5e-3, "b {damping_n_s_per_m}: {found:?}");
            let difference_mj = energy_mj * (1.0 - e * e) - absorbed_mj;
            assert!(difference_mj.abs() < 0.05 + energy_mj * 2.0 * e * e * 5e-3, "b {damping_n_s_per_m}: {found:?}");
        }
    }
}

// O7 -------------------------------------------------------------------------------------------------------------------

// O8 -------------------------------------------------------------------------------------------------------------------

/// The exact discrete energy identity, to 1e-12 relative: reference/PHYSICS.md, sections 4.1 and 9.
mod o8_energy_identity {
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
}

// O9 -------------------------------------------------------------------------------------------------------------------

// O10 ------------------------------------------------------------------------------------------------------------------

// O11 ------------------------------------------------------------------------------------------------------------------

// O12 ------------------------------------------------------------------------------------------------------------------

mod o12 {
    //! reference/PHYSICS.md, section 3.3 and section 9, O12: the stiffness of a preloaded device against second differences of its
    //! springs' energy, to 1e-6.

    use nalgebra::{Matrix6, Vector3, Vector6};
    use sim_core::contact::{ComplianceDevice, Spring};
    use sim_core::rng::{Stream, Streams};

    /// The tolerance of section 9, against the largest entry.
    const TOLERANCE: f64 = 1e-6;

    /// Step of the differences, in m and rad: their error is some step⁴ / length⁴ = 1e-9, their rounding 1e-16 J / step² = 1e-10.
    const STEP: f64 = 1e-3;

    /// Six springs of some 0.2 m between two plates, each pressed by `press` of its free length.
    fn device(random: &mut Stream, press: f64) -> ComplianceDevice {
        let mut springs = Vec::new();
        for _ in 0..6 {
            let mut about = |x: f64, y: f64, z: f64| {
                Vector3::new(x + 0.04 * random.normal(), y + 0.04 * random.normal(), z + 0.02 * random.normal())
            };
            let (base_m, platform_m) = (about(0.0, 0.0, -0.2), about(0.0, 0.0, 0.0));
            let free_length_m = (platform_m - base_m).norm() / (1.0 - press);
            let stiffness_n_per_m = 500.0 * (1.0 + 0.3 * random.uniform());
            springs.push(Spring { base_m, platform_m, stiffness_n_per_m, free_length_m });
        }
        ComplianceDevice::new(springs).unwrap()
    }

    /// Second derivative of the energy by differences of fourth order in both directions.
    fn differences(device: &ComplianceDevice) -> Matrix6<f64> {
        let stencil = [(-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)];
        let energy_j = |x: Vector6<f64>| device.energy_j(&x.fixed_rows::<3>(0).into(), &x.fixed_rows::<3>(3).into());
        Matrix6::from_fn(|i, j| {
            let mut sum = 0.0;
            for (a, weight_a) in stencil {
                for (b, weight_b) in stencil {
                    sum += weight_a * weight_b * energy_j(Vector6::ith(i, a * STEP) + Vector6::ith(j, b * STEP));
                }
            }
            sum / (STEP * STEP)
        })
    }

    #[test]
    fn the_stiffness_of_a_preloaded_device_is_the_curvature_of_its_energy() {
        let mut random = Streams::new(12).named("oracle/device");
        for case in 0..200 {
            let press = [0.05, 0.0, -0.05, 0.2][case % 4];
            let device = device(&mut random, press);
            let (formula, differences) = (device.stiffness().0, differences(&device));
            let worst = (formula - differences).abs().max() / formula.abs().max();
            assert!(worst < TOLERANCE, "case {case}, pressed {press}: {worst}");
            assert!((formula - formula.transpose()).abs().max() < 1e-12 * formula.abs().max(), "it is symmetric");
            // What is often computed instead leaves the preload out; it differs by the tension over the length.
            let left_out = (formula - device.stiffness_without_preload().0).abs().max() / formula.abs().max();
            assert!(left_out < 1e-15 || press.abs() > 0.0, "{left_out}");
            assert!(press.abs() <= 0.0 || left_out > 1e-3, "{left_out}");
        }
    }

    /// DIFFERENCE: section 3.3 tells of one random device, whose springs it does not give: 5 % of compression made 184 N/m of
    /// 488 across it, and one axis -159 N/m. The same happens to devices like it; their own numbers are their own.
    #[test]
    fn compression_softens_a_device_across_its_springs_and_may_turn_it_over() {
        let mut random = Streams::new(12).named("oracle/preload");
        let (mut softened, mut turned_over) = (0, 0);
        for _ in 0..200 {
            let device = device(&mut random, 0.05);
            let (with, without) = (device.stiffness(), device.stiffness_without_preload());
            let across = |k: &Matrix6<f64>| k[(0, 0)] + k[(1, 1)];
            softened += usize::from(across(&with.0) < across(&without.0));
            assert_eq!(without.negative(0.1).unwrap().filter(|axis| axis.stiffness_n_per_m < -1e-9).count(), 0);
            turned_over += usize::from(with.negative(0.1).unwrap().next().is_some());
        }
        assert_eq!(softened, 200, "each one is softer across its springs");
        assert!(turned_over > 0, "and some have a direction in which they push away");
    }
}

// O13 ------------------------------------------------------------------------------------------------------------------

// O14 ------------------------------------------------------------------------------------------------------------------

// O15 ------------------------------------------------------------------------------------------------------------------
