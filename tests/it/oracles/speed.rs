//! O15: how the residual of what is missing grows with the speed of approach.

use super::energy::undelayed;
use crate::criteria::{FACILITY, SPEED_M_PER_S, STIFFNESS_N_PER_M, cell, impact, spring, white};
use nalgebra::{Matrix3, Vector3};
use sim_core::contact::{ContactLaw, SpringDashpot};
use sim_core::effect::Attached;
use sim_core::effects::standard;
use sim_core::force_sensor::SensorNoise;
use sim_core::signals::ContactForce;
use sim_core::space::{Axis, AxisTouch};

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
