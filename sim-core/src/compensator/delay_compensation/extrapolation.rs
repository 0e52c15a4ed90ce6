//! Extrapolation of the command: the robot is told where the satellites will be when it gets there.
//!
//! | order | equation |
//! |---|---|
//! | velocity | `x_p = x + v τ` |
//! | cubic | `x_p = 4 x(t) - 6 x(t - τ) + 4 x(t - 2τ) - x(t - 3τ)` (Horiuchi et al.) |
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x, v | position and velocity of the satellites | m, m/s |
//! | τ | believed delay of the loop | s |
//!
//! Benefit: no model of the contact; the command is a computed number without noise; stiffening hardly matters. Failure: the
//! cubic multiplies whatever noise the command carries by √69 = 8.3; each jump of acceleration at an impact comes three times
//! more, at τ, 2τ and 3τ; a wrong τ costs as much as in any other method.

use super::ring::{Ring, within_reach};
use super::{DelayCompensation, Felt};
use crate::delay;
use crate::refusal::{Refusal, not_negative};
use crate::space::AxisMotion;
use serde::{Deserialize, Serialize};

/// Which polynomial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Moved on with the velocity.
    Velocity,
    /// Through four positions.
    Cubic,
}

/// A command from the future.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Extrapolation {
    /// Which polynomial.
    pub order: Order,
    /// Believed delay τ.
    pub delay_s: f64,
}

/// Where the satellites were.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExtrapolationState {
    asked: Ring,
}

impl DelayCompensation for Extrapolation {
    type State = ExtrapolationState;

    fn start(&self, _period_s: f64) -> ExtrapolationState {
        ExtrapolationState::default()
    }

    fn check(&self, period_s: f64) -> Result<(), Refusal> {
        not_negative("delay_s", self.delay_s, "s")?;
        match self.order {
            Order::Velocity => Ok(()),
            Order::Cubic => within_reach("delay_s * 3", 3.0 * self.delay_s, period_s),
        }
    }

    fn force_n(&self, _state: &mut ExtrapolationState, felt: &Felt) -> f64 {
        felt.force_n
    }

    fn command(&self, state: &mut ExtrapolationState, asked: &AxisMotion, period_s: f64) -> AxisMotion {
        let position_m = match self.order {
            Order::Velocity => asked.position_m + asked.velocity_m_per_s * self.delay_s,
            Order::Cubic => {
                state.asked.push(asked, period_s);
                let past_m = |delays: f64| state.asked.at(delay::steps(delays * self.delay_s, period_s));
                4.0 * past_m(0.0) - 6.0 * past_m(1.0) + 4.0 * past_m(2.0) - past_m(3.0)
            }
        };
        AxisMotion { position_m, ..*asked }
    }
}
