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

impl Integrator {
    /// Moves a body on.
    #[inline]
    pub(crate) fn advance(self, body: &Body, state: &mut BodyState, tick_s: f64, push: &Push) {
        match self {
            Integrator::SemiImplicit => semi_implicit(body, state, tick_s, push),
            Integrator::ExactHold => exact_hold(body, state, tick_s, push),
            Integrator::RungeKutta4 => runge_kutta_4(body, state, tick_s, push),
        }
    }
}

#[inline]
fn semi_implicit(body: &Body, state: &mut BodyState, tick_s: f64, push: &Push) {
    let moment = push.moment_n_m(&state.position_m);
    body.kick(state, &(push.force_n * tick_s), &(moment * tick_s));
    state.position_m += state.velocity_m_per_s * tick_s;
    body.turn(state, tick_s);
}

#[inline]
fn exact_hold(body: &Body, state: &mut BodyState, tick_s: f64, push: &Push) {
    let half_s = 0.5 * tick_s;
    let moment = push.moment_n_m(&(state.position_m + state.velocity_m_per_s * half_s));
    let (impulse_n_s, moment_n_m_s) = (push.force_n * half_s, moment * half_s);
    body.kick(state, &impulse_n_s, &moment_n_m_s);
    // Now it has the average velocity of the tick.
    state.position_m += state.velocity_m_per_s * tick_s;
    body.turn(state, tick_s);
    body.kick(state, &impulse_n_s, &moment_n_m_s);
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
    state.attitude = unit(first + (k1 + (k2 + k3) * 2.0 + k4) * (tick_s / 6.0));
    body.kick(state, &(push.force_n * half_s), &(end - before.spin_n_m_s));
    state.position_m += state.velocity_m_per_s * tick_s;
    body.kick(state, &(push.force_n * half_s), &nalgebra::Vector3::zeros());
}
