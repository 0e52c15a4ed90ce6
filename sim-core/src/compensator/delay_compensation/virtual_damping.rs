//! Virtual damping against the delay: `F = f + b v` while the sensor feels contact, with b = k τ (thesis 4.3).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k | believed stiffness of the contact | N/m |
//! | τ | believed delay of the loop | s |
//! | v | commanded velocity, positive closes | m/s |
//!
//! Benefit: a delayed spring behaves as one without delay and a damping of -k τ, and this takes it away: 1.276 becomes 1.012.
//! Failure: a stiffness or delay that is believed wrong by 30 % leaves 7 % of restitution, a spring that stiffens leaves more;
//! b saturates near π m / (2 τ); the damping acts only while contact is felt, which is later than contact.

use super::{DelayCompensation, Felt};
use crate::refusal::{Refusal, not_negative};
use serde::{Deserialize, Serialize};

/// Damping on the commanded velocity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VirtualDamping {
    /// Believed stiffness k.
    pub stiffness_n_per_m: f64,
    /// Believed delay τ.
    pub delay_s: f64,
}

impl DelayCompensation for VirtualDamping {
    type State = ();

    fn start(&self, _period_s: f64) {}

    fn check(&self, _period_s: f64) -> Result<(), Refusal> {
        not_negative("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        not_negative("delay_s", self.delay_s, "s").map(|_| ())
    }

    fn force_n(&self, _state: &mut (), felt: &Felt) -> f64 {
        let damping_n_s_per_m = self.stiffness_n_per_m * self.delay_s;
        let touches = felt.force_n != 0.0;
        if touches { felt.force_n + damping_n_s_per_m * felt.commanded.velocity_m_per_s } else { 0.0 }
    }
}
