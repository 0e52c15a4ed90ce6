//! One axis: the laws of `sim_core` without delay, and the contact in software and the exact method with it.

use super::{Bend, check_order, number, numbers, published};
use crate::compensators::bench::computed;
use serde_json::Value;
use sim_core::compensator::{Release, Software};
use sim_core::contact::{ContactLaw, Hertz, HuntCrossley, Sides, SpringDashpot};
use sim_core::geometry::{Geometry, Plane};
use sim_core::plant::{Plant, PointMass, PointMassState};
use sim_core::space::{Axis, AxisMotion};
use sim_core::stability::impact::{OneSided, Pull};
use sim_core::time::{Nanos, Step};

/// Positions and velocities of the other solver, in turn.
fn other(case: &Value) -> Vec<f64> {
    let (positions, velocities) = (numbers(&case["position_m"]), numbers(&case["velocity_m_per_s"]));
    positions.into_iter().zip(velocities).flat_map(|(x, v)| [x, v]).collect()
}

/// An impact at t = 0, x = 0 of a point mass; the force of a tick is taken in its middle.
fn fall_in(case: &Value, tick: Nanos, law: &dyn ContactLaw<Axis>) -> Vec<f64> {
    let plant = PointMass::of_mass(number(case, "mass_kg"));
    let felt = |state: &PointMassState| {
        let touch = Geometry::<Axis>::touch(&Plane, &plant.motion(state));
        law.clamped(&touch, &law.force(&touch))
    };
    let half = Step { index: 0, now: Nanos(0), dt: Nanos(tick.0 / 2) };
    let mut state = plant.start(&AxisMotion::moving(0.0, number(case, "speed_m_per_s")));
    let (mut found, mut ticks) = (vec![], 0);
    for time_s in numbers(&case["time_s"]) {
        while ticks < libm::round(time_s / tick.seconds()) as i64 {
            let mut middle = state;
            plant.step(&mut middle, half, &felt(&state));
            let force_n = felt(&middle);
            plant.step(&mut state, half, &force_n);
            plant.step(&mut state, half, &force_n);
            ticks += 1;
        }
        found.extend([state.position_m, state.velocity_m_per_s]);
    }
    found
}

fn check_impact(name: &str, law: fn(&Value) -> Box<dyn ContactLaw<Axis>>) {
    let case = published(name);
    let (law, other) = (law(&case), other(&case));
    let [coarse, fine] = [2_000_000, 1_000_000].map(|tick| fall_in(&case, Nanos(tick), &*law));
    let (error, tick_s) = (number(&case, "error"), 1e-3);
    // A law with a stiffness lets go with k v; within the last second that moves nothing further than the speed changes.
    let stiffness = case["stiffness_n_per_m"].as_f64().unwrap_or(0.0);
    let exit = number(&case, "exit_m_per_s").abs();
    let bend = Bend(stiffness * exit * tick_s * tick_s / 8.0 / number(&case, "mass_kg"));
    // All let go between 0.7 and 0.8 s.
    let touching = 2 * numbers(&case["time_s"]).iter().filter(|&&time_s| time_s < 0.7).count();
    check_order(name, 2, [&coarse[..touching], &fine[..touching]], &other[..touching], error, None);
    check_order(name, 2, [&coarse, &fine], &other, error, Some(bend));
}

#[test]
fn a_spring_and_dashpot_is_that_of_another_solver() {
    check_impact("spring_dashpot", |case| {
        Box::new(SpringDashpot {
            stiffness_n_per_m: number(case, "stiffness_n_per_m"),
            damping_n_s_per_m: number(case, "damping_n_s_per_m"),
            sides: Sides::One,
        })
    });
}

#[test]
fn hertz_is_that_of_another_solver() {
    check_impact("hertz", |case| {
        let (stiffness, exponent) = (number(case, "stiffness_n_per_m_1_5"), number(case, "exponent"));
        Box::new(Hertz::new(stiffness, exponent, 0.0, Sides::One).unwrap())
    });
}

#[test]
fn hunt_and_crossley_is_that_of_another_solver() {
    check_impact("hunt_crossley", |case| {
        let (stiffness, exponent) = (number(case, "stiffness_n_per_m_1_5"), number(case, "exponent"));
        Box::new(HuntCrossley::new(stiffness, exponent, number(case, "damping_c_s_per_m"), Sides::One).unwrap())
    });
}

// With delay -----------------------------------------------------------------------------------------------------------

const DELAYED: [&str; 2] = ["delayed_16_ms", "delayed_32_ms"];

/// Positions and velocities of the contact in software, in a closed loop with a rigid robot; onset at t = 0.
fn fall_late(case: &Value, tick: Nanos) -> Vec<f64> {
    let software = Software {
        stiffness_n_per_m: number(case, "stiffness_n_per_m"),
        damping_n_s_per_m: number(case, "damping_n_s_per_m"),
        dead_time_s: number(case, "delay_s"),
        release: Release::ZeroForce,
    };
    let first = AxisMotion::moving(0.0, number(case, "speed_m_per_s"));
    let trace = computed(number(case, "mass_kg"), software, first, tick, number(case, "until_s") + tick.seconds());
    let ticks = |time_s: f64| libm::round(time_s / tick.seconds()) as usize;
    let at = |time_s: f64| trace.commanded[ticks(time_s)];
    numbers(&case["time_s"]).into_iter().map(at).flat_map(|now| [now.position_m, now.velocity_m_per_s]).collect()
}

/// Onset, release and what is between them are integrated: there is no bend, and the order is clean before release and after.
#[test]
fn a_late_contact_in_software_is_that_of_another_solver() {
    for name in DELAYED {
        let case = published(name);
        let [coarse, fine] = [2_000_000, 1_000_000].map(|tick| fall_late(&case, Nanos(tick)));
        check_order(name, 2, [&coarse, &fine], &other(&case), number(&case, "error"), None);
    }
}

fn one_sided(case: &Value) -> OneSided {
    OneSided {
        mass_kg: number(case, "mass_kg"),
        stiffness_n_per_m: number(case, "stiffness_n_per_m"),
        damping_n_s_per_m: number(case, "damping_n_s_per_m"),
        delay_s: case["delay_s"].as_f64().unwrap_or(0.0),
        pull: Pull::Never,
    }
}

#[test]
fn the_exact_method_leaves_as_fast_and_as_late_as_another_solver() {
    for name in DELAYED {
        let case = published(name);
        let found = one_sided(&case).impact().unwrap();
        let (speed, exit) = (number(&case, "speed_m_per_s"), -number(&case, "exit_m_per_s"));
        // Each delay is one piece, and one more for each root in it; in each, speed and depth are rounded a few times, by ε/2 of
        // what they may reach: the speed of approach, and the time at that speed.
        let (release_s, drift_s) = (number(&case, "zero_force_s"), number(&case, "zero_depth_s"));
        let rounding = 2.0 * drift_s / number(&case, "delay_s") * f64::EPSILON;
        let error = number(&case, "error");
        let exits = (found.restitution * speed - exit).abs();
        let releases = (found.until_zero_force_s - release_s).abs();
        let drifts = (found.until_zero_depth_s - drift_s).abs();
        println!(
            "{name}: exit off by {exits:e} m/s, release by {releases:e} s, zero depth by {drifts:e} s; {rounding:e}"
        );
        assert!(exits <= error + rounding * speed, "{name}: exit off by {exits:e}");
        assert!(releases <= error + rounding, "{name}: release off by {releases:e}");
        assert!(drifts <= error + rounding, "{name}: zero depth off by {drifts:e}");
    }
}

/// The same without delay: the closed form.
#[test]
fn the_closed_form_leaves_as_fast_and_as_late_as_another_solver() {
    let case = published("spring_dashpot");
    let found = one_sided(&case).impact().unwrap();
    let error = number(&case, "error");
    let exit = found.restitution * number(&case, "speed_m_per_s") + number(&case, "exit_m_per_s");
    assert!(exit.abs() <= error, "{exit:e}");
    let release = found.until_zero_force_s - number(&case, "release_s");
    assert!(release.abs() <= error, "{release:e}");
}
