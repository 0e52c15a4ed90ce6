//! A spring that follows a power of the depth, after Hertz: `f = K sign(d) |d|^n + b d'`, positive resists penetration.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | K | stiffness | N/m^n | given, or `4/3 E √R` of a ball |
//! | n | exponent; 3/2 for round bodies of elastic material | 1 | Hertz |
//! | b | dashpot beside the spring, or 0 | N s/m | given |
//! | d | penetration | m | |
//! | E | effective modulus, `1/E = (1 - ν₁²)/E₁ + (1 - ν₂²)/E₂` | Pa | material |
//! | R | radius of the ball | m | |
//!
//! Without a dashpot the peak force grows with the approach speed as `v^(2n / (n + 1))`, which is v^1.2, and the contact lasts
//! `~ v^((1 - n) / (1 + n))`, which is v^-0.2: faster is stiffer. The effect `stiffness-power-law` is this law for a diagnosis,
//! with the stiffness k and the depth d₀ at which both springs agree: `K = k d₀^(1 - n)`, see [`Hertz::agreeing`].
//!
//! Not modelled: waves in the bodies, plastic flow; the dashpot steps at first touch, see `hunt_crossley` for one that does not.

use super::power::Power;
use super::{DepthLaw, Sides};
use crate::refusal::{self, Refusal};
use crate::signals::ContactForce;
use crate::space::{Axis, AxisTouch};

/// Exponent of two round elastic bodies.
pub const EXPONENT_OF_ROUND_BODIES: f64 = 1.5;

/// Power law of the depth, with or without a dashpot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hertz {
    stiffness_n_per_m_to_n: f64,
    power: Power,
    damping_n_s_per_m: f64,
    sides: Sides,
}

impl Hertz {
    /// From stiffness K, exponent n and dashpot b. Negative damping is unstable, and is answered.
    pub fn new(stiffness: f64, exponent: f64, damping_n_s_per_m: f64, sides: Sides) -> Result<Self, Refusal> {
        Ok(Hertz {
            stiffness_n_per_m_to_n: refusal::not_negative("stiffness_n_per_m_to_n", stiffness, "N/m^n")?,
            power: Power::new("exponent", exponent)?,
            damping_n_s_per_m: refusal::finite("damping_n_s_per_m", damping_n_s_per_m, "N s/m")?,
            sides,
        })
    }

    /// The one-sided law of this exponent that resists as a linear spring does at `depth_m`, without a dashpot.
    pub fn agreeing(stiffness_n_per_m: f64, depth_m: f64, exponent: f64) -> Result<Self, Refusal> {
        refusal::not_negative("stiffness_n_per_m", stiffness_n_per_m, "N/m")?;
        refusal::positive("depth_m", depth_m, "m")?;
        Hertz::new(stiffness_n_per_m * libm::pow(depth_m, 1.0 - exponent), exponent, 0.0, Sides::One)
    }

    /// The one-sided law of an elastic ball on a flat, without a dashpot.
    pub fn of_ball(radius_m: f64, effective_modulus_pa: f64) -> Result<Self, Refusal> {
        refusal::positive("radius_m", radius_m, "m")?;
        refusal::positive("effective_modulus_pa", effective_modulus_pa, "Pa")?;
        let stiffness = 4.0 / 3.0 * effective_modulus_pa * libm::sqrt(radius_m);
        Hertz::new(stiffness, EXPONENT_OF_ROUND_BODIES, 0.0, Sides::One)
    }
}

impl DepthLaw for Hertz {
    fn resistance(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        ContactForce {
            elastic: self.stiffness_n_per_m_to_n * self.power.of(touch.depth_m),
            dissipative: self.damping_n_s_per_m * touch.rate_m_per_s,
        }
    }

    fn sides(&self) -> Sides {
        self.sides
    }
}
