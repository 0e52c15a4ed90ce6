//! Two free rigid bodies, chaser and target, that push each other at the probe tip.
//!
//! `x_N = Dᵀ (p - n)`, `v_N = Dᵀ (v_C + ω_C × r_C - v_T - ω_T × r_T)`, `ω_N = Dᵀ (ω_C - ω_T)`,
//! `m_C v_C' = F`, `m_T v_T' = -F`, `L_C' = r_C × F + τ`, `L_T' = -r_T × F - τ`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | p, n | probe tip, nozzle origin, global | m |
//! | D | nozzle axes → global axes | 1 |
//! | r_C, r_T | from each centre of mass to the probe tip, global: the arms of one and the same point | m |
//! | F, τ | wrench on the chaser at the probe tip; contact along the axis has F_z < 0 in the nozzle frame | N, N m |
//!
//! The velocity is the rate of the position *in the nozzle frame*, which turns with the target: it is the velocity of the tip
//! against the point of the target that is there now. Action and reaction act at the same point, so that no angular momentum
//! comes from nowhere; [`TwoBody::advance`] takes two pushes of your own where that is to be studied.
//!
//! Not modelled: orbital motion, gravity gradient, thrusters (put their wrench into a push), flexible bodies.

use super::Plant;
use super::body::{Body, BodyMotion, BodyState, Push};
use super::integrator::{Integrator, Pair, PairState};
use super::lanes::{Triple, Two, in_body};
use crate::frames::{Chaser, Nozzle, Pose, Probe, Target};
use crate::refusal::{Refusal, finite};
use crate::space::{Motion, Spatial, Wrench};
use crate::time::Step;
use nalgebra::{UnitQuaternion, Vector3};

/// Chaser and target, where their interfaces sit, and how the target begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoBody {
    bodies: [Body; 2],
    probe: Pose<Chaser, Probe>,
    nozzle: Pose<Target, Nozzle>,
    target_start: BodyMotion,
    integrator: Integrator,
    /// The bodies in the axes of their interfaces.
    pair: Pair,
    /// Probe tip in probe axes, and nozzle origin in nozzle axes, from the centres of mass.
    tip_m: Vector3<f64>,
    nozzle_m: Vector3<f64>,
}

/// How both bodies move, each in the axes of its interface: [`TwoBodyState::chaser`] and [`TwoBodyState::target`].
/// [`TwoBody::motions`] says it in the bodies' own axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoBodyState(PairState);

impl TwoBodyState {
    /// Both bodies, in the axes of their interfaces.
    pub fn new(chaser: &BodyState, target: &BodyState) -> Self {
        TwoBodyState(PairState::new(chaser, target))
    }

    /// The chaser; its attitude turns *probe* axes into global axes.
    pub fn chaser(&self) -> BodyState {
        self.0.first()
    }

    /// The target; its attitude turns *nozzle* axes into global axes.
    pub fn target(&self) -> BodyState {
        self.0.second()
    }
}

impl TwoBody {
    /// A chaser whose probe tip is at `probe` of its centre of mass, and a target with its nozzle at `nozzle`. The target begins
    /// at rest at the global origin. Refuses a fixed chaser and a pose that is not finite.
    pub fn new(
        chaser: Body,
        target: Body,
        probe: Pose<Chaser, Probe>,
        nozzle: Pose<Target, Nozzle>,
        integrator: Integrator,
    ) -> Result<Self, Refusal> {
        finite("chaser.mass_kg", chaser.mass_kg(), "kg")?;
        all_finite("probe.position_m", &probe.position_m, "m")?;
        all_finite("nozzle.position_m", &nozzle.position_m, "m")?;
        all_finite("probe.attitude", &probe.attitude.imag(), "")?;
        all_finite("nozzle.attitude", &nozzle.attitude.imag(), "")?;
        Ok(TwoBody {
            bodies: [chaser, target],
            probe,
            nozzle,
            target_start: BodyMotion::default(),
            integrator,
            pair: Pair::new([chaser.in_axes(&probe.attitude), target.in_axes(&nozzle.attitude)]),
            tip_m: probe.attitude.inverse() * probe.position_m,
            nozzle_m: nozzle.attitude.inverse() * nozzle.position_m,
        })
    }

    /// The same with a target that begins with this motion: elsewhere, drifting, tumbling. A fixed target only takes a pose.
    pub fn with_target(self, target_start: BodyMotion) -> Result<Self, Refusal> {
        all_finite("target.position_m", &target_start.position_m, "m")?;
        all_finite("target.attitude", &target_start.attitude.imag(), "")?;
        all_finite("target.velocity_m_per_s", &target_start.velocity_m_per_s, "m/s")?;
        all_finite("target.rate_rad_per_s", &target_start.rate_rad_per_s, "rad/s")?;
        let moving = [
            ("target.velocity_m_per_s", target_start.velocity_m_per_s.norm(), "m/s"),
            ("target.rate_rad_per_s", target_start.rate_rad_per_s.norm(), "rad/s"),
        ];
        for (name, value, unit) in moving {
            if self.bodies[1].is_fixed() && value > 0.0 {
                return Err(Refusal { name, value, unit, limit: "is not 0, but the target is fixed" });
            }
        }
        Ok(TwoBody { target_start, ..self })
    }

    /// Chaser and target, in their own axes.
    pub fn bodies(&self) -> &[Body; 2] {
        &self.bodies
    }

    /// Chaser and target, in the axes of their interfaces: those of the state.
    pub fn bodies_at_interface(&self) -> &[Body; 2] {
        self.pair.bodies()
    }

    /// How it is integrated.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// The state of these motions of chaser and target, in the bodies' own axes.
    pub fn state(&self, motions: &[BodyMotion; 2]) -> TwoBodyState {
        let state = |motion: &BodyMotion, body: &Body, interface: &UnitQuaternion<f64>| {
            let own = body.state(motion);
            BodyState { attitude: own.attitude * interface, ..own }
        };
        TwoBodyState::new(
            &state(&motions[0], &self.bodies[0], &self.probe.attitude),
            &state(&motions[1], &self.bodies[1], &self.nozzle.attitude),
        )
    }

    /// How chaser and target move, in the bodies' own axes.
    pub fn motions(&self, state: &TwoBodyState) -> [BodyMotion; 2] {
        let motion = |state: &BodyState, body: &Body, interface: &UnitQuaternion<f64>| {
            body.motion(&BodyState { attitude: state.attitude * interface.inverse(), ..*state })
        };
        [
            motion(&state.chaser(), &self.bodies[0], &self.probe.attitude),
            motion(&state.target(), &self.bodies[1], &self.nozzle.attitude),
        ]
    }

    /// What a wrench on the chaser at the probe tip, in the nozzle frame, does to chaser and target now.
    #[inline]
    pub fn pushes(&self, state: &TwoBodyState, wrench: &Wrench) -> [Push; 2] {
        let nozzle_axes = state.0.second_attitude().to_rotation_matrix().into_inner();
        let action = Push {
            force_n: nozzle_axes * wrench.force_n,
            torque_n_m: nozzle_axes * wrench.torque_n_m,
            point_m: Vector3::from(state.0.position.map(|two| two.0)) + state.0.first_attitude() * self.tip_m,
        };
        [action, action.reaction()]
    }

    /// Lets two pushes, held in global axes at their points, act on chaser and target for `tick_s`.
    #[inline]
    pub fn advance(&self, state: &mut TwoBodyState, tick_s: f64, pushes: &[Push; 2]) {
        self.pair.advance(self.integrator, &mut state.0, tick_s, pushes);
    }

    /// Kinetic energy of both.
    pub fn energy_j(&self, state: &TwoBodyState) -> f64 {
        let [chaser, target] = self.pair.bodies();
        chaser.energy_j(&state.chaser()) + target.energy_j(&state.target())
    }
}

impl Plant<Spatial> for TwoBody {
    type State = TwoBodyState;

    fn start(&self, first: &Motion) -> TwoBodyState {
        let target = self.target_start;
        let to_global = target.attitude;
        let axes = to_global * self.nozzle.attitude;
        let tip_m = target.position_m + to_global * self.nozzle.position_m + axes * first.position_m;
        let attitude = axes * first.attitude * self.probe.attitude.inverse();
        let arm_m = attitude * self.probe.position_m;
        let target_rate = to_global * target.rate_rad_per_s;
        let rate = target_rate + axes * first.rate_rad_per_s;
        let there = target.velocity_m_per_s + target_rate.cross(&(tip_m - target.position_m));
        let chaser = BodyMotion {
            position_m: tip_m - arm_m,
            attitude,
            velocity_m_per_s: there + axes * first.velocity_m_per_s - rate.cross(&arm_m),
            rate_rad_per_s: attitude.inverse() * rate,
        };
        self.state(&[chaser, target])
    }

    #[inline]
    fn motion(&self, state: &TwoBodyState) -> Motion {
        let state = &state.0;
        let (chaser, target) = (state.first_attitude(), state.second_attitude());
        let to_nozzle = target.to_rotation_matrix().into_inner().transpose();
        let attitude = target.inverse() * chaser;
        let probe_to_nozzle = attitude.to_rotation_matrix().into_inner();
        // Each body's rate in the axes of its own interface.
        let rates = self.pair.rates(in_body(state.attitude, state.spin));
        let chaser_rate = Vector3::from(rates.map(|two| two.0));
        let target_rate = Vector3::from(rates.map(|two| two.1));
        let between = |triple: Triple<Two>| to_nozzle * Vector3::from(triple.map(|two| two.0 - two.1));
        let apart_m = between(state.position) + probe_to_nozzle * self.tip_m;
        let velocity = between(state.velocity) + probe_to_nozzle * chaser_rate.cross(&self.tip_m);
        Motion {
            position_m: apart_m - self.nozzle_m,
            attitude,
            velocity_m_per_s: velocity - target_rate.cross(&apart_m),
            rate_rad_per_s: probe_to_nozzle * chaser_rate - target_rate,
            acceleration_m_per_s2: Vector3::zeros(),
        }
    }

    /// `feedback` is the wrench on the chaser at the probe tip, in the nozzle frame: contact reads negative along z.
    #[inline]
    fn step(&self, state: &mut TwoBodyState, step: Step, feedback: &Wrench) {
        let pushes = self.pushes(state, feedback);
        self.advance(state, step.dt.seconds(), &pushes);
    }
}

fn all_finite(name: &'static str, vector: &Vector3<f64>, unit: &'static str) -> Result<(), Refusal> {
    vector.iter().try_for_each(|&value| finite(name, value, unit).map(|_| ()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Nanos;
    use nalgebra::Matrix3;

    fn inertia(xx: f64, yy: f64, zz: f64, xy: f64) -> Matrix3<f64> {
        Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, zz)
    }

    fn turn(x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))
    }

    /// A tumbling target, interfaces off centre and askew: nothing cancels by symmetry.
    fn askew(integrator: Integrator) -> TwoBody {
        let chaser = Body::new(60.0, inertia(3.0, 4.0, 5.0, 0.3)).unwrap();
        let target = Body::new(200.0, inertia(20.0, 30.0, 35.0, -2.0)).unwrap();
        let probe = Pose::new(Vector3::new(0.1, -0.2, 0.6), turn(0.02, 0.01, -0.3));
        let nozzle = Pose::new(Vector3::new(-0.3, 0.1, -0.8), turn(3.0, 0.1, 0.2));
        let tumbling = BodyMotion {
            position_m: Vector3::new(0.4, 0.3, -0.2),
            attitude: turn(0.3, -0.5, 0.2),
            velocity_m_per_s: Vector3::new(0.01, -0.02, 0.03),
            rate_rad_per_s: Vector3::new(0.05, 0.08, -0.06),
        };
        TwoBody::new(chaser, target, probe, nozzle, integrator).unwrap().with_target(tumbling).unwrap()
    }

    fn approach() -> Motion {
        Motion {
            position_m: Vector3::new(0.01, -0.02, -0.1),
            attitude: turn(0.03, -0.02, 0.4),
            velocity_m_per_s: Vector3::new(0.002, -0.001, 0.035),
            rate_rad_per_s: Vector3::new(-0.01, 0.02, 0.005),
            acceleration_m_per_s2: Vector3::zeros(),
        }
    }

    fn step(dt: i64) -> Step {
        Step { index: 0, now: Nanos(0), dt: Nanos(dt) }
    }

    #[test]
    fn a_start_has_the_motion_that_was_asked_for() {
        let bodies = askew(Integrator::SemiImplicit);
        let motion = bodies.motion(&bodies.start(&approach()));
        // Two dozen products of numbers near one.
        let rounding = 32.0 * f64::EPSILON;
        assert!((motion.position_m - approach().position_m).norm() < rounding);
        assert!((motion.velocity_m_per_s - approach().velocity_m_per_s).norm() < rounding);
        assert!((motion.rate_rad_per_s - approach().rate_rad_per_s).norm() < rounding);
        assert!((motion.attitude.into_inner() - approach().attitude.into_inner()).norm() < rounding);
    }

    #[test]
    fn velocity_and_rate_are_those_of_position_and_attitude() {
        let bodies = askew(Integrator::RungeKutta4);
        let state = bodies.start(&approach());
        let [earlier, later] = [-100_000, 100_000].map(|dt| {
            let mut moved = state;
            bodies.step(&mut moved, step(dt), &Wrench::default());
            bodies.motion(&moved)
        });
        // Central difference over h = 0.1 ms: h²/6 of the third derivative (rate³ times metres, below 1e-3), and rounding / h.
        let allowed = 1e-8 * 1e-3 + 8.0 * f64::EPSILON / 1e-4;
        let velocity = (later.position_m - earlier.position_m) / 2e-4;
        assert!((velocity - approach().velocity_m_per_s).norm() < allowed, "{velocity}");
        let rate = (later.attitude * earlier.attitude.inverse()).scaled_axis() / 2e-4;
        assert!((rate - approach().rate_rad_per_s).norm() < allowed, "{rate}");
    }

    #[test]
    fn contact_slows_the_chaser_and_pushes_the_target() {
        let bodies = askew(Integrator::SemiImplicit);
        let mut state = bodies.start(&approach());
        let before = bodies.motion(&state).velocity_m_per_s.z;
        let contact = Wrench { force_n: Vector3::new(0.0, 0.0, -9.0), torque_n_m: Vector3::zeros() };
        let axis = state.target().attitude * Vector3::z();
        let target_before = state.target().velocity_m_per_s.dot(&axis);
        bodies.step(&mut state, step(1_000_000), &contact);
        assert!(bodies.motion(&state).velocity_m_per_s.z < before);
        assert!(state.target().velocity_m_per_s.dot(&axis) > target_before);
    }

    #[test]
    fn a_fixed_target_stays_and_takes_no_speed() {
        let chaser = Body::new(60.0, inertia(3.0, 4.0, 5.0, 0.3)).unwrap();
        let bodies =
            TwoBody::new(chaser, Body::fixed(), Pose::default(), Pose::default(), Integrator::ExactHold).unwrap();
        for integrator in [Integrator::SemiImplicit, Integrator::ExactHold, Integrator::RungeKutta4] {
            let nozzle = Pose::new(Vector3::x(), turn(0.1, 0.7, -0.9));
            let askew = TwoBody::new(chaser, Body::fixed(), Pose::default(), nozzle, integrator).unwrap();
            let mut state = askew.start(&approach());
            let target = state.target();
            for _ in 0..100 {
                askew.step(&mut state, step(1_000_000), &Wrench { force_n: Vector3::x(), torque_n_m: Vector3::y() });
            }
            assert_eq!(state.target(), target, "to the bit");
        }
        let mut state = bodies.start(&approach());
        let target = state.target();
        let force_n = Vector3::new(1.0, 2.0, -3.0);
        bodies.step(&mut state, step(4_000_000), &Wrench { force_n, torque_n_m: Vector3::x() });
        assert_eq!(state.target(), target);
        assert!(
            (state.chaser().velocity_m_per_s - approach().velocity_m_per_s - force_n * (0.004 / 60.0)).norm() < 1e-17
        );
        let moving = BodyMotion { velocity_m_per_s: Vector3::x(), ..BodyMotion::default() };
        let refusal = bodies.with_target(moving).unwrap_err();
        assert_eq!((refusal.name, refusal.value), ("target.velocity_m_per_s", 1.0));
    }

    #[test]
    fn a_fixed_chaser_and_a_pose_without_end_are_refused() {
        let body = Body::new(1.0, Matrix3::identity()).unwrap();
        let (probe, nozzle) = (Pose::default(), Pose::default());
        let refusal = TwoBody::new(Body::fixed(), body, probe, nozzle, Integrator::ExactHold).unwrap_err();
        assert_eq!(refusal.name, "chaser.mass_kg");
        let far = Pose::at(Vector3::new(0.0, f64::NAN, 0.0));
        let refusal = TwoBody::new(body, body, far, nozzle, Integrator::ExactHold).unwrap_err();
        assert_eq!(refusal.name, "probe.position_m");
    }
}
