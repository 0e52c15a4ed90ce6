//! Observed energy of a contact, never without its pairing.
//!
//! With f positive when it resists and v positive when it closes, `E = Σ f v Δt` is what the contact absorbed: E > 0 is passive,
//! E < 0 is active (it created energy). A sum over a held force is exact with the mean velocity of the tick:
//! `(m/2)(v₊² - v₋²) = -T F (v₊ + v₋)/2`. A force paired with a velocity that is late by D shows a false k D of damping.

use serde::{Deserialize, Serialize};

/// Which force was paired with which velocity, and how they were aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pairing {
    /// The net force on the satellites with the mean of their velocity before and after the tick: exact.
    FeedbackWithSatelliteMean,
    /// The force at the interface with the achieved velocity at the same instant.
    InterfaceWithAchieved,
}

impl Pairing {
    /// In words, for every report that shows an energy.
    pub fn words(self) -> &'static str {
        match self {
            Pairing::FeedbackWithSatelliteMean => {
                "net force on the satellites x mean of their velocity before and after the tick"
            }
            Pairing::InterfaceWithAchieved => "interface force x achieved velocity, same instant",
        }
    }
}

/// Energy that was absorbed, in J. `force_n` is positive when it resists, and held for `tick_s`; `velocity_m_per_s` is positive
/// when it closes.
pub fn observed_j(force_n: &[f64], velocity_m_per_s: &[f64], tick_s: f64) -> f64 {
    force_n.iter().zip(velocity_m_per_s).map(|(force, velocity)| force * velocity * tick_s).sum()
}

/// Standard deviation of the observed energy, in J, from white noise of the force: `σ T √(Σ v²)`.
pub fn observed_sd_j(force_sigma_n: f64, velocity_m_per_s: &[f64], tick_s: f64) -> f64 {
    let sum: f64 = velocity_m_per_s.iter().map(|velocity| velocity * velocity).sum();
    force_sigma_n * tick_s * libm::sqrt(sum)
}
