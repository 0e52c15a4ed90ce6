//! The closed form for one dead time: `m s² + (b s + k) e^{-hs} = 0`.
//!
//! `ω² = (b² + √(b⁴ + 4 m² k²)) / (2 m²)`, `h_crit = atan(b ω / k) / ω`. For m, k, b > 0 the loop is stable for 0 ≤ h < h_crit,
//! and never again beyond. Contact that never pulls is another matter: its e = 1 boundary lies above this one.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass | kg |
//! | k, b | stiffness and damping, real and virtual together | N/m, N s/m |
//! | h | dead time of the loop | s |
//! | ω | crossing frequency | rad/s |

/// The edge of stability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Critical {
    /// Dead time at which a pair of roots sits on the imaginary axis.
    pub delay_s: f64,
    /// Frequency of that pair.
    pub frequency_rad_per_s: f64,
}

/// The critical dead time, or `None` unless mass, stiffness and damping are positive (without damping any delay destabilises).
pub fn critical_delay(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Option<Critical> {
    let positive = |value: f64| value.is_finite() && value > 0.0;
    if !(positive(mass_kg) && positive(stiffness_n_per_m) && positive(damping_n_s_per_m)) {
        return None;
    }
    let (b2, mk) = (damping_n_s_per_m * damping_n_s_per_m, mass_kg * stiffness_n_per_m);
    let frequency2 = (b2 + libm::sqrt(b2 * b2 + 4.0 * mk * mk)) / (2.0 * mass_kg * mass_kg);
    let frequency_rad_per_s = libm::sqrt(frequency2);
    let phase = libm::atan(damping_n_s_per_m * frequency_rad_per_s / stiffness_n_per_m);
    Some(Critical { delay_s: phase / frequency_rad_per_s, frequency_rad_per_s })
}
