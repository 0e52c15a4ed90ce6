//! How alike two signals are, in the words of their field: fit, magnitude error, phase error.
//!
//! With m measured, c computed: `fit = 100 (1 - ‖m - c‖ / ‖m - mean m‖)`; Sprague and Geers: `M = √(Σc²/Σm²) - 1`,
//! `P = arccos(Σmc / √(Σm² Σc²)) / π`. Not aligned, not smoothed; noise alone gives a fit below 100 %.

use serde::Serialize;

/// Fit and errors of one channel, in percent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agreement {
    /// 100 is equal, 0 is no better than the mean, below 0 is worse than a constant.
    pub fit_percent: f64,
    /// By how much the model is too large.
    pub magnitude_percent: f64,
    /// Share of half a turn by which the shapes differ; timing and shape together.
    pub phase_percent: f64,
}

impl Agreement {
    /// Of pairs of measured and computed; `None` where one of them is constant.
    pub fn of(pairs: &[(f64, f64)]) -> Option<Self> {
        let n = pairs.len() as f64;
        let mean = pairs.iter().map(|(m, _)| m).sum::<f64>() / n;
        let sum = |of: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(m, c)| of(*m, *c)).sum::<f64>();
        let (mm, cc, mc) = (sum(&|m, _| m * m), sum(&|_, c| c * c), sum(&|m, c| m * c));
        let spread = sum(&|m, _| (m - mean) * (m - mean));
        if !(spread > 0.0 && cc > 0.0) {
            return None;
        }
        let cosine = (mc / libm::sqrt(mm * cc)).clamp(-1.0, 1.0);
        Some(Agreement {
            fit_percent: 100.0 * (1.0 - libm::sqrt(sum(&|m, c| (m - c) * (m - c)) / spread)),
            magnitude_percent: 100.0 * (libm::sqrt(cc / mm) - 1.0),
            phase_percent: 100.0 * libm::acos(cosine) / core::f64::consts::PI,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Agreement;

    #[test]
    fn a_larger_and_later_sine_has_its_magnitude_and_phase() {
        // Whole periods: a phase of φ gives P = φ / π exactly.
        let wave = |i: usize, late: f64| libm::sin(i as f64 * 0.01 * core::f64::consts::TAU - late);
        let pairs: Vec<(f64, f64)> = (0..300).map(|i| (wave(i, 0.0), 1.1 * wave(i, 0.2))).collect();
        let agreement = Agreement::of(&pairs).unwrap();
        assert!((agreement.magnitude_percent - 10.0).abs() < 1e-9, "{agreement:?}");
        assert!((agreement.phase_percent - 20.0 / core::f64::consts::PI).abs() < 1e-9, "{agreement:?}");
        assert_eq!(Agreement::of(&[(1.0, 2.0), (1.0, 3.0)]), None);
    }
}
