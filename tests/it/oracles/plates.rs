//! Oracle O7: two free bodies in the plane, and the damping at which their impact neither gains nor loses energy.
//!
//! `reference/PHYSICS.md`, section 3.1, gives masses, inertias and the lever beside the centres of mass. Its change of energy with
//! speed comes out with the contact half a metre before each centre of mass, and on opposite sides of the two.

use nalgebra::Matrix2;
use sim_core::stability::exact::{critical_delay, damping_interval};
use sim_core::stability::planar::{PlanarBody, PlanarContact};
use std::collections::VecDeque;

const MASS_KG: f64 = 50.0;
const INERTIA_KG_M2: f64 = 2.0;
const STIFFNESS_N_PER_M: f64 = 3000.0;
const DELAY_S: f64 = 0.016;
/// From each centre of mass to the contact: along the line of approach, and beside it.
const AHEAD_M: f64 = 0.5;
const BESIDE_M: f64 = 0.155;

/// Position, angle, and their rates, of one body.
type Body = [f64; 6];

/// A tip on the chaser meets a face of the target that turns with it; the damper may pull while there is penetration. The
/// wrench of the poses of one delay ago acts on both bodies, from one contact point.
struct TwoPlates {
    damping: f64,
    /// Steps in one delay.
    steps: usize,
    /// Whether the wrench is held for a step, or taken as linear in it.
    held: bool,
}

/// Where a point fixed to a body is, and how it moves.
fn point(body: &Body, [x, y]: [f64; 2]) -> [f64; 4] {
    let (sin, cos) = (libm::sin(body[2]), libm::cos(body[2]));
    let (x, y) = (cos * x - sin * y, sin * x + cos * y);
    [body[0] + x, body[1] + y, body[3] - body[5] * y, body[4] + body[5] * x]
}

impl TwoPlates {
    /// Force and torque on the chaser, then on the target, about their centres of mass.
    fn wrenches(&self, chaser: &Body, target: &Body) -> [f64; 6] {
        let (tip, base) = (point(chaser, [AHEAD_M, BESIDE_M]), point(target, [-AHEAD_M, -BESIDE_M]));
        let (nx, ny) = (libm::cos(target[2]), libm::sin(target[2]));
        let (dx, dy) = (tip[0] - base[0], tip[1] - base[1]);
        let depth = dx * nx + dy * ny;
        if depth <= 0.0 {
            return [0.0; 6];
        }
        // The face's normal turns with the target.
        let turning = target[5] * (-dx * ny + dy * nx);
        let rate = (tip[2] - base[2]) * nx + (tip[3] - base[3]) * ny + turning;
        let force = STIFFNESS_N_PER_M * depth + self.damping * rate;
        let (fx, fy) = (-force * nx, -force * ny);
        let torque = |body: &Body| (tip[0] - body[0]) * fy - (tip[1] - body[1]) * fx;
        [fx, fy, torque(chaser), -fx, -fy, -torque(target)]
    }

    /// Energy gained by the impact in per cent of what was there, approaching each other at half this speed each.
    fn gain_per_cent(&self, speed: f64) -> f64 {
        let dt = DELAY_S / self.steps as f64;
        let mut chaser: Body = [0.0, 0.0, 0.0, 0.5 * speed, 0.0, 0.0];
        let mut target: Body = [2.0 * AHEAD_M, 2.0 * BESIDE_M, 0.0, -0.5 * speed, 0.0, 0.0];
        let energy = |body: &Body| {
            0.5 * MASS_KG * (body[3] * body[3] + body[4] * body[4]) + 0.5 * INERTIA_KG_M2 * body[5] * body[5]
        };
        let before = energy(&chaser) + energy(&target);
        let mut late = VecDeque::from(vec![[0.0; 6]; self.steps]);
        for _ in 0..35 * self.steps {
            late.push_back(self.wrenches(&chaser, &target));
            let now = late.pop_front().unwrap();
            let next = if self.held { now } else { late[0] };
            for (body, offset) in [(&mut chaser, 0), (&mut target, 3)] {
                for axis in 0..3 {
                    let inertia = if axis == 2 { INERTIA_KG_M2 } else { MASS_KG };
                    let (a, b) = (now[offset + axis] / inertia, next[offset + axis] / inertia);
                    body[axis] += dt * body[axis + 3] + dt * dt / 6.0 * (2.0 * a + b);
                    body[axis + 3] += 0.5 * dt * (a + b);
                }
            }
        }
        100.0 * ((energy(&chaser) + energy(&target)) / before - 1.0)
    }
}

/// `reference/PHYSICS.md`, section 3.1: speed m/s, and the change of energy at 48.82 and at 50 N s/m in per cent.
const CHANGES: [(f64, f64, f64); 3] = [(0.01, 0.23, -0.83), (0.035, 0.44, -0.62), (0.1, 1.0, -0.04)];

/// DIFFERENCE: the numbers of the source come out with a wrench that is held for steps of 0.1 ms, not with fine ones. Holding is
/// half a step of delay, worth k dt/2 = 0.15 N s/m or 0.14 %.
#[test]
fn o7_two_bodies_in_the_plane_change_their_energy_as_in_the_table() {
    for (speed, at_low, at_50) in CHANGES {
        for (damping, expected) in [(48.82, at_low), (50.0, at_50)] {
            let held = TwoPlates { damping, steps: 160, held: true }.gain_per_cent(speed);
            let fine = TwoPlates { damping, steps: 1600, held: false }.gain_per_cent(speed);
            println!("{speed} m/s, {damping} N s/m: held {held:.3} %, fine {fine:.3} %, the source has {expected} %");
            // Where in its step a release falls is open: b v dt of the momentum m v, twice in the energy, of which the normal
            // motion has 62 %.
            let place = 100.0 * 2.0 * 0.62 * damping * 1e-4 / 15.6;
            assert!((held - expected).abs() < place + 0.005, "{speed} m/s, {damping}: {held}, expected {expected}");
            assert!((held - fine - 0.14).abs() < place, "{speed} m/s, {damping}: {held} {fine}");
        }
    }
}

#[test]
fn o7_two_bodies_in_the_plane_need_the_damping_of_the_reduced_mass() {
    let body = |side: f64| PlanarBody {
        mass_kg: MASS_KG,
        inertia_kg_m2: INERTIA_KG_M2,
        normal_lever_m: side * BESIDE_M,
        tangential_lever_m: side * AHEAD_M,
    };
    let plane = PlanarContact {
        chaser: body(1.0),
        target: body(-1.0),
        stiffness_n_per_m: Matrix2::new(STIFFNESS_N_PER_M, 0.0, 0.0, 0.0),
        damping_n_s_per_m: Matrix2::new(50.0, 0.0, 0.0, 0.0),
    };
    let mass = plane.reduced_mass_kg().unwrap();
    assert!((mass - 15.6).abs() < 0.05, "{mass}");
    assert_eq!(plane.normal_critical_delay().unwrap(), critical_delay(mass, STIFFNESS_N_PER_M, 50.0));
    let low = damping_interval(mass, STIFFNESS_N_PER_M, DELAY_S).unwrap().unwrap().low_n_s_per_m;
    for (speed, ..) in CHANGES {
        let gain = |damping: f64| TwoPlates { damping, steps: 1600, held: false }.gain_per_cent(speed);
        let (mut gains, mut loses) = (45.0, 55.0);
        for _ in 0..12 {
            let middle = 0.5 * (gains + loses);
            if gain(middle) > 0.0 { gains = middle } else { loses = middle }
        }
        println!("{speed} m/s: neutral at {gains:.2} N s/m, linear {low:.2}");
        assert!((48.8..=50.0).contains(&gains), "{speed} m/s: {gains}");
    }
}
