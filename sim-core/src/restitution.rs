//! Restitution: what is left of the approach speed.
//!
//! Two definitions diverge as damping grows; each number carries its own. With ζ = b / (2 √(k m)) and no delay:
//! release at d = 0 gives `e = exp(-π ζ / √(1 - ζ²))`; release at f = 0 (nothing sticks) gives `e = exp(-ζ ω₀ T)` with
//! `T = (π - atan2(2 ζ w, w² - ζ²)) / (w ω₀)`, `w = √(1 - ζ²)` (Schwager and Pöschel).

/// Release at zero penetration: the interface may pull until then.
pub fn released_at_zero_depth(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> f64 {
    let ratio = damping_ratio(mass_kg, stiffness_n_per_m, damping_n_s_per_m);
    libm::exp(-core::f64::consts::PI * ratio / libm::sqrt(1.0 - ratio * ratio))
}

/// Release at zero force: the interface never pulls.
pub fn released_at_zero_force(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> f64 {
    let ratio = damping_ratio(mass_kg, stiffness_n_per_m, damping_n_s_per_m);
    let w = libm::sqrt(1.0 - ratio * ratio);
    let phase = core::f64::consts::PI - libm::atan2(2.0 * ratio * w, w * w - ratio * ratio);
    libm::exp(-ratio * phase / w)
}

/// Damping ratio ζ of the undelayed contact.
pub fn damping_ratio(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> f64 {
    damping_n_s_per_m / (2.0 * libm::sqrt(stiffness_n_per_m * mass_kg))
}

/// Restitution of a recording: mean speed after, over mean speed before.
pub fn from_speeds(before_m_per_s: f64, after_m_per_s: f64) -> f64 {
    -after_m_per_s / before_m_per_s
}
