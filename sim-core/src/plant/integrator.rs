//! How a free body is moved on by a push that is held for one tick.
//!
//! The push is held in global axes, at a point that is held as well. Whatever the integrator, linear and angular momentum about
//! the global origin change by `T F` and by `T (p × F + τ)` to rounding: action and reaction cancel exactly.
//!
//! | integrator | translation | rotation | energy |
//! |---|---|---|---|
//! | semi-implicit | kick, then drift: first order, no phase error on average | kick, then free turn | `ΔE = T F · (u + u⁺)/2` exactly, u before and after the kick |
//! | exact hold | exact: `ρ += v T + F T²/(2m)` | half a kick, free turn, half a kick: second order | the same, for each kick |
//! | Runge-Kutta 4 | exact | fourth order | kept to T⁵ a step in free motion, not exactly |
//!
//! The arm of a force about a centre of mass that moves on during the tick: at its start, `p - ρ`, for the kick; on average,
//! `p - ρ - v T/2`, for the hold (the part from the acceleration is parallel to the force). Either is what keeps the sum.
//! For a held force the angular momentum is a polynomial of second degree in time, which Runge-Kutta integrates exactly: it is
//! written down as such, and only the attitude goes through the four stages.

use super::body::{Body, BodyState, Push};
use super::lanes::{Symmetric, Triple, Two, attitude_rate, cross, minus, plus, sum, times, turned, unit};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// How a tick is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Kick, then drift.
    SemiImplicit,
    /// The push held over the tick.
    ExactHold,
    /// Fourth order of Runge and Kutta.
    RungeKutta4,
}

/// Two bodies that are moved on side by side; the second may be fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    bodies: [Body; 2],
    inverse_mass: Two,
    inverse_inertia: Symmetric<Two>,
    /// One of a body that moves, zero of one that is fixed.
    free: Two,
}

/// How both move: [`BodyState`] side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PairState {
    pub position: Triple<Two>,
    /// w, x, y, z.
    pub attitude: [Two; 4],
    pub velocity: Triple<Two>,
    pub spin: Triple<Two>,
}

/// Puts the components of two vectors side by side.
#[inline(always)]
fn beside(a: &Vector3<f64>, b: &Vector3<f64>) -> Triple<Two> {
    [Two(a.x, b.x), Two(a.y, b.y), Two(a.z, b.z)]
}

impl PairState {
    pub(crate) fn new(first: &BodyState, second: &BodyState) -> Self {
        let (a, b) = (&first.attitude, &second.attitude);
        PairState {
            position: beside(&first.position_m, &second.position_m),
            attitude: [Two(a.w, b.w), Two(a.i, b.i), Two(a.j, b.j), Two(a.k, b.k)],
            velocity: beside(&first.velocity_m_per_s, &second.velocity_m_per_s),
            spin: beside(&first.spin_n_m_s, &second.spin_n_m_s),
        }
    }

    #[inline(always)]
    pub(crate) fn first_attitude(&self) -> UnitQuaternion<f64> {
        let [w, i, j, k] = self.attitude;
        UnitQuaternion::new_unchecked(Quaternion::new(w.0, i.0, j.0, k.0))
    }

    #[inline(always)]
    pub(crate) fn second_attitude(&self) -> UnitQuaternion<f64> {
        let [w, i, j, k] = self.attitude;
        UnitQuaternion::new_unchecked(Quaternion::new(w.1, i.1, j.1, k.1))
    }

    pub(crate) fn first(&self) -> BodyState {
        let one = |triple: Triple<Two>| Vector3::from(triple.map(|two| two.0));
        BodyState {
            position_m: one(self.position),
            attitude: self.first_attitude(),
            velocity_m_per_s: one(self.velocity),
            spin_n_m_s: one(self.spin),
        }
    }

    pub(crate) fn second(&self) -> BodyState {
        let one = |triple: Triple<Two>| Vector3::from(triple.map(|two| two.1));
        BodyState {
            position_m: one(self.position),
            attitude: self.second_attitude(),
            velocity_m_per_s: one(self.velocity),
            spin_n_m_s: one(self.spin),
        }
    }
}

impl Pair {
    pub(crate) fn new(bodies: [Body; 2]) -> Self {
        let [a, b] = bodies.map(|body| body.inverse_inertia().0);
        let [free, free_too] = bodies.map(|body| if body.is_fixed() { 0.0 } else { 1.0 });
        Pair {
            bodies,
            inverse_mass: Two(1.0 / bodies[0].mass_kg(), 1.0 / bodies[1].mass_kg()),
            inverse_inertia: Symmetric(core::array::from_fn(|i| Two(a[i], b[i]))),
            free: Two(free, free_too),
        }
    }

    pub(crate) fn bodies(&self) -> &[Body; 2] {
        &self.bodies
    }

    /// The rates of both, each in its own axes, from their angular momentum in these axes.
    #[inline(always)]
    pub(crate) fn rates(&self, spin_in_body: Triple<Two>) -> Triple<Two> {
        self.inverse_inertia.times(spin_in_body)
    }

    /// Moves both on by one tick.
    #[inline]
    pub(crate) fn advance(&self, how: Integrator, state: &mut PairState, tick_s: f64, on: &[Push; 2]) {
        let (tick, half) = (Two(tick_s, tick_s), Two(0.5 * tick_s, 0.5 * tick_s));
        // Coming to unit length could change the last bit of an attitude that nothing turns.
        let kept = self.bodies[1].is_fixed().then_some(state.attitude);
        match how {
            Integrator::SemiImplicit => {
                let kick = Kick::new(on, state.position, tick);
                self.kick(state, &kick);
                state.position = plus(state.position, times(state.velocity, tick));
                self.turn(state, half);
            }
            Integrator::ExactHold => {
                let on_average = plus(state.position, times(state.velocity, half));
                let kick = Kick::new(on, on_average, half);
                self.kick(state, &kick);
                // Now both have the average velocity of the tick.
                state.position = plus(state.position, times(state.velocity, tick));
                self.turn(state, half);
                self.kick(state, &kick);
            }
            Integrator::RungeKutta4 => self.runge_kutta_4(state, tick, on),
        }
        if let Some(kept) = kept {
            for (part, kept) in state.attitude.iter_mut().zip(kept) {
                part.1 = kept.1;
            }
        }
    }

    fn runge_kutta_4(&self, state: &mut PairState, tick: Two, on: &[Push; 2]) {
        let half = tick * Two(0.5, 0.5);
        // The moment of a held force about a centre that drifts: from its average place, a quarter and half a tick on.
        let quarter_on = plus(state.position, times(state.velocity, half * Two(0.5, 0.5)));
        let half_on = plus(state.position, times(state.velocity, half));
        let (to_middle, to_end) = (Kick::new(on, quarter_on, half), Kick::new(on, half_on, tick));
        let middle = plus(state.spin, times(to_middle.moment, self.free));
        let end = plus(state.spin, times(to_end.moment, self.free));
        let half_inverse = Symmetric(self.inverse_inertia.0.map(|part| part * Two(0.5, 0.5)));
        let rate = |q, spin| attitude_rate(q, spin, &half_inverse);
        let on_by = |k: [Two; 4], time: Two| sum(state.attitude, k.map(|part| part * time));
        let k1 = rate(state.attitude, state.spin);
        let k2 = rate(on_by(k1, half), middle);
        let k3 = rate(on_by(k2, half), middle);
        let k4 = rate(on_by(k3, tick), end);
        let inner = sum(k2, k3).map(|part| part * Two(2.0, 2.0));
        state.attitude = unit(on_by(sum(sum(k1, inner), k4), tick * Two(1.0 / 6.0, 1.0 / 6.0)));
        let average = plus(state.velocity, times(to_middle.impulse, self.inverse_mass));
        state.position = plus(state.position, times(average, tick));
        state.velocity = plus(state.velocity, times(to_end.impulse, self.inverse_mass));
        state.spin = end;
    }

    #[inline(always)]
    fn kick(&self, state: &mut PairState, kick: &Kick) {
        state.velocity = plus(state.velocity, times(kick.impulse, self.inverse_mass));
        state.spin = plus(state.spin, times(kick.moment, self.free));
    }

    /// Turns both freely; angular momentum and energy stay.
    #[inline(always)]
    fn turn(&self, state: &mut PairState, half: Two) {
        let half_inverse = Symmetric(self.inverse_inertia.0.map(|part| part * half));
        state.attitude = turned(state.attitude, state.spin, &half_inverse);
    }
}

/// Impulses on both, and their moments about the centres of mass.
struct Kick {
    impulse: Triple<Two>,
    moment: Triple<Two>,
}

impl Kick {
    #[inline(always)]
    fn new(on: &[Push; 2], centres: Triple<Two>, duration: Two) -> Self {
        let force = beside(&on[0].force_n, &on[1].force_n);
        let arm = minus(beside(&on[0].point_m, &on[1].point_m), centres);
        let moment = plus(cross(arm, force), beside(&on[0].torque_n_m, &on[1].torque_n_m));
        Kick { impulse: times(force, duration), moment: times(moment, duration) }
    }
}
