//! Padé's first approximation of the dead time: optimistic, for comparison with the literature, never the criterion.
//!
//! `e^{-hs} → (1 - hs/2) / (1 + hs/2)` turns the loop into `(m h/2) s³ + (m - b h/2) s² + (b - k h/2) s + k = 0`. The
//! approximation is all-pass, so that the crossing frequency ω stays exact and only its phase is wrong:
//! `h_Padé = (2/ω) tan(atan(b ω / k) / 2)`, always above the exact edge, by some (ω h)²/12.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass | kg |
//! | k, b | stiffness and damping | N/m, N s/m |
//! | h | dead time of the loop | s |
//!
//! Source: `reference/PHYSICS.md`, section 1.4.

use super::eigen::eigenvalues;
use super::exact::{Critical, critical_delay};
use crate::refusal::{Refusal, finite, not_negative, positive};
use alloc::vec::Vec;
use nalgebra::{Complex, DMatrix};

/// The edge as the approximation has it; `None` where the exact edge is none.
pub fn critical_delay_pade(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Option<Critical> {
    let exact = critical_delay(mass_kg, stiffness_n_per_m, damping_n_s_per_m)?;
    let phase = exact.delay_s * exact.frequency_rad_per_s;
    Some(Critical { delay_s: 2.0 * libm::tan(0.5 * phase) / exact.frequency_rad_per_s, ..exact })
}

/// Coefficients of s³, s², s and 1.
pub fn polynomial(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64, delay_s: f64) -> [f64; 4] {
    let half = 0.5 * delay_s;
    [
        mass_kg * half,
        mass_kg - damping_n_s_per_m * half,
        damping_n_s_per_m - stiffness_n_per_m * half,
        stiffness_n_per_m,
    ]
}

/// Routh's conditions on that polynomial: all coefficients positive, and `a₂ a₁ > a₃ a₀`.
pub fn stable_by_routh(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64, delay_s: f64) -> bool {
    let [a3, a2, a1, a0] = polynomial(mass_kg, stiffness_n_per_m, damping_n_s_per_m, delay_s);
    a3 >= 0.0 && a2 > 0.0 && a1 > 0.0 && a0 > 0.0 && a2 * a1 > a3 * a0
}

/// One point of the root locus.
#[derive(Debug, Clone, PartialEq)]
pub struct LocusPoint {
    /// The delay.
    pub delay_s: f64,
    /// The roots at it, rightmost first: three, or two without delay.
    pub roots: Vec<Complex<f64>>,
}

/// The roots of the approximation over the delay. Refuses what has no meaning; instability is answered.
pub fn root_locus(
    mass_kg: f64,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    delays_s: &[f64],
) -> Result<Vec<LocusPoint>, Refusal> {
    positive("mass_kg", mass_kg, "kg")?;
    finite("stiffness_n_per_m", stiffness_n_per_m, "N/m")?;
    finite("damping_n_s_per_m", damping_n_s_per_m, "N s/m")?;
    let point = |&delay_s: &f64| {
        not_negative("delay_s", delay_s, "s")?;
        let all = polynomial(mass_kg, stiffness_n_per_m, damping_n_s_per_m, delay_s);
        let coefficients = if delay_s == 0.0 { &all[1..] } else { &all[..] };
        let limit = "gives a polynomial whose roots cannot be told";
        let roots = polynomial_roots(coefficients);
        let roots = roots.ok_or(Refusal { name: "delay_s", value: delay_s, unit: "s", limit })?;
        Ok(LocusPoint { delay_s, roots })
    };
    delays_s.iter().map(point).collect()
}

/// The roots of a polynomial whose highest coefficient comes first, rightmost first; `None` if that one is zero.
pub(super) fn polynomial_roots(coefficients: &[f64]) -> Option<Vec<Complex<f64>>> {
    let degree = coefficients.len() - 1;
    let companion = DMatrix::from_fn(degree, degree, |row, column| match row {
        0 => -coefficients[column + 1] / coefficients[0],
        _ if row == column + 1 => 1.0,
        _ => 0.0,
    });
    let mut roots = eigenvalues(companion)?;
    roots.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    Some(roots)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_locus_crosses_where_the_closed_form_says() {
        for (mass, stiffness, damping) in [(60.0, 1000.0, 50.0), (15.6, 3000.0, 50.0), (60.0, 1000.0, 800.0)] {
            let edge = critical_delay_pade(mass, stiffness, damping).unwrap();
            let locus = root_locus(mass, stiffness, damping, &[0.99 * edge.delay_s, edge.delay_s, 1.01 * edge.delay_s]);
            let locus = locus.unwrap();
            assert!(locus[0].roots[0].re < 0.0 && locus[2].roots[0].re > 0.0);
            let pair = locus[1].roots[0];
            assert!(pair.re.abs() < 1e-9 && (pair.im.abs() - edge.frequency_rad_per_s).abs() < 1e-9, "{pair}");
            assert!(stable_by_routh(mass, stiffness, damping, 0.999 * edge.delay_s));
            assert!(!stable_by_routh(mass, stiffness, damping, 1.001 * edge.delay_s));
        }
    }

    #[test]
    fn it_is_optimistic() {
        for damping in [1.0, 20.0, 100.0, 313.0, 1000.0, 5000.0] {
            let exact = critical_delay(60.0, 1000.0, damping).unwrap();
            assert!(critical_delay_pade(60.0, 1000.0, damping).unwrap().delay_s > exact.delay_s);
        }
        assert_eq!(critical_delay_pade(60.0, 1000.0, 0.0), None);
        assert!(root_locus(0.0, 1.0, 1.0, &[0.1]).is_err());
        assert_eq!(root_locus(60.0, 1000.0, 50.0, &[0.0]).unwrap()[0].roots.len(), 2);
    }
}
