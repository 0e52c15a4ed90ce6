//! Observed energy of a contact, never without its pairing.
//!
//! With f positive when it resists and v positive when it closes, `E = Σ f v Δt` is what the port absorbed: E > 0 is passive,
//! E < 0 is active (it created energy). The two-port form `E = Σ (fr vr - fm vm) Δt` is what the robots between the satellites
//! (fr, vr) and the hardware (fm, vm) absorbed.
//!
//! What a wrong pairing shows, for a spring k on the mass m:
//!
//! | pairing | error |
//! |---|---|
//! | held force with the mean velocity of its tick | none: `(m/2)(v₊² - v₋²) = -T F (v₊ + v₋)/2` |
//! | held force with the velocity before its tick | `+Σ F² T² / (2m)`, as if kT/2 of damping were there |
//! | velocity late by D | as if k D of damping were there |
//! | force late by D | as if k D of damping were missing |
//!
//! White noise of the force, σ at each tick, gives the sum a standard deviation of `σ T √(Σ v²)`. White noise of a position x
//! whose differences are the velocity gives it `σ_x √(Σ (f_n - f_{n+1})²)`. A constant bias adds nothing over a contact that
//! ends where it began. Slow noise is not in these figures.

use serde::{Deserialize, Serialize};

/// Which force was paired with which velocity, and how they were aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pairing {
    /// The net force on the satellites with the mean of their velocity before and after the tick: exact.
    #[default]
    FeedbackWithSatelliteMean,
    /// The force at the interface with the achieved velocity at the same instant.
    InterfaceWithAchieved,
    /// The newest reading of the sensor with the rate of the measured pose over the tick that ends with it.
    SensedWithMeasured,
    /// Two-port: the first pairing minus the third.
    FeedbackMinusSensed,
}

impl Pairing {
    /// In words, for every report that shows an energy.
    pub fn words(self) -> &'static str {
        match self {
            Pairing::FeedbackWithSatelliteMean => {
                "net force on the satellites x mean of their velocity before and after the tick"
            }
            Pairing::InterfaceWithAchieved => "interface force x achieved velocity, same instant",
            Pairing::SensedWithMeasured => {
                "newest reading of the sensor x rate of the measured pose over the tick before it"
            }
            Pairing::FeedbackMinusSensed => {
                "net force on the satellites x mean of their velocity, minus newest reading x rate of the measured pose"
            }
        }
    }
}

/// What a port did with energy, as far as the sensor can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activity {
    /// It absorbed energy.
    Passive,
    /// Inside the noise band: neither can be said.
    Neutral,
    /// It created energy.
    Active,
}

impl Activity {
    /// Of this energy, with a noise band of `band_j` on either side of zero.
    pub fn of(energy_j: f64, band_j: f64) -> Self {
        if energy_j > band_j {
            Activity::Passive
        } else if energy_j < -band_j {
            Activity::Active
        } else {
            Activity::Neutral
        }
    }

    /// The word.
    pub fn word(self) -> &'static str {
        match self {
            Activity::Passive => "passive",
            Activity::Neutral => "neutral",
            Activity::Active => "active",
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
    force_sigma_n * tick_s * libm::sqrt(squares(velocity_m_per_s))
}

/// Standard deviation of the observed energy, in J, from white noise of the position whose differences are the velocity:
/// `σ_x √(Σ (f_n - f_{n+1})²)`, the ends included.
pub fn observed_sd_of_position_j(position_sigma_m: f64, force_n: &[f64]) -> f64 {
    let inner: f64 = force_n.windows(2).map(|pair| (pair[0] - pair[1]) * (pair[0] - pair[1])).sum();
    let end = |force_n: Option<&f64>| force_n.map_or(0.0, |force_n| force_n * force_n);
    position_sigma_m * libm::sqrt(inner + end(force_n.first()) + end(force_n.last()))
}

/// Damping, in N s/m, that would absorb this energy at these velocities: `b_obs = E / Σ v² Δt` (thesis Fig. 4.11); none without
/// motion.
pub fn observed_damping_n_s_per_m(energy_j: f64, velocity_m_per_s: &[f64], tick_s: f64) -> Option<f64> {
    let sum = squares(velocity_m_per_s) * tick_s;
    (sum > 0.0).then(|| energy_j / sum)
}

fn squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    #[test]
    fn the_noise_band_is_neither_passive_nor_active() {
        assert_eq!(Activity::of(2.1, 2.0), Activity::Passive);
        assert_eq!(Activity::of(-2.1, 2.0), Activity::Active);
        assert_eq!(Activity::of(-2.0, 2.0), Activity::Neutral);
    }

    #[test]
    fn a_dashpot_is_found_again_and_without_motion_nothing_is() {
        let velocity: Vec<f64> = (0..100).map(|i| libm::sin(0.1 * f64::from(i))).collect();
        let force: Vec<f64> = velocity.iter().map(|v| 40.0 * v).collect();
        let energy_j = observed_j(&force, &velocity, 0.004);
        let found = observed_damping_n_s_per_m(energy_j, &velocity, 0.004).unwrap();
        // A hundred products and two sums of them.
        assert!((found - 40.0).abs() < 200.0 * f64::EPSILON * 40.0, "{found}");
        assert_eq!(observed_damping_n_s_per_m(1.0, &[0.0, 0.0], 0.004), None);
    }

    /// `Σ f_n (x_n - x_{n-1})` by hand, for one error of 1 at each place in turn.
    #[test]
    fn the_position_s_noise_is_summed_by_parts() {
        let force = [1.0, 4.0, 9.0];
        let sum = |error: [f64; 4]| -> f64 { (0..3).map(|n| force[n] * (error[n + 1] - error[n])).sum() };
        let mut variance = 0.0;
        for place in 0..4 {
            let mut error = [0.0; 4];
            error[place] = 1.0;
            variance += sum(error) * sum(error);
        }
        assert!((observed_sd_of_position_j(1.0, &force) - libm::sqrt(variance)).abs() < 1e-14);
    }
}
