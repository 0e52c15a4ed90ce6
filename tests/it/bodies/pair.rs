//! Two free bodies that meet off both centres of mass: the plane, the spring and dashpot and the friction of `sim_core`, in space.

use super::{Bend, attitude, check_order, matrix, number, numbers, published, vector};
use nalgebra::Vector3;
use serde_json::Value;
use sim_core::contact::{ContactLaw, Friction, Sides, SpringDashpot};
use sim_core::frames::Pose;
use sim_core::geometry::{Geometry, Plane};
use sim_core::plant::{Body, BodyMotion, Integrator, Plant, TwoBody, TwoBodyState};
use sim_core::space::{Motion, Spatial, Wrench};

pub fn contact_case(integrator: Integrator) -> (TwoBody, Motion, Value) {
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

/// The laws of the case: a one-sided spring and dashpot that never pulls on a plane, with friction across it, and a torque.
struct Contact {
    law: Friction<SpringDashpot>,
    /// Torque against the turn, for each newton of the push. No law of ours has it: it is added here.
    torsion_m_s: f64,
}

impl Contact {
    fn of(case: &Value) -> Self {
        // The drag of the case is viscous: friction of a speed at which √(v² + ε²) is ε to rounding, since no slip reaches 0.1 m/s.
        const SMOOTHING_M_PER_S: f64 = 1e7;
        let law = SpringDashpot {
            stiffness_n_per_m: number(case, "stiffness_n_per_m"),
            damping_n_s_per_m: number(case, "damping_n_s_per_m"),
            sides: Sides::One,
        };
        let coefficient = number(case, "across_s_per_m") * SMOOTHING_M_PER_S;
        Contact {
            law: Friction::new(law.checked().unwrap(), coefficient, SMOOTHING_M_PER_S).unwrap(),
            torsion_m_s: number(case, "torsion_m_s"),
        }
    }

    fn wrench(&self, motion: &Motion) -> Wrench {
        // On the grid of the test the onset is the end of a step, to rounding: which side of it must not be left to chance.
        const ROUNDING_M: f64 = 1e-12;
        let mut touch = Geometry::<Spatial>::touch(&Plane, motion);
        if touch.depth_m.abs() < ROUNDING_M {
            touch.depth_m = ROUNDING_M;
        }
        let contact = ContactLaw::<Spatial>::clamped(&self.law, &touch, &self.law.force(&touch));
        let push_n = touch.normal.dot(&contact.force_n);
        contact + Wrench { force_n: Vector3::zeros(), torque_n_m: motion.rate_rad_per_s * (-self.torsion_m_s * push_n) }
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

fn tick(bodies: &TwoBody, state: &mut TwoBodyState, contact: &Contact, taken: Taken, tick_s: f64) {
    let mut wrench = contact.wrench(&bodies.motion(state));
    let mut pushes = bodies.pushes(state, &wrench);
    if taken == Taken::Midway {
        let mut middle = *state;
        bodies.advance(&mut middle, 0.5 * tick_s, &pushes);
        wrench = contact.wrench(&bodies.motion(&middle));
        pushes = bodies.pushes(&middle, &wrench);
    }
    bodies.advance(state, tick_s, &pushes);
}

/// Positions, rotations, velocities and rates of both bodies and their relative motion at the times of the case. The contact
/// begins on the grid.
fn collide(integrator: Integrator, taken: Taken, ticks_to_contact: f64) -> [Vec<f64>; 3] {
    let (bodies, first, case) = contact_case(integrator);
    let contact = Contact::of(&case);
    let tick_s = numbers(&case["contact_s"])[0] / ticks_to_contact;
    let mut state = bodies.start(&first);
    let mut found = [vec![], vec![], vec![]];
    let mut ticks = 0_u32;
    for time_s in numbers(&case["time_s"]) {
        while f64::from(ticks + 1) * tick_s <= time_s {
            tick(&bodies, &mut state, &contact, taken, tick_s);
            ticks += 1;
        }
        let mut then = state;
        tick(&bodies, &mut then, &contact, taken, time_s - f64::from(ticks) * tick_s);
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
