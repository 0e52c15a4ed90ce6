//! Damping that grows with the elastic force, after Hunt and Crossley: `f = K d^n (1 + 3/2 c sign(d') |d'|^q)`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | K | stiffness | N/m^n | given |
//! | n | exponent of the depth; 3/2 for round bodies | 1 | Hertz |
//! | c | damping factor | (s/m)^q | given |
//! | q | exponent of the rate, 1 in their paper | 1 | thesis eq. 1.3, with the sign that it needs |
//! | d | penetration | m | |
//!
//! It starts and ends at zero force, which a dashpot does not: a one-sided contact never comes to pull, and both definitions of
//! release are one. For q = 1 restitution falls with the approach speed, `e = 1 - c v + …`, whatever n is (reference/PHYSICS.md,
//! section 4.2). The exponent of the rate multiplies a power of a speed that changes sign at the deepest point, so that the sign
//! has to be put back: `|d'|^q` alone would push outward on the way out and create energy.
//!
//! The effect `hunt-crossley` is the damping term alone with n = 1, for a diagnosis, on top of a linear spring k:
//! its coefficient is `3/2 c k`, in N s/m².
//!
//! Not modelled: what is lost to waves or plastic flow. Valid while `3/2 c |d'|^q` is below one on the way out; beyond, the sum
//! would pull, and a one-sided law lets go.

use super::power::Power;
use super::{DepthLaw, Sides};
use crate::refusal::{self, Refusal};
use crate::signals::ContactForce;
use crate::space::{Axis, AxisTouch};

/// Nonlinear spring whose damping grows with its force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HuntCrossley {
    stiffness_n_per_m_to_n: f64,
    depth_power: Power,
    damping_factor: f64,
    rate_power: Power,
    sides: Sides,
}

impl HuntCrossley {
    /// From stiffness K, exponent n, and the damping factor c in s/m. A negative factor is unstable, and is answered.
    pub fn new(stiffness: f64, exponent: f64, damping_s_per_m: f64, sides: Sides) -> Result<Self, Refusal> {
        Ok(HuntCrossley {
            stiffness_n_per_m_to_n: refusal::not_negative("stiffness_n_per_m_to_n", stiffness, "N/m^n")?,
            depth_power: Power::new("exponent", exponent)?,
            damping_factor: refusal::finite("damping_s_per_m", damping_s_per_m, "s/m")?,
            rate_power: Power::One,
            sides,
        })
    }

    /// The same law with another exponent q of the rate; the damping factor is then in (s/m)^q.
    pub fn with_rate_exponent(self, rate_exponent: f64) -> Result<Self, Refusal> {
        Ok(HuntCrossley { rate_power: Power::new("rate_exponent", rate_exponent)?, ..self })
    }
}

impl DepthLaw for HuntCrossley {
    fn resistance(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        let elastic_n = self.stiffness_n_per_m_to_n * self.depth_power.of(touch.depth_m);
        let share = 1.5 * self.damping_factor * self.rate_power.of(touch.rate_m_per_s);
        // Two-sided, the spring may be stretched; the damping opposes the rate there too.
        ContactForce { elastic: elastic_n, dissipative: elastic_n.abs() * share }
    }

    fn sides(&self) -> Sides {
        self.sides
    }
}
