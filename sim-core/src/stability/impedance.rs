//! Where a delayed spring and damper take energy: the real part of their impedance at each frequency.
//!
//! `Z(iω) = (b + k/(iω)) e^{-iωh}`, `Re Z = b cos ωh - (k/ω) sin ωh`. A motion at ω loses energy to it where Re Z > 0. Without
//! frequencies of passivity near its own the loop feeds its oscillation.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k, b | stiffness and damping | N/m, N s/m |
//! | h | delay of the force | s |
//! | ω | frequency of the motion | rad/s |
//!
//! Source: `reference/PHYSICS.md`, correction 9.

use crate::refusal::{Refusal, not_negative, positive};
use core::f64::consts::FRAC_PI_2;

/// Re Z at one frequency, in N s/m; at zero frequency its limit b - k h.
pub fn resistance_n_s_per_m(stiffness_n_per_m: f64, damping_n_s_per_m: f64, delay_s: f64, omega_rad_per_s: f64) -> f64 {
    let phase = omega_rad_per_s * delay_s;
    // sin(ωh)/ω written with what stays finite at zero.
    let sine_s = if phase.abs() < 1e-8 { delay_s } else { delay_s * libm::sin(phase) / phase };
    damping_n_s_per_m * libm::cos(phase) - stiffness_n_per_m * sine_s
}

/// The upper end of the passive band that begins at zero frequency, in rad/s: `tan(ωh)/(ωh) = b/(k h)`.
///
/// `None` where there is no such band, b ≤ k h: then every frequency up to π/h is fed. Infinite without delay.
pub fn passive_until_rad_per_s(
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    delay_s: f64,
) -> Result<Option<f64>, Refusal> {
    positive("stiffness_n_per_m", stiffness_n_per_m, "N/m")?;
    not_negative("damping_n_s_per_m", damping_n_s_per_m, "N s/m")?;
    not_negative("delay_s", delay_s, "s")?;
    if damping_n_s_per_m <= stiffness_n_per_m * delay_s {
        return Ok(None);
    }
    if delay_s == 0.0 {
        return Ok(Some(f64::INFINITY));
    }
    // Re Z falls from b - k h at zero to -2 k h/π at ωh = π/2.
    let (mut passive, mut active) = (0.0, FRAC_PI_2 / delay_s);
    loop {
        let middle = 0.5 * (passive + active);
        if middle <= passive || middle >= active {
            return Ok(Some(middle));
        }
        if resistance_n_s_per_m(stiffness_n_per_m, damping_n_s_per_m, delay_s, middle) > 0.0 {
            passive = middle;
        } else {
            active = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::exact::damping_interval;

    #[test]
    fn the_band_ends_where_the_loop_crosses() {
        // At the edge of stability the crossing frequency is where the loop neither gains nor loses: Re Z = 0 there.
        let edges = damping_interval(63.2, 1066.0, 0.016).unwrap().unwrap();
        for (damping, frequency) in [
            (edges.low_n_s_per_m, edges.low_frequency_rad_per_s),
            (edges.high_n_s_per_m, edges.high_frequency_rad_per_s),
        ] {
            let end = passive_until_rad_per_s(1066.0, damping, 0.016).unwrap().unwrap();
            // b - k h is a small difference near the lower edge: (ωh)²/3 of b, so that rounding grows by its inverse.
            assert!((end - frequency).abs() < 1e-9 * frequency, "{end} {frequency}");
        }
    }

    #[test]
    fn without_enough_damping_nothing_is_passive() {
        assert_eq!(passive_until_rad_per_s(1000.0, 16.0, 0.016), Ok(None));
        assert_eq!(passive_until_rad_per_s(1000.0, 16.0, 0.0), Ok(Some(f64::INFINITY)));
        assert!((resistance_n_s_per_m(1000.0, 20.0, 0.016, 0.0) - 4.0).abs() < 1e-12);
        assert!(passive_until_rad_per_s(0.0, 16.0, 0.016).is_err());
    }
}
