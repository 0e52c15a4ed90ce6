//! An account of one tick: does momentum come from nowhere, and is the energy what the work says?
//!
//! Along one axis, for any integrator with `v⁺ = v - T F/m`: `(m/2)(v⁺² - v²) = -T F (v + v⁺)/2`, exactly. The force meets the
//! *mean* of the velocities before and after; with the velocity before, `Σ F v T` is off by `Σ F² T²/(2m)`.
//!
//! In space the same holds for each kick at a fixed attitude, with `u` and `ω` the means before and after it:
//! `ΔE = T Σ (F · u + (r × F + τ) · ω)`, r from the centre of mass to the point, and the free turn between kicks keeps the
//! energy. So the identity is exact for the semi-implicit step (one kick) and for the held wrench (two halves). Of
//! Runge-Kutta only momentum is exact: its energy is compared with the work of the held wrench, and the defect is its error.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | Δp, ΔH | change of linear, and of angular momentum about the global origin | N s, N m s |
//! | p, F, τ | point, force and torque of a push, held in global axes | m, N, N m |
//!
//! `Δp = T Σ F` and `ΔH = T Σ (p × F + τ)` over the bodies that are free: a defect here is a fault of the integrator.
//! Over *both* pushes these sums are zero if action and reaction are equal and act at one point: what is left is *injected*,
//! a fault of whoever made the pushes. A reaction at a pose that is late by 32 ms at 0.035 m/s is 1.1 mm off: 10 N across
//! that gap turn the pair with 0.011 N m that no body exerts.
//!
//! Not covered: whether the force is right.

use crate::plant::{Body, BodyState, Integrator, Push, TwoBody, TwoBodyState};
use nalgebra::Vector3;

/// The account of one tick. The defects are relative to the sizes of all that was added up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Account {
    /// Linear momentum that the impulses do not explain.
    pub linear_defect: f64,
    /// Angular momentum about the global origin that the impulses do not explain.
    pub angular_defect: f64,
    /// Kinetic energy that the work does not explain.
    pub energy_defect: f64,
    /// Linear momentum that action and reaction together bring in, in N s.
    pub injected_n_s: Vector3<f64>,
    /// Angular momentum about the global origin that action and reaction together bring in, in N m s.
    pub injected_n_m_s: Vector3<f64>,
}

impl Account {
    /// The account of the tick in which `pushes`, on chaser and target, took `before` to `after`.
    pub fn of(
        bodies: &TwoBody,
        before: &TwoBodyState,
        after: &TwoBodyState,
        tick_s: f64,
        pushes: &[Push; 2],
    ) -> Account {
        let [chaser, target] = *bodies.bodies_at_interface();
        let sides = [
            Side { body: chaser, before: before.chaser(), after: after.chaser(), push: pushes[0], tick_s },
            Side { body: target, before: before.target(), after: after.target(), push: pushes[1], tick_s },
        ];
        let (mut linear, mut angular) = (Vector::default(), Vector::default());
        let (mut energy_j, mut energy_size_j) = (0.0, 0.0);
        for side in sides.iter().filter(|side| !side.body.is_fixed()) {
            side.linear(&mut linear);
            side.angular(&mut angular);
            let (from_j, to_j) = (side.body.energy_j(&side.before), side.body.energy_j(&side.after));
            let work_j = side.work_j(bodies.integrator());
            energy_j += to_j - from_j - work_j;
            energy_size_j += from_j + to_j + work_j.abs();
        }
        let moment = |push: &Push| push.moment_n_m(&Vector3::zeros());
        Account {
            linear_defect: linear.relative(),
            angular_defect: angular.relative(),
            energy_defect: if energy_size_j > 0.0 { energy_j.abs() / energy_size_j } else { 0.0 },
            injected_n_s: (pushes[0].force_n + pushes[1].force_n) * tick_s,
            injected_n_m_s: (moment(&pushes[0]) + moment(&pushes[1])) * tick_s,
        }
    }
}

/// The worst tick of a run, and all that was brought in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Audit {
    /// Ticks looked at.
    pub ticks: u64,
    /// Largest [`Account::linear_defect`].
    pub linear_defect: f64,
    /// Largest [`Account::angular_defect`].
    pub angular_defect: f64,
    /// Largest [`Account::energy_defect`].
    pub energy_defect: f64,
    /// Sum of [`Account::injected_n_s`].
    pub injected_n_s: Vector3<f64>,
    /// Sum of [`Account::injected_n_m_s`].
    pub injected_n_m_s: Vector3<f64>,
}

impl Audit {
    /// Takes one tick in.
    pub fn take(&mut self, account: &Account) {
        // Not f64::max, which would drop what is not a number; and once there, it stays.
        let worse = |so_far: f64, now: f64| if now <= so_far || so_far.is_nan() { so_far } else { now };
        self.ticks += 1;
        self.linear_defect = worse(self.linear_defect, account.linear_defect);
        self.angular_defect = worse(self.angular_defect, account.angular_defect);
        self.energy_defect = worse(self.energy_defect, account.energy_defect);
        self.injected_n_s += account.injected_n_s;
        self.injected_n_m_s += account.injected_n_m_s;
    }

    /// Whether the books of the integrator close to this relative tolerance.
    pub fn closes(&self, tolerance: f64) -> bool {
        [self.linear_defect, self.angular_defect, self.energy_defect].iter().all(|&defect| defect <= tolerance)
    }
}

/// Relative defect of the energy identity along one axis, for a force that resists: `(m/2)(v⁺² - v²) + T F (v + v⁺)/2`.
pub fn axis_energy_defect(mass_kg: f64, before_m_per_s: f64, after_m_per_s: f64, tick_s: f64, force_n: f64) -> f64 {
    let (from_j, to_j) =
        (0.5 * mass_kg * before_m_per_s * before_m_per_s, 0.5 * mass_kg * after_m_per_s * after_m_per_s);
    let work_j = -tick_s * force_n * 0.5 * (before_m_per_s + after_m_per_s);
    let size_j = from_j + to_j + work_j.abs();
    if size_j > 0.0 { (to_j - from_j - work_j).abs() / size_j } else { 0.0 }
}

/// A sum of vectors that should be zero, and the size of what was summed.
#[derive(Default)]
struct Vector {
    sum: Vector3<f64>,
    size: f64,
}

impl Vector {
    /// Adds a vector; `size` is what its rounding is relative to.
    fn add(&mut self, vector: Vector3<f64>, size: f64) {
        self.sum += vector;
        self.size += size;
    }

    fn relative(&self) -> f64 {
        if self.size > 0.0 { self.sum.norm() / self.size } else { 0.0 }
    }
}

/// One body in one tick.
struct Side {
    body: Body,
    before: BodyState,
    after: BodyState,
    push: Push,
    tick_s: f64,
}

impl Side {
    fn linear(&self, defect: &mut Vector) {
        for (sign, state) in [(1.0, &self.after), (-1.0, &self.before)] {
            let momentum = state.velocity_m_per_s * self.body.mass_kg();
            defect.add(momentum * sign, momentum.norm());
        }
        let impulse = self.push.force_n * self.tick_s;
        defect.add(-impulse, impulse.norm());
    }

    fn angular(&self, defect: &mut Vector) {
        for (sign, state) in [(1.0, &self.after), (-1.0, &self.before)] {
            let momentum = state.velocity_m_per_s * self.body.mass_kg();
            defect.add(state.position_m.cross(&momentum) * sign, state.position_m.norm() * momentum.norm());
            defect.add(state.spin_n_m_s * sign, state.spin_n_m_s.norm());
        }
        let Push { force_n, torque_n_m, point_m } = self.push;
        defect.add(-point_m.cross(&force_n) * self.tick_s, point_m.norm() * force_n.norm() * self.tick_s);
        defect.add(-torque_n_m * self.tick_s, torque_n_m.norm() * self.tick_s);
    }

    /// What the push did to this body: force times mean velocity, moment times mean rate, kick by kick.
    fn work_j(&self, integrator: Integrator) -> f64 {
        let velocity = (self.before.velocity_m_per_s + self.after.velocity_m_per_s) * 0.5;
        let force_j = self.push.force_n.dot(&velocity) * self.tick_s;
        let (first, last) = (self.before.spin_n_m_s, self.after.spin_n_m_s);
        let middle = (first + last) * 0.5;
        if integrator == Integrator::SemiImplicit {
            let moment = self.push.moment_n_m(&self.before.position_m);
            return force_j + self.rate(&self.before, &middle).dot(&moment) * self.tick_s;
        }
        let on_average = self.before.position_m + self.before.velocity_m_per_s * (0.5 * self.tick_s);
        let rate =
            self.rate(&self.before, &((first + middle) * 0.5)) + self.rate(&self.after, &((middle + last) * 0.5));
        force_j + rate.dot(&self.push.moment_n_m(&on_average)) * (0.5 * self.tick_s)
    }

    /// Rate of turn in global axes at the attitude of `state`, with this angular momentum.
    fn rate(&self, state: &BodyState, spin_n_m_s: &Vector3<f64>) -> Vector3<f64> {
        state.attitude * self.body.motion(&BodyState { spin_n_m_s: *spin_n_m_s, ..*state }).rate_rad_per_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Pose;
    use crate::plant::{BodyMotion, Plant};
    use crate::space::{Motion, Wrench};
    use nalgebra::{Matrix3, UnitQuaternion};

    fn bodies(integrator: Integrator) -> TwoBody {
        let chaser = Body::new(60.0, Matrix3::new(3.0, 0.3, 0.1, 0.3, 4.0, 0.2, 0.1, 0.2, 5.0)).unwrap();
        let target = Body::new(200.0, Matrix3::new(20.0, -2.0, 0.0, -2.0, 30.0, 1.0, 0.0, 1.0, 35.0)).unwrap();
        let turn = |x: f64, y: f64, z: f64| UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z));
        let probe = Pose::new(Vector3::new(0.1, -0.2, 0.6), turn(0.02, 0.01, -0.3));
        let nozzle = Pose::new(Vector3::new(-0.3, 0.1, -0.8), turn(3.0, 0.1, 0.2));
        let tumbling = BodyMotion { rate_rad_per_s: Vector3::new(0.05, 0.08, -0.06), ..BodyMotion::default() };
        TwoBody::new(chaser, target, probe, nozzle, integrator).unwrap().with_target(tumbling).unwrap()
    }

    fn approach() -> Motion {
        Motion {
            position_m: Vector3::new(0.01, -0.02, -0.01),
            velocity_m_per_s: Vector3::new(0.002, -0.001, 0.035),
            rate_rad_per_s: Vector3::new(-0.01, 0.02, 0.005),
            ..Motion::default()
        }
    }

    /// Off centre, with a torque: what an askew contact does.
    const CONTACT: Wrench = Wrench { force_n: Vector3::new(1.0, -2.0, -9.0), torque_n_m: Vector3::new(0.2, 0.4, -0.1) };

    fn audit(integrator: Integrator, tick_s: f64, ticks: u32) -> Audit {
        let bodies = bodies(integrator);
        let mut state = bodies.start(&approach());
        let mut audit = Audit::default();
        for _ in 0..ticks {
            let before = state;
            let pushes = bodies.pushes(&state, &CONTACT);
            bodies.advance(&mut state, tick_s, &pushes);
            audit.take(&Account::of(&bodies, &before, &state, tick_s, &pushes));
        }
        audit
    }

    #[test]
    fn the_books_of_both_kicking_integrators_close() {
        for integrator in [Integrator::SemiImplicit, Integrator::ExactHold] {
            let audit = audit(integrator, 0.004, 500);
            // A few dozen roundings, relative to what is added up.
            assert!(audit.closes(64.0 * f64::EPSILON), "{integrator:?} {audit:?}");
            assert_eq!(audit.injected_n_s, Vector3::zeros());
            assert_eq!(audit.injected_n_m_s, Vector3::zeros());
        }
    }

    /// The account can fail: books of one integrator do not close by the rule of the other, and Runge-Kutta keeps momentum only.
    #[test]
    fn the_books_of_runge_kutta_close_for_momentum_and_not_for_energy() {
        let coarse = audit(Integrator::RungeKutta4, 0.04, 50);
        assert!(coarse.linear_defect.max(coarse.angular_defect) < 64.0 * f64::EPSILON, "{coarse:?}");
        assert!(coarse.energy_defect > 1e-9, "{coarse:?}");
        // The work of a held wrench by the mean of both ends is of third order in the step, locally.
        let fine = audit(Integrator::RungeKutta4, 0.02, 100);
        let order = libm::log2(coarse.energy_defect / fine.energy_defect);
        assert!((order - 3.0).abs() < 0.3, "{order}");
    }

    /// reference/PHYSICS.md, section 3.2: 1.1 mm and 10 N make 0.011 N m.
    #[test]
    fn a_reaction_at_another_point_injects_angular_momentum() {
        let bodies = bodies(Integrator::SemiImplicit);
        let mut state = bodies.start(&approach());
        let before = state;
        let mut pushes = bodies.pushes(&state, &Wrench { force_n: Vector3::x() * 10.0, torque_n_m: Vector3::zeros() });
        let along = state.target().attitude * Vector3::z();
        pushes[1].point_m -= along * (0.035 * 0.032);
        bodies.advance(&mut state, 0.001, &pushes);
        let account = Account::of(&bodies, &before, &state, 0.001, &pushes);
        assert!((account.injected_n_m_s.norm() / 0.001 - 0.0112).abs() < 1e-12, "{account:?}");
        assert!(account.injected_n_s.norm() == 0.0 && account.angular_defect < 64.0 * f64::EPSILON, "{account:?}");
        // It really is in the state, not only in the book.
        let angular = |state: &TwoBodyState| {
            [(60.0, state.chaser()), (200.0, state.target())].iter().fold(Vector3::zeros(), |sum, (mass, body)| {
                sum + body.position_m.cross(&(body.velocity_m_per_s * *mass)) + body.spin_n_m_s
            })
        };
        let gained = angular(&state) - angular(&before);
        assert!((gained - account.injected_n_m_s).norm() < 1e-13, "{gained}");
    }

    #[test]
    fn what_is_not_a_number_closes_no_book() {
        let mut audit = Audit::default();
        let defect = f64::NAN;
        let account = Account {
            linear_defect: 0.0,
            angular_defect: 0.0,
            energy_defect: defect,
            injected_n_s: Vector3::zeros(),
            injected_n_m_s: Vector3::zeros(),
        };
        audit.take(&account);
        audit.take(&Account { energy_defect: 0.0, ..account });
        assert!(!audit.closes(1.0));
    }
}
