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

use super::body::{Body, BodyState, Push, unit};
use super::lanes::{Symmetric, Two, turned};
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

/// Two bodies that are moved on side by side; the first is free, the second may be fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    pub first: Body,
    pub second: Body,
    inverse_inertia: [Two; 6],
}

impl Pair {
    pub(crate) fn new(first: Body, second: Body) -> Self {
        let (a, b) = (first.inverse_inertia().0, second.inverse_inertia().0);
        Pair { first, second, inverse_inertia: core::array::from_fn(|i| Two(a[i], b[i])) }
    }

    /// Moves both on by one tick.
    #[inline]
    pub(crate) fn advance(
        &self,
        how: Integrator,
        states: (&mut BodyState, &mut BodyState),
        tick_s: f64,
        on: &[Push; 2],
    ) {
        let (first, second) = states;
        match how {
            Integrator::SemiImplicit => {
                semi_implicit(&self.first, first, tick_s, &on[0]);
                semi_implicit(&self.second, second, tick_s, &on[1]);
                self.turn(first, second, tick_s);
            }
            Integrator::ExactHold => {
                let later = half_a_kick(&self.first, first, tick_s, &on[0]);
                let later_too = half_a_kick(&self.second, second, tick_s, &on[1]);
                self.turn(first, second, tick_s);
                self.first.kick(first, &later.0, &later.1);
                self.second.kick(second, &later_too.0, &later_too.1);
            }
            Integrator::RungeKutta4 => {
                runge_kutta_4(&self.first, first, tick_s, &on[0]);
                runge_kutta_4(&self.second, second, tick_s, &on[1]);
            }
        }
    }

    /// Turns both freely; angular momentum and energy stay.
    #[inline]
    fn turn(&self, first: &mut BodyState, second: &mut BodyState, tick_s: f64) {
        let (a, b) = (first.attitude.coords, second.attitude.coords);
        // nalgebra stores x, y, z, w.
        let attitude = [Two(a[3], b[3]), Two(a[0], b[0]), Two(a[1], b[1]), Two(a[2], b[2])];
        let (a, b) = (&first.spin_n_m_s, &second.spin_n_m_s);
        let spin = [Two(a[0], b[0]), Two(a[1], b[1]), Two(a[2], b[2])];
        let half = Two(0.5 * tick_s, 0.5 * tick_s);
        let [w, x, y, z] = turned(attitude, spin, &Symmetric(self.inverse_inertia.map(|part| part * half)));
        first.attitude = UnitQuaternion::new_unchecked(Quaternion::new(w.0, x.0, y.0, z.0));
        second.attitude = UnitQuaternion::new_unchecked(Quaternion::new(w.1, x.1, y.1, z.1));
    }
}

/// All but the turn.
#[inline(always)]
fn semi_implicit(body: &Body, state: &mut BodyState, tick_s: f64, push: &Push) {
    let moment = push.moment_n_m(&state.position_m);
    body.kick(state, &(push.force_n * tick_s), &(moment * tick_s));
    state.position_m += state.velocity_m_per_s * tick_s;
}

/// All that comes before the turn; gives the kick that comes after it.
#[inline(always)]
fn half_a_kick(body: &Body, state: &mut BodyState, tick_s: f64, push: &Push) -> (Vector3<f64>, Vector3<f64>) {
    let half_s = 0.5 * tick_s;
    let moment = push.moment_n_m(&(state.position_m + state.velocity_m_per_s * half_s));
    let kick = (push.force_n * half_s, moment * half_s);
    body.kick(state, &kick.0, &kick.1);
    // Now it has the average velocity of the tick.
    state.position_m += state.velocity_m_per_s * tick_s;
    kick
}

fn runge_kutta_4(body: &Body, state: &mut BodyState, tick_s: f64, push: &Push) {
    let half_s = 0.5 * tick_s;
    let before = *state;
    let spin_after = |time_s: f64| {
        let mean = before.position_m + before.velocity_m_per_s * (0.5 * time_s);
        before.spin_n_m_s + push.moment_n_m(&mean) * time_s
    };
    let (middle, end) = (spin_after(half_s), spin_after(tick_s));
    let first = before.attitude.into_inner();
    let k1 = body.attitude_rate(&first, &before.spin_n_m_s);
    let k2 = body.attitude_rate(&(first + k1 * half_s), &middle);
    let k3 = body.attitude_rate(&(first + k2 * half_s), &middle);
    let k4 = body.attitude_rate(&(first + k3 * tick_s), &end);
    let later = half_a_kick(body, state, tick_s, push);
    body.kick(state, &later.0, &later.1);
    if !body.is_fixed() {
        state.attitude = unit(first + (k1 + (k2 + k3) * 2.0 + k4) * (tick_s / 6.0));
    }
}
