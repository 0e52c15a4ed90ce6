//! Two bodies and the laws of an impact against solutions of another kind: Jacobi's functions, and a solver that is not ours
//! (`fixtures/published/scipy_cases.py`).
//!
//! No tolerance is a guess. A scheme of order p that gives `a` with a step and `b` with half of it is off by about
//! `|a - b| / (2^p - 1)` at the half step; what it may differ from the other solver is a quarter more than that, and the error
//! that the other solver states of itself. Where a force that never pulls has let go inside a tick, the bend costs up to an
//! eighth of (its rate × T²) of impulse, another part of it for every step: that is added, see [`Bend`].

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;
use sim_core::contact::{ContactLaw, Sides, SpringDashpot};
use sim_core::frames::Pose;
use sim_core::plant::{Body, BodyMotion, Integrator, Plant, PointMass, PointMassState, TwoBody, TwoBodyState};
use sim_core::space::{Axis, AxisTouch, Motion, Wrench};
use sim_core::time::{Nanos, Step};
use std::collections::VecDeque;

const ALL: [Integrator; 3] = [Integrator::SemiImplicit, Integrator::ExactHold, Integrator::RungeKutta4];

fn published(case: &str) -> Value {
    let text = std::fs::read_to_string(fixtures::folder().join("published/scipy_cases.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()[case].take()
}

fn number(case: &Value, name: &str) -> f64 {
    case[name].as_f64().unwrap_or_else(|| panic!("{name} is a number"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|entry| entry.as_f64().unwrap()).collect()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_iterator(numbers(value))
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_row_slice(&numbers(value))
}

fn attitude(value: &Value) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix(value)))
}

/// What the end of a contact inside a tick may cost at the half step, in the units of what is compared.
///
/// A force that falls to zero with the rate s, held at its value in the middle of the tick, is off by at most `s T²/8` of
/// impulse. At both steps this is anything up to that, so the halving may be wrong by 5/3 of it, and the result by 8/3.
#[derive(Clone, Copy)]
struct Bend(f64);

/// Whether a scheme of this order, run with a step and with half of it, agrees with the other solver as well as it can.
fn check_order(about: &str, order: u32, runs: [&[f64]; 2], other: &[f64], other_error: f64, bend: Option<Bend>) {
    let [coarse, fine] = runs;
    assert_eq!((coarse.len(), fine.len()), (other.len(), other.len()), "{about}");
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let halving = apart(coarse, fine) / f64::from((1 << order) - 1);
    let found = apart(fine, other);
    let allowed = 1.25 * halving + other_error + bend.map_or(0.0, |bend| bend.0 * 8.0 / 3.0);
    assert!(found <= allowed, "{about}: off by {found:e}, step halving says {halving:e}, allowed {allowed:e}");
    // The order itself: or a scheme of first order could hide behind a coarse step.
    let ratio = apart(coarse, other) / found;
    let expected = f64::from(1 << order);
    let clean = bend.is_none() && found > 10.0 * other_error;
    assert!(!clean || (ratio / expected - 1.0).abs() < 0.25, "{about}: the error falls by {ratio}");
}

// Free motion ----------------------------------------------------------------------------------------------------------

/// sn, cn and dn of argument u and parameter m, by the descending Landen transformation (arithmetic-geometric mean).
fn jacobi(u: f64, m: f64) -> [f64; 3] {
    let (mut a, mut b, mut means, mut gaps) = (1.0_f64, (1.0 - m).sqrt(), vec![1.0], vec![m.sqrt()]);
    while *gaps.last().unwrap() > f64::EPSILON {
        let gap = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        means.push(a);
        gaps.push(gap);
    }
    let last = means.len() - 1;
    let mut phi = a * u * f64::from(1 << last);
    for n in (1..=last).rev() {
        phi = 0.5 * (phi + libm::asin(gaps[n] / means[n] * libm::sin(phi)));
    }
    let sn = libm::sin(phi);
    [sn, libm::cos(phi), (1.0 - m * sn * sn).sqrt()]
}

/// From the tables of Abramowitz and Stegun, 16.: at m = 0 the circle, at m = 1/2 and u = K/2 known roots.
#[test]
fn jacobis_functions_are_right_where_they_are_known() {
    let [sn, cn, dn] = jacobi(0.7, 0.0);
    assert!((sn - libm::sin(0.7)).abs() < 1e-15 && (cn - libm::cos(0.7)).abs() < 1e-15 && (dn - 1.0).abs() < 1e-15);
    // sn²(K/2) = 1/(1 + √(1 - m)), K(1/2) = Γ(1/4)²/(4√π).
    let quarter = libm::tgamma(0.25);
    let k = quarter * quarter / (4.0 * std::f64::consts::PI.sqrt());
    let [sn, ..] = jacobi(0.5 * k, 0.5);
    assert!((sn * sn - 1.0 / (1.0 + 0.5_f64.sqrt())).abs() < 4e-15, "{sn}");
}

/// The body rates of a free asymmetric body (J1 < J2 < J3, |L|² > 2 E J2) that circles the axis of its largest moment.
fn jacobi_rates(inertia: &Vector3<f64>, start: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
    let (j1, j2, j3) = (inertia.x, inertia.y, inertia.z);
    let spin = inertia.component_mul(start);
    let (twice_energy, square) = (spin.dot(start), spin.norm_squared());
    assert!(square > twice_energy * j2 && start.x > 0.0 && start.z > 0.0, "the other branch has other formulas");
    let (low, high) = (twice_energy * j3 - square, square - twice_energy * j1);
    let top = [(low / (j1 * (j3 - j1))).sqrt(), (low / (j2 * (j3 - j2))).sqrt(), (high / (j3 * (j3 - j1))).sqrt()];
    let pace = ((j3 - j2) * high / (j1 * j2 * j3)).sqrt();
    let m = (j2 - j1) * low / ((j3 - j2) * high);
    // sn u0 = ω2/top2, by halving: it grows as long as cn > 0.
    let (mut below, mut above) = (-1.5, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (below + above);
        if jacobi(middle, m)[0] * top[1] < start.y { below = middle } else { above = middle }
    }
    let [sn, cn, dn] = jacobi(0.5 * (below + above) + pace * time_s, m);
    Vector3::new(top[0] * cn, top[1] * sn, top[2] * dn)
}

/// A chaser that turns freely: its body rate and its attitude at these times.
fn tumble(
    inertia: Matrix3<f64>,
    rate: Vector3<f64>,
    integrator: Integrator,
    tick_s: f64,
    times_s: &[f64],
) -> [Vec<f64>; 2] {
    let chaser = Body::new(10.0, inertia).unwrap();
    // Probe and nozzle are askew, so that what is integrated is not the principal axes.
    let askew = Pose::new(Vector3::zeros(), UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.8, 0.3)));
    let bodies = TwoBody::new(chaser, Body::fixed(), askew, Pose::default(), integrator).unwrap();
    let motion = BodyMotion { rate_rad_per_s: rate, ..BodyMotion::default() };
    let mut state = bodies.state(&[motion, BodyMotion::default()]);
    let (mut rates, mut rotations, mut ticks) = (vec![], vec![], 0_u32);
    for &time_s in times_s {
        while f64::from(ticks) * tick_s < time_s - 0.5 * tick_s {
            let pushes = bodies.pushes(&state, &Wrench::default());
            bodies.advance(&mut state, tick_s, &pushes);
            ticks += 1;
        }
        let [chaser, _] = bodies.motions(&state);
        rates.extend(chaser.rate_rad_per_s.iter());
        rotations.extend(chaser.attitude.to_rotation_matrix().matrix().transpose().iter());
    }
    [rates, rotations]
}

#[test]
fn torque_free_tumbling_is_that_of_jacobi_and_of_another_solver() {
    let case = published("tumbling");
    let inertia = matrix(&case["inertia_kg_m2"]);
    let start = vector(&case["start_rate_rad_per_s"]);
    let times_s = numbers(&case["time_s"]);
    let closed: Vec<f64> =
        times_s.iter().flat_map(|&time_s| jacobi_rates(&inertia.diagonal(), &start, time_s).data.0[0]).collect();
    let flat = |name: &str| case[name].as_array().unwrap().iter().flat_map(numbers).collect::<Vec<f64>>();
    // Rounding of Landen's phase over 20 s, and what the other solver says of itself, over the same time.
    let error = 1e-12 + number(&case, "error");
    for (integrator, order) in ALL.into_iter().zip([2, 2, 4]) {
        let tick_s = if order == 2 { 0.005 } else { 0.1 };
        let [rates, rotations] = tumble(inertia, start, integrator, tick_s, &times_s);
        let [fine, fine_rotations] = tumble(inertia, start, integrator, 0.5 * tick_s, &times_s);
        check_order(&format!("{integrator:?}, Jacobi"), order, [&rates, &fine], &closed, error, None);
        check_order(&format!("{integrator:?}, rates"), order, [&rates, &fine], &flat("rate_rad_per_s"), error, None);
        let rotation = flat("rotation");
        let turns: [&[f64]; 2] = [&rotations, &fine_rotations];
        check_order(&format!("{integrator:?}, attitude"), order, turns, &rotation, error, None);
    }
}

/// Linear and angular momentum about the global origin, and kinetic energy, of both.
fn books(bodies: &TwoBody, state: &TwoBodyState) -> (Vector3<f64>, Vector3<f64>, f64) {
    let sides = bodies.bodies_at_interface().iter().zip([state.chaser(), state.target()]);
    let (linear, angular) = sides.fold((Vector3::zeros(), Vector3::zeros()), |(linear, angular), (body, side)| {
        let momentum = side.velocity_m_per_s * body.mass_kg();
        (linear + momentum, angular + side.position_m.cross(&momentum) + side.spin_n_m_s)
    });
    (linear, angular, bodies.energy_j(state))
}

#[test]
fn a_million_free_steps_keep_momentum_and_energy() {
    let (bodies, first, _) = contact_case(Integrator::SemiImplicit);
    let tumbling = BodyMotion { rate_rad_per_s: Vector3::new(0.3, -0.2, 0.25), ..BodyMotion::default() };
    let bodies = bodies.with_target(tumbling).unwrap();
    let mut state = bodies.start(&first);
    let (first_state, before) = (state, books(&bodies, &state));
    let step = Step { index: 0, now: Nanos(0), dt: Nanos(1_000_000) };
    for _ in 0..1_000_000 {
        bodies.step(&mut state, step, &Wrench::default());
    }
    let after = books(&bodies, &state);
    assert_eq!(after.0, before.0, "linear momentum is the same to the bit");
    assert_eq!(state.chaser().spin_n_m_s, first_state.chaser().spin_n_m_s);
    assert_eq!(state.target().spin_n_m_s, first_state.target().spin_n_m_s);
    // About the global origin it is only as good as the position: 10⁶ sums, each off by half a unit in the last place at most.
    // They are not random, since the increment is the same each time.
    let sides = bodies.bodies_at_interface().iter().zip([state.chaser(), state.target()]);
    let angular_allowed: f64 = sides
        .map(|(body, side)| body.mass_kg() * side.velocity_m_per_s.norm() * side.position_m.norm())
        .map(|size| size * 1e6 * 0.5 * f64::EPSILON)
        .sum();
    assert!((after.1 - before.1).norm() < angular_allowed, "{} {angular_allowed}", (after.1 - before.1).norm());
    // The attitude is rounded about twenty times in a step, each up to ε/2: as a random walk, ten units of 10³ ε.
    let energy_allowed = 10.0 * 1e3 * f64::EPSILON;
    assert!((after.2 / before.2 - 1.0).abs() < energy_allowed, "{} {energy_allowed}", after.2 / before.2 - 1.0);
    assert!((state.chaser().attitude.norm() - 1.0).abs() < 4.0 * f64::EPSILON);
}

// Two bodies in contact ------------------------------------------------------------------------------------------------

fn contact_case(integrator: Integrator) -> (TwoBody, Motion, Value) {
    let case = published("two_body");
    let body = |name: &str| {
        let inertia = matrix(&case[&format!("{name}_inertia_kg_m2")]);
        Body::new(number(&case, &format!("{name}_mass_kg")), inertia).unwrap()
    };
    let probe = Pose::new(vector(&case["tip_m"]), attitude(&case["tip_rotation"]));
    let nozzle = Pose::new(vector(&case["nozzle_m"]), attitude(&case["nozzle_rotation"]));
    let target = BodyMotion {
        position_m: vector(&case["start_target_position_m"]),
        attitude: attitude(&case["start_target_rotation"]),
        velocity_m_per_s: vector(&case["start_target_velocity_m_per_s"]),
        rate_rad_per_s: vector(&case["start_target_rate_rad_per_s"]),
    };
    let first = Motion {
        position_m: vector(&case["start_position_m"]),
        attitude: attitude(&case["start_rotation"]),
        velocity_m_per_s: vector(&case["start_velocity_m_per_s"]),
        rate_rad_per_s: vector(&case["start_rate_rad_per_s"]),
        ..Motion::default()
    };
    let bodies = TwoBody::new(body("chaser"), body("target"), probe, nozzle, integrator).unwrap();
    (bodies.with_target(target).unwrap(), first, case)
}

/// The contact of the case: a one-sided spring and dashpot along z that never pulls; drag across and about.
fn contact(case: &Value, motion: &Motion) -> Wrench {
    // On the grid of the test the onset is the end of a step, to rounding: which side of it must not be left to chance.
    const ROUNDING_M: f64 = 1e-12;
    let (position, velocity) = (motion.position_m, motion.velocity_m_per_s);
    let push = number(case, "stiffness_n_per_m") * position.z + number(case, "damping_n_s_per_m") * velocity.z;
    if position.z <= -ROUNDING_M || push <= 0.0 {
        return Wrench::default();
    }
    let across = number(case, "across_s_per_m");
    Wrench {
        force_n: Vector3::new(-across * velocity.x, -across * velocity.y, -1.0) * push,
        torque_n_m: motion.rate_rad_per_s * (-number(case, "torsion_m_s") * push),
    }
}

/// How a tick takes its wrench from the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Taken {
    /// At its start: first order, as a sampled loop does.
    AtStart,
    /// In its middle, found with the wrench of its start: second order.
    Midway,
}

fn tick(bodies: &TwoBody, state: &mut TwoBodyState, case: &Value, taken: Taken, tick_s: f64) {
    let mut wrench = contact(case, &bodies.motion(state));
    let mut pushes = bodies.pushes(state, &wrench);
    if taken == Taken::Midway {
        let mut middle = *state;
        bodies.advance(&mut middle, 0.5 * tick_s, &pushes);
        wrench = contact(case, &bodies.motion(&middle));
        pushes = bodies.pushes(&middle, &wrench);
    }
    bodies.advance(state, tick_s, &pushes);
}

/// Positions, rotations, velocities and rates of both bodies and their relative motion at the times of the case. The contact
/// begins on the grid.
fn collide(integrator: Integrator, taken: Taken, ticks_to_contact: f64) -> [Vec<f64>; 3] {
    let (bodies, first, case) = contact_case(integrator);
    let tick_s = numbers(&case["contact_s"])[0] / ticks_to_contact;
    let mut state = bodies.start(&first);
    let mut found = [vec![], vec![], vec![]];
    let mut ticks = 0_u32;
    for time_s in numbers(&case["time_s"]) {
        while f64::from(ticks + 1) * tick_s <= time_s {
            tick(&bodies, &mut state, &case, taken, tick_s);
            ticks += 1;
        }
        let mut then = state;
        tick(&bodies, &mut then, &case, taken, time_s - f64::from(ticks) * tick_s);
        for (place, motion) in bodies.motions(&then).iter().enumerate() {
            found[place].extend(motion.position_m.iter().chain(&motion.velocity_m_per_s).chain(&motion.rate_rad_per_s));
            found[place].extend(motion.attitude.to_rotation_matrix().matrix().transpose().iter());
        }
        let relative = bodies.motion(&then);
        found[2].extend(relative.position_m.iter().chain(&relative.velocity_m_per_s));
    }
    found
}

#[test]
fn an_impact_off_both_centres_is_that_of_another_solver() {
    let (_, _, case) = contact_case(Integrator::ExactHold);
    let at = |name: &str, time: usize| numbers(&case[name][time]);
    let body = |name: &str| -> Vec<f64> {
        let parts = ["position_m", "velocity_m_per_s", "rate_rad_per_s", "rotation"];
        (0..5).flat_map(|time| parts.map(|part| at(&format!("{name}_{part}"), time)).concat()).collect()
    };
    let between = ["relative_position_m", "relative_velocity_m_per_s"];
    let relative = (0..5).flat_map(|time| between.map(|part| at(part, time)).concat()).collect();
    let others = [body("chaser"), body("target"), relative];
    // A wrench that is taken at the start of the tick is of first order, in the middle of second, whatever turns the bodies.
    for (integrator, taken, order, ticks) in [
        (Integrator::SemiImplicit, Taken::AtStart, 1, 60.0),
        (Integrator::ExactHold, Taken::AtStart, 1, 60.0),
        (Integrator::ExactHold, Taken::Midway, 2, 60.0),
        (Integrator::RungeKutta4, Taken::Midway, 2, 60.0),
    ] {
        let coarse = collide(integrator, taken, ticks);
        let fine = collide(integrator, taken, 2.0 * ticks);
        // It lets go at 0.03 m/s. An impulse changes no speed or rate by more than 0.25 per kg or kg m (the tip, most: both
        // 1/m and both r²/J are 0.2), and no place within the last second by more.
        let tick_s = numbers(&case["contact_s"])[0] / (2.0 * ticks);
        let bend = Bend(number(&case, "stiffness_n_per_m") * 0.03 * tick_s * tick_s / 8.0 * 0.25);
        for (place, name) in ["chaser", "target", "relative"].iter().enumerate() {
            let about = format!("{integrator:?} {taken:?} {name}");
            let (error, all) = (number(&case, "error"), &others[place]);
            // Two of the five times are before it lets go.
            let touching = all.len() * 2 / 5;
            let runs: [&[f64]; 2] = [&coarse[place][..touching], &fine[place][..touching]];
            check_order(&about, order, runs, &all[..touching], error, None);
            check_order(&about, order, [&coarse[place], &fine[place]], all, error, Some(bend));
        }
    }
}

// One axis -------------------------------------------------------------------------------------------------------------

/// An impact at t = 0, x = 0 of a point mass; the force of a tick is taken in its middle, `delay_s` ago.
fn fall_in(case: &Value, tick: Nanos, delay_s: f64, force: &dyn Fn(f64, f64) -> f64) -> Vec<f64> {
    let plant = PointMass::of_mass(number(case, "mass_kg"));
    let felt = |state: &PointMassState| match state.position_m > 0.0 {
        true => force(state.position_m, state.velocity_m_per_s).max(0.0),
        false => 0.0,
    };
    let half = Step { index: 0, now: Nanos(0), dt: Nanos(tick.0 / 2) };
    let delay_ticks = libm::round(delay_s / tick.seconds()) as usize;
    let mut late = VecDeque::from(vec![0.0; delay_ticks]);
    let mut state = PointMassState { position_m: 0.0, velocity_m_per_s: number(case, "speed_m_per_s") };
    let (mut found, mut ticks) = (vec![], 0);
    for time_s in numbers(&case["time_s"]) {
        while ticks < libm::round(time_s / tick.seconds()) as i64 {
            let force_n = match delay_ticks {
                0 => {
                    let mut middle = state;
                    plant.step(&mut middle, half, &felt(&state));
                    felt(&middle)
                }
                _ => late.pop_front().unwrap(),
            };
            plant.step(&mut state, half, &force_n);
            late.push_back(felt(&state));
            plant.step(&mut state, half, &force_n);
            ticks += 1;
        }
        found.extend([state.position_m, state.velocity_m_per_s]);
    }
    found
}

fn check_impact(name: &str, force: &dyn Fn(&Value, f64, f64) -> f64) {
    let case = published(name);
    let delay_s = case["delay_s"].as_f64().unwrap_or(0.0);
    let (positions, velocities) = (numbers(&case["position_m"]), numbers(&case["velocity_m_per_s"]));
    let other: Vec<f64> = positions.into_iter().zip(velocities).flat_map(|(x, v)| [x, v]).collect();
    let law = |x: f64, v: f64| force(&case, x, v);
    let [coarse, fine] = [2_000_000, 1_000_000].map(|tick| fall_in(&case, Nanos(tick), delay_s, &law));
    let (error, tick_s) = (number(&case, "error"), 1e-3);
    // A law with a stiffness lets go with k v; within the last second that moves nothing further than the speed changes.
    let stiffness = case["stiffness_n_per_m"].as_f64().unwrap_or(0.0);
    let exit = number(&case, "exit_m_per_s").abs();
    let bend = Bend(stiffness * exit * tick_s * tick_s / 8.0 / number(&case, "mass_kg"));
    // All let go between 0.7 and 0.8 s, or later.
    let touching = 2 * numbers(&case["time_s"]).iter().filter(|&&time_s| time_s < 0.7).count();
    check_order(name, 2, [&coarse[..touching], &fine[..touching]], &other[..touching], error, None);
    check_order(name, 2, [&coarse, &fine], &other, error, Some(bend));
}

fn spring_dashpot(case: &Value, x: f64, v: f64) -> f64 {
    let law = SpringDashpot {
        stiffness_n_per_m: number(case, "stiffness_n_per_m"),
        damping_n_s_per_m: number(case, "damping_n_s_per_m"),
        sides: Sides::One,
    };
    let touch = AxisTouch { depth_m: x, rate_m_per_s: v };
    ContactLaw::<Axis>::clamped(&law, &touch, &law.force(&touch))
}

#[test]
fn impacts_are_those_of_another_solver() {
    check_impact("spring_dashpot", &spring_dashpot);
    check_impact("hertz", &|case, x, _| number(case, "stiffness_n_per_m_1_5") * x * x.sqrt());
    check_impact("hunt_crossley", &|case, x, v| {
        number(case, "stiffness_n_per_m_1_5") * x * x.sqrt() * (1.0 + 1.5 * number(case, "damping_c_s_per_m") * v)
    });
}

#[test]
fn delayed_impacts_are_those_of_another_solver() {
    check_impact("delayed_16_ms", &spring_dashpot);
    check_impact("delayed_32_ms", &spring_dashpot);
}
