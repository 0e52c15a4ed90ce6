//! Free motion: torque-free tumbling, and what a million steps keep.

use super::pair::contact_case;
use super::{ALL, check_order, matrix, number, numbers, published, vector};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sim_core::frames::Pose;
use sim_core::plant::{Body, BodyMotion, Integrator, Plant, TwoBody, TwoBodyState};
use sim_core::space::Wrench;
use sim_core::time::{Nanos, Step};

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
