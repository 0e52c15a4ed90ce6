//! Every oracle of the physics: a number that was computed or published elsewhere, with its source, and the tolerance that its
//! source allows. A deviation carries `DIFFERENCE:` and the reason.

use crate::criteria::{FACILITY, KNOWN, MASS_KG, SPEED_M_PER_S, STIFFNESS_N_PER_M, cell, impact, spring, white};
use nalgebra::{Matrix3, Vector3};
use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::contact::{ContactLaw, Sides, SpringDashpot};
use sim_core::criterion::{Observation, ObservedAxis, ObservedEnergy, Window, contact, observed_energy, speeds};
use sim_core::effect::{Attached, Rates};
use sim_core::effects::standard;
use sim_core::energy::{Pairing, observed_damping_n_s_per_m, observed_j};
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::restitution::{Release, peak_force_n, rebound};
use sim_core::rig::DriveAxis;
use sim_core::rng::Streams;
use sim_core::signals::ContactForce;
use sim_core::space::{Axis, AxisMotion, AxisTouch};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

// O1 -------------------------------------------------------------------------------------------------------------------

// O2 -------------------------------------------------------------------------------------------------------------------

// O3 -------------------------------------------------------------------------------------------------------------------

// O4 -------------------------------------------------------------------------------------------------------------------

// O5 -------------------------------------------------------------------------------------------------------------------

// O6 -------------------------------------------------------------------------------------------------------------------

// O7 -------------------------------------------------------------------------------------------------------------------

// O8 -------------------------------------------------------------------------------------------------------------------

// O9 -------------------------------------------------------------------------------------------------------------------

/// P1 on a fine clock without delay, at this speed.
fn undelayed<Law: ContactLaw<Axis>>(law: Law, effects: &[Attached<Axis>], step_ns: i64, speed: f64) -> Trace<Axis> {
    let step = Nanos(step_ns);
    let rates = Rates { physics_step: step, loop_period: step, sensor_period: step, ..FACILITY };
    impact(&cell(law, 0.0, 0.0, step.seconds()), effects, speed, (rates, SensorNoise::NONE, 1), None)
}

/// reference/PHYSICS.md, section 4.1: force and velocity D apart show ±k D of damping, within 3 %; 16 ms at P1 are ±17 N s/m
/// and ±8 to 10 mJ.
#[test]
fn o9_a_velocity_that_is_late_shows_damping_that_is_not_there() {
    let trace = undelayed(spring(), &[], 100_000, SPEED_M_PER_S);
    let rate: Vec<f64> = trace.touch.iter().map(|touch| touch.rate_m_per_s).collect();
    let last = trace.interface.iter().rposition(|force| *force > 0.0).unwrap();
    for late_ms in [-16_i64, -8, -4, 4, 8, 16] {
        let late = late_ms * 10;
        // The contact alone, and the force with the velocity of `late` steps before.
        let shown: Vec<f64> = (3000..=last).map(|i| rate[(i as i64 - late) as usize]).collect();
        let energy_j = observed_j(&trace.interface[3000..=last], &shown, 1e-4);
        let found = observed_damping_n_s_per_m(energy_j, &shown, 1e-4).unwrap();
        let expected = STIFFNESS_N_PER_M * late_ms as f64 * 1e-3;
        assert!((found / expected - 1.0).abs() < 0.03, "{late_ms} ms: {found} instead of {expected} N s/m");
        // Half a unit in the last printed digit: 7.96 mJ is what the early side gives.
        assert!(late_ms.abs() != 16 || (7.5e-3..10.5e-3).contains(&energy_j.abs()), "{late_ms} ms: {energy_j} J");
    }
}

/// The same section: Σ F v_n T is too large by Σ F² T²/(2m), 1.0 to 1.3 mJ at P1, as if k T/2 = 2.1 N s/m were there.
#[test]
fn o9_the_velocity_before_the_tick_shows_half_a_tick_of_damping() {
    let rig = cell(spring(), 0.0, 0.016, 0.004);
    let trace = impact(&rig, &[], SPEED_M_PER_S, (FACILITY, SensorNoise::NONE, 1), None);
    let run = Observation::of_axis(&trace, &KNOWN);
    let (before, after) = (run.along[0].before.as_ref().unwrap(), run.along[0].after.as_ref().unwrap());
    let whole = ObservedEnergy { window: Window::Run, ..ObservedEnergy::default() };
    let exact = observed_energy(&run, &whole).unwrap();
    let last = after[after.len() - 1];
    let lost_j = 0.5 * MASS_KG * (SPEED_M_PER_S * SPEED_M_PER_S - last * last);
    assert!((exact.value_j - lost_j).abs() < exact.rounding_j, "{exact:?} {lost_j}");
    let biased_j = observed_j(&trace.feedback, before, 0.004);
    let squares: f64 = trace.feedback.iter().map(|force| force * force).sum();
    let bias_j = squares * 0.004 * 0.004 / (2.0 * MASS_KG);
    assert!((biased_j - exact.value_j - bias_j).abs() < 2.0 * exact.rounding_j);
    // 12.3 % more force here than without delay, hence a quarter more of its square.
    assert!((1.0e-3..1.3e-3 * 1.26).contains(&bias_j), "{bias_j}");
    let apparent = bias_j / exact.motion_m2_per_s;
    assert!((apparent / (STIFFNESS_N_PER_M * 0.002) - 1.0).abs() < 0.03, "{apparent}");
}

/// Section 2.4, rival A: the two-port energy with the late measured velocity is neutral at 41.6/43.7/45.9 N s/m where the rebound
/// is at 21.56/23.74/25.93 (section 2.2): +19.96 with the exact integrator, for k (D + T/2) = 19.19 in first order.
#[test]
fn o9_the_two_port_energy_calls_active_what_rebounds_passively() {
    let neutral_n_s_per_m = |pairing: Pairing, measured_late_s: f64| {
        let energy_j = |damping: f64| {
            let rig = cell(spring(), damping, 0.016, 0.004);
            let trace = impact(&rig, &[], SPEED_M_PER_S, (FACILITY, SensorNoise::NONE, 1), None);
            let what = ObservedEnergy { pairing, measured_late_s, ..ObservedEnergy::default() };
            let run = Observation::of_axis(&trace, &KNOWN);
            let speeds = speeds(&run, ObservedAxis::Z, Release::ZeroDepth).unwrap();
            (observed_energy(&run, &what).unwrap().value_j, speeds.restitution.value)
        };
        let (mut low, mut high) = (0.0, 100.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if energy_j(middle).0 > 0.0 { high = middle } else { low = middle }
        }
        (low, energy_j(low).1)
    };
    let (one_port, rebound) = neutral_n_s_per_m(Pairing::FeedbackWithSatelliteMean, 0.0);
    let (two_port, rebound_there) = neutral_n_s_per_m(Pairing::FeedbackMinusSensed, 0.0);
    let (undone, _) = neutral_n_s_per_m(Pairing::FeedbackMinusSensed, 0.016);
    // DIFFERENCE: 19.28 and 38.93 instead of 23.74 and 43.7, since our command is issued before the tick's force acts
    // (correction 4: 19.38, for the two-sided loop; ours never pulls). What is compared is the shift.
    assert!((one_port / 19.38 - 1.0).abs() < 0.01, "{one_port}");
    assert!(((two_port - one_port) / 19.96 - 1.0).abs() < 0.03, "{two_port} {one_port}");
    assert!(((undone - one_port) / (STIFFNESS_N_PER_M * 0.002) - 1.0).abs() < 0.03, "half a tick is left: {undone}");
    // The discriminator of that section: at the two-port's neutral point the rebound is not neutral.
    assert!((rebound - 1.0).abs() < 1e-6 && rebound_there < 0.91, "{rebound} {rebound_there}");
}

// O10 ------------------------------------------------------------------------------------------------------------------

/// reference/PHYSICS.md, section 4.2: both definitions, restitution and duration, against a simulation in steps of 10 µs.
/// Tolerance 1e-4; the held force acts as k T/2 = 0.005 N s/m too little, which moves e by 3e-5.
#[test]
fn o10_both_definitions_of_restitution_are_those_of_a_fine_simulation() {
    // Damping, then e and duration at d = 0, then at f = 0; the printed digits of P1, and of ζ = 0.4.
    let table = [
        (40.0, [0.784, 0.767], [0.794, 0.730]),
        (70.0, [0.652, 0.772], [0.677, 0.706]),
        (0.8 * (STIFFNESS_N_PER_M * MASS_KG).sqrt(), [0.254, f64::NAN], [0.364, f64::NAN]),
    ];
    for (damping, zero_depth, zero_force) in table {
        let law = SpringDashpot { damping_n_s_per_m: damping, ..spring() };
        let of = |release| rebound(release, MASS_KG, STIFFNESS_N_PER_M, damping).unwrap();
        for (release, printed) in [(Release::ZeroDepth, zero_depth), (Release::ZeroForce, zero_force)] {
            let formula = of(release);
            assert!((formula.restitution - printed[0]).abs() <= 5e-4, "{damping} {formula:?}");
            assert!(printed[1].is_nan() || (formula.duration_s - printed[1]).abs() <= 5e-4, "{damping} {formula:?}");
        }
        let never_pulls = undelayed(law, &[], 10_000, SPEED_M_PER_S);
        let run = Observation::of_axis(&never_pulls, &KNOWN);
        let (found, touched) =
            (speeds(&run, ObservedAxis::Z, Release::ZeroForce).unwrap(), contact(&run, &run.along[0]).unwrap());
        let formula = of(Release::ZeroForce);
        assert!((found.restitution.value - formula.restitution).abs() < 1e-4, "{damping} {found:?} {formula:?}");
        assert!((touched.end_s - touched.begin_s - formula.duration_s).abs() < 1e-4, "{damping} {touched:?}");
        let peak_n = peak_force_n(MASS_KG, STIFFNESS_N_PER_M, damping, SPEED_M_PER_S);
        assert!((touched.peak_n / peak_n - 1.0).abs() < 1e-4, "{damping} {touched:?} {peak_n}");
        // The one that may pull starts at the touch, since it also pulls from afar, and is let go where d = 0.
        let pulls = drawn(SpringDashpot { sides: Sides::Two, ..law });
        let out = (1..pulls.commanded.len()).find(|&i| pulls.commanded[i].position_m < 0.0).unwrap();
        let (inside, outside) = (pulls.commanded[out - 1], pulls.commanded[out]);
        let share = inside.position_m / (inside.position_m - outside.position_m);
        let at = |a: f64, b: f64| a + share * (b - a);
        let e = -at(inside.velocity_m_per_s, outside.velocity_m_per_s) / SPEED_M_PER_S;
        let duration_s = at(pulls.loop_time[out - 1].seconds(), pulls.loop_time[out].seconds());
        let formula = of(Release::ZeroDepth);
        assert!((e - formula.restitution).abs() < 1e-4, "{damping} {e} {formula:?}");
        assert!((duration_s - formula.duration_s).abs() < 1e-4, "{damping} {duration_s} {formula:?}");
    }
}

/// A mass that starts at the touch, without delay, for one second.
fn drawn(law: SpringDashpot) -> Trace<Axis> {
    let sensor = AxisCell { tool_weight_n: 0.0, bias_n: 0.0 };
    let (link, readout) = (Link { dead_time_s: 0.0 }, Readout { delay_s: 0.0 });
    let rig = DriveAxis { plant: PointMass { mass_kg: MASS_KG }, link, readout, law, sensor };
    let step = Nanos(10_000);
    let rates = Rates { physics_step: step, loop_period: step, sensor_period: step, ..FACILITY };
    let (first, noise) = (AxisMotion::moving(0.0, SPEED_M_PER_S), SensorNoise::NONE);
    let start = Start { first, from: Nanos(0), until: Nanos(1_000_000_000), noise, streams: Streams::new(1) };
    let mut trace = Trace::default();
    ClosedLoop::new(&rig, &[], rates).run(&start, &Clamps::default(), Columns::LOG, &mut trace);
    trace
}

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

/// Exponent p in rms ~ v^p between a speed and its double.
fn exponent(rms_n: impl Fn(f64) -> f64, speed: f64) -> f64 {
    libm::log2(rms_n(2.0 * speed) / rms_n(speed))
}

fn rms(residuals: &[f64]) -> f64 {
    (residuals.iter().map(|value| value * value).sum::<f64>() / residuals.len() as f64).sqrt()
}

/// Residual against the nominal model on the same path, in contact, at P1 with 60 N s/m of virtual damping.
fn against_nominal_n(law: SpringDashpot, effect: Option<Attached<Axis>>, noise: SensorNoise, speed: f64) -> f64 {
    let effects: Vec<Attached<Axis>> = effect.into_iter().collect();
    let with = impact(&cell(law, 60.0, 0.016, 0.004), &effects, speed, (FACILITY, noise, 1), None);
    let clocks = (FACILITY, SensorNoise::NONE, 1);
    let nominal = impact(&cell(spring(), 60.0, 0.016, 0.004), &[], speed, clocks, Some(&with.achieved));
    let touching = (0..with.sensed.len()).filter(|&i| nominal.touch[i].depth_m > 0.0);
    rms(&touching.map(|i| with.sensed[i] - nominal.sensed[i]).collect::<Vec<f64>>())
}

/// reference/PHYSICS.md, section 8.0, rule R2, between 35 and 70 mm/s. The rule sets classes a tenth apart (1.3 to 1.6): half of
/// that is the tolerance. The cubic is 3 on a path of its own size; 2.75 with its own feedback, as no. 26 of the catalogue has it.
#[test]
fn o15_the_residual_of_an_effect_grows_with_its_own_power_of_the_speed() {
    let catalogue = standard();
    let effect = |id: &str, values: &[f64]| {
        let kind = catalogue.get(id).unwrap();
        let more = kind.params[values.len()..].iter().map(|param| param.starts[0]);
        Some(kind.attach(&values.iter().copied().chain(more).collect::<Vec<f64>>()))
    };
    let (none, quantised) = (SensorNoise::NONE, SensorNoise { quantum_n: 0.25, ..SensorNoise::NONE });
    let (plain, damped) = (spring(), SpringDashpot { damping_n_s_per_m: 20.0, ..spring() });
    let table: [(&str, SpringDashpot, &[f64], SensorNoise, f64); 11] = [
        ("force-bias", plain, &[0.25], none, 0.0),
        ("coulomb-friction", plain, &[0.5], none, 0.0),
        ("quantisation", plain, &[], quantised, 0.0),
        ("noise", plain, &[], white(0.08), 0.0),
        ("force-delay", plain, &[0.004], none, 1.0),
        ("force-lag", plain, &[73.0, 2.0], none, 1.0),
        ("damping", damped, &[], none, 1.0),
        ("force-scale", plain, &[1.02], none, 1.0),
        ("tool-inertia", plain, &[5.0], none, 1.0),
        ("stiffness-hardening", plain, &[2.1e6], none, 2.75),
        ("hunt-crossley", plain, &[2400.0], none, 1.945),
    ];
    for (name, law, values, noise, expected) in table {
        let of = |speed| {
            let attached = if values.is_empty() { None } else { effect(name, values) };
            against_nominal_n(law, attached, noise, speed)
        };
        let found = exponent(of, SPEED_M_PER_S);
        assert!((found - expected).abs() < 0.05, "{name}: {found} instead of {expected}");
    }
    // No. 18: a quarter of a newton leaves 0.071 N, whatever the speed.
    let quantum_n = against_nominal_n(plain, None, quantised, SPEED_M_PER_S);
    assert!((quantum_n / 0.071 - 1.0).abs() < 0.03, "{quantum_n}");
}

/// Power n of the depth with the damping of Hunt and Crossley, `f = K dⁿ (1 + λ d')`, K as at 8.52 mm of a linear spring.
#[derive(Clone, Copy)]
struct Power {
    exponent: f64,
    lambda_s_per_m: f64,
}

impl ContactLaw<Axis> for Power {
    fn force(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        let depth_m = touch.depth_m.max(0.0);
        let elastic = STIFFNESS_N_PER_M * depth_m * libm::pow(depth_m / 0.008_52, self.exponent - 1.0);
        ContactForce { elastic, dissipative: self.lambda_s_per_m * touch.rate_m_per_s * elastic }
    }

    fn clamped(&self, touch: &AxisTouch, force: &ContactForce<Axis>) -> f64 {
        if touch.depth_m > 0.0 { force.total().max(0.0) } else { 0.0 }
    }
}

/// What least squares of `f = k x + b v + d` over the contact leave.
fn left_by_a_line_n(law: Power, speed: f64) -> f64 {
    let trace = undelayed(law, &[], 50_000, speed);
    let touching: Vec<usize> = (0..trace.touch.len()).filter(|&i| trace.touch[i].depth_m > 0.0).collect();
    let row = |i: usize| Vector3::new(trace.touch[i].depth_m, trace.touch[i].rate_m_per_s, 1.0);
    let normal: Matrix3<f64> = touching.iter().map(|&i| row(i) * row(i).transpose()).sum();
    let right: Vector3<f64> = touching.iter().map(|&i| row(i) * trace.interface[i]).sum();
    let fitted = normal.lu().solve(&right).unwrap();
    rms(&touching.iter().map(|&i| trace.interface[i] - row(i).dot(&fitted)).collect::<Vec<f64>>())
}

/// reference/PHYSICS.md, correction 6: c x v 1.93 to 1.96, Hertz 1.20, Hunt-Crossley (n = 1.5) 1.25 to 1.38. Without delay, since
/// only then is an impact on a power of the depth the same at every speed up to its scale: p = 2 n / (n + 1) for a spring alone.
#[test]
fn o15_a_power_of_the_depth_leaves_a_power_of_the_speed() {
    let ends = |law: Power| [0.5, 1.0].map(|share| exponent(|v| left_by_a_line_n(law, v), share * SPEED_M_PER_S));
    for found in ends(Power { exponent: 1.5, lambda_s_per_m: 0.0 }) {
        assert!((found - 1.20).abs() < 0.005, "Hertz: {found}");
    }
    // The source does not print λ. At 2.5 s/m, within its 0.5 to 5, both printed ends of n = 1.5 come out.
    let [low, high] = ends(Power { exponent: 1.5, lambda_s_per_m: 2.5 });
    assert!((low - 1.25).abs() < 0.005 && (high - 1.38).abs() < 0.005, "Hunt-Crossley: {low} {high}");
    let [high, low] = ends(Power { exponent: 1.0, lambda_s_per_m: 2.5 });
    // DIFFERENCE: 1.924 to 1.960 at the same λ, for 1.93 to 1.96: the lower end is 0.006 off its last digit.
    assert!((high - 1.96).abs() < 0.005 && (low - 1.93).abs() < 0.01, "c x v: {low} {high}");
}
