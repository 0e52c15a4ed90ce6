//! Restitution: what is left of the approach speed.
//!
//! Two definitions diverge as damping grows; each number carries its own. For a mass on a spring and a dashpot without delay,
//! with ζ = b / (2 √(k m)), w = √(1 - ζ²), φ = atan2(2 ζ w, 1 - 2 ζ²) and τ = ω₀ t:
//!
//! | quantity | formula |
//! |---|---|
//! | force | `f = v₀ √(k m) e^{-ζτ} sin(w τ + φ) / w` |
//! | release at d = 0: the interface may pull until then | `τ = π / w` |
//! | release at f = 0: nothing sticks (Schwager and Pöschel) | `τ = (π - φ) / w` |
//! | restitution, either way | `e = exp(-ζ τ)` |
//! | peak force | at `τ = (acos ζ - φ) / w`, where `f = v₀ √(k m) e^{-ζτ}`; for ζ ≥ 1/2 at the first touch, where `f = b v₀` |
//!
//! From ζ = 1 on the mass never comes back to d = 0; f = 0 is reached at `τ = artanh(2 ζ u / (2 ζ² - 1)) / u`, u = √(ζ² - 1).
//!
//! Small delays are not in here: they act as `b - k τ` of damping (below 0.3 % at 63.2 kg, 1066 N/m and 40 ms).

use serde::{Deserialize, Serialize};

/// Where a contact is said to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Release {
    /// At zero penetration: the interface may pull until then.
    ZeroDepth,
    /// At zero force: the interface never pulls.
    #[default]
    ZeroForce,
}

impl Release {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Release::ZeroDepth => "release at d = 0",
            Release::ZeroForce => "release at f = 0",
        }
    }
}

/// Restitution and duration of an undelayed contact on a spring and a dashpot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rebound {
    /// Speed after over speed before.
    pub restitution: f64,
    /// From first touch to release, in s.
    pub duration_s: f64,
}

/// The rebound; at zero depth none from ζ = 1 on, because the mass does not come back.
pub fn rebound(release: Release, mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Option<Rebound> {
    let ratio = damping_ratio(mass_kg, stiffness_n_per_m, damping_n_s_per_m);
    let at = match release {
        Release::ZeroDepth if ratio >= 1.0 => return None,
        Release::ZeroDepth => core::f64::consts::PI / libm::sqrt(1.0 - ratio * ratio),
        Release::ZeroForce => zero_force_at(ratio),
    };
    Some(Rebound { restitution: libm::exp(-ratio * at), duration_s: at / libm::sqrt(stiffness_n_per_m / mass_kg) })
}

/// When the force is zero again, in units of 1 / ω₀.
fn zero_force_at(ratio: f64) -> f64 {
    let left = 1.0 - ratio * ratio;
    if left > 0.0 {
        (core::f64::consts::PI - phase(ratio)) / libm::sqrt(left)
    } else if left < 0.0 {
        let u = libm::sqrt(-left);
        libm::atanh(2.0 * ratio * u / (2.0 * ratio * ratio - 1.0)) / u
    } else {
        2.0
    }
}

/// φ of the module's table, for ζ < 1.
fn phase(ratio: f64) -> f64 {
    libm::atan2(2.0 * ratio * libm::sqrt(1.0 - ratio * ratio), 1.0 - 2.0 * ratio * ratio)
}

/// Largest force of that contact, in N.
pub fn peak_force_n(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64, speed_m_per_s: f64) -> f64 {
    let ratio = damping_ratio(mass_kg, stiffness_n_per_m, damping_n_s_per_m);
    if ratio >= 0.5 {
        return damping_n_s_per_m * speed_m_per_s;
    }
    let at = (libm::acos(ratio) - phase(ratio)) / libm::sqrt(1.0 - ratio * ratio);
    speed_m_per_s * libm::sqrt(stiffness_n_per_m * mass_kg) * libm::exp(-ratio * at)
}

/// Restitution with release at zero penetration; 0 where the mass does not come back.
pub fn released_at_zero_depth(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> f64 {
    let rebound = rebound(Release::ZeroDepth, mass_kg, stiffness_n_per_m, damping_n_s_per_m);
    rebound.map_or(0.0, |rebound| rebound.restitution)
}

/// Restitution with release at zero force.
pub fn released_at_zero_force(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> f64 {
    let rebound = rebound(Release::ZeroForce, mass_kg, stiffness_n_per_m, damping_n_s_per_m);
    rebound.map_or(0.0, |rebound| rebound.restitution)
}

/// Damping ratio ζ of the undelayed contact.
pub fn damping_ratio(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> f64 {
    damping_n_s_per_m / (2.0 * libm::sqrt(stiffness_n_per_m * mass_kg))
}

/// Restitution of a recording: mean speed after, over mean speed before.
pub fn from_speeds(before_m_per_s: f64, after_m_per_s: f64) -> f64 {
    -after_m_per_s / before_m_per_s
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damping ratio on the mass 1 and the stiffness 1.
    fn at(release: Release, ratio: f64) -> Rebound {
        rebound(release, 1.0, 1.0, 2.0 * ratio).unwrap()
    }

    #[test]
    fn the_formula_of_zero_force_is_continuous_where_the_mass_stops_swinging() {
        // f = 0 at τ = 2 there, by de l'Hospital; the slope of τ in ζ is -4/3.
        for near in [1.0 - 1e-6, 1.0, 1.0 + 1e-6] {
            let found = at(Release::ZeroForce, near);
            assert!((found.duration_s - 2.0).abs() < 2e-6, "{near}: {found:?}");
            assert!((found.restitution - libm::exp(-2.0)).abs() < 2e-6, "{near}: {found:?}");
        }
        assert_eq!(rebound(Release::ZeroDepth, 1.0, 1.0, 2.0), None, "it creeps back for ever");
    }

    #[test]
    fn a_lossless_spring_gives_everything_back_after_half_a_period() {
        for release in [Release::ZeroDepth, Release::ZeroForce] {
            let found = at(release, 0.0);
            assert!((found.restitution - 1.0).abs() < 1e-15);
            assert!((found.duration_s - core::f64::consts::PI).abs() < 1e-15);
        }
        assert!((peak_force_n(4.0, 9.0, 0.0, 0.5) - 3.0).abs() < 1e-14, "v √(k m)");
    }

    #[test]
    fn the_peak_force_of_a_strong_dashpot_is_at_the_first_touch() {
        let below = peak_force_n(1.0, 1.0, 2.0 * (0.5 - 1e-9), 1.0);
        let above = peak_force_n(1.0, 1.0, 2.0 * (0.5 + 1e-9), 1.0);
        assert!((below - above).abs() < 1e-8 && (above - 1.0).abs() < 1e-8, "{below} {above}");
    }
}
