//! All delays at which a scalar loop with one delay is stable: `P(s) + Q(s) e^{-hs} = 0`, P of higher degree than Q.
//!
//! The docking loop without further dynamics is stable below one critical delay. In general a loop can lose and regain
//! stability as the delay grows, so that the answer is a list of windows.
//!
//! Roots cross the imaginary axis only at frequencies where `|P(iω)|² = |Q(iω)|²`, a polynomial in ω². At each such ω they
//! cross at `h = (arg(-Q/P) + 2 π n) / ω`, all in one direction: to the right where `d(|P|² - |Q|²)/dω > 0`. Starting from the
//! roots of P + Q at h = 0, counting crossings gives the number of unstable roots at every delay.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | P, Q | polynomials of the undelayed and the delayed part | any, the same |
//! | h | delay | s |
//! | ω | crossing frequency | rad/s |
//!
//! Not modelled: several delays (`spectral`), a delayed term of P's degree. Source: `reference/PHYSICS.md`, correction 9.

use super::pade::polynomial_roots;
use crate::refusal::{Refusal, finite, positive};
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::PI;
use nalgebra::Complex;

/// Crossings above this number are not counted: the delay asked for spans too many turns.
const CROSSINGS_MAX: f64 = 1e5;

/// A loop with one delay.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarLoop {
    /// Coefficients of P, highest first.
    undelayed: Vec<f64>,
    /// Coefficients of Q, highest first.
    delayed: Vec<f64>,
}

/// Delays at which the loop is stable: `from_s < h < until_s`, and h = 0 too where `from_s` is 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Where it begins.
    pub from_s: f64,
    /// Where it ends, or the longest delay asked for.
    pub until_s: f64,
}

/// A frequency at which roots cross the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The frequency.
    pub frequency_rad_per_s: f64,
    /// The shortest delay at which they do.
    pub first_delay_s: f64,
    /// Whether they cross into the right half plane.
    pub destabilises: bool,
}

impl ScalarLoop {
    /// From the coefficients, highest first. Refuses a delayed part of P's degree or more.
    pub fn new(undelayed: &[f64], delayed: &[f64]) -> Result<Self, Refusal> {
        for &value in undelayed.iter().chain(delayed) {
            finite("coefficient", value, "of the loop")?;
        }
        let trimmed = |all: &[f64]| -> Vec<f64> { all.iter().copied().skip_while(|&value| value == 0.0).collect() };
        let (undelayed, delayed) = (trimmed(undelayed), trimmed(delayed));
        if undelayed.len() < 2 || delayed.len() >= undelayed.len() {
            let limit = "is not below that of the undelayed part: a neutral loop, or none at all";
            return Err(Refusal {
                name: "degree of the delayed part",
                value: delayed.len() as f64 - 1.0,
                unit: "in s",
                limit,
            });
        }
        Ok(ScalarLoop { undelayed, delayed })
    }

    /// The docking loop `m s² + (b s + k) e^{-hs}`.
    pub fn docking(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Result<Self, Refusal> {
        positive("mass_kg", mass_kg, "kg")?;
        ScalarLoop::new(&[mass_kg, 0.0, 0.0], &[damping_n_s_per_m, stiffness_n_per_m])
    }

    /// Where roots cross the imaginary axis, at frequencies above zero.
    pub fn crossings(&self) -> Result<Vec<Crossing>, Refusal> {
        let difference = difference(&self.undelayed, &self.delayed);
        let squares = polynomial_roots(&difference).ok_or_else(lost)?;
        let mut found = Vec::new();
        for square in squares {
            // A pair of complex squares that is real to rounding touches the axis and does not cross it.
            if square.im != 0.0 && square.im.abs() > 1e-9 * square.re.abs() || square.re <= 0.0 {
                continue;
            }
            let frequency = libm::sqrt(square.re);
            let s = Complex::new(0.0, frequency);
            let turn = -value(&self.delayed, s) / value(&self.undelayed, s);
            let phase = libm::atan2(turn.im, turn.re);
            // Rounding must not turn a crossing at zero delay by a whole turn.
            let first = if phase < -1e-12 { phase + 2.0 * PI } else { phase.max(0.0) };
            found.push(Crossing {
                frequency_rad_per_s: frequency,
                first_delay_s: first / frequency,
                destabilises: value(&slope(&difference), Complex::new(square.re, 0.0)).re > 0.0,
            });
        }
        Ok(found)
    }

    /// How many roots without delay are in the right half plane.
    fn unstable_without_delay(&self) -> Result<i64, Refusal> {
        let shift = self.undelayed.len() - self.delayed.len();
        let mut sum = self.undelayed.clone();
        for (place, coefficient) in sum[shift..].iter_mut().zip(&self.delayed) {
            *place += coefficient;
        }
        let roots = polynomial_roots(&sum).ok_or_else(lost)?;
        let scale = roots.iter().map(|root| super::eigen::modulus(*root)).fold(0.0, f64::max);
        // A root on the axis is no root to the right of it: its crossing at zero delay decides, and is counted.
        Ok(roots.iter().filter(|root| root.re > 1e-12 * scale).count() as i64)
    }

    /// The windows of stability up to this delay.
    pub fn windows(&self, delay_max_s: f64) -> Result<Vec<Window>, Refusal> {
        positive("delay_max_s", delay_max_s, "s")?;
        let mut events = vec![];
        for crossing in self.crossings()? {
            let turn_s = 2.0 * PI / crossing.frequency_rad_per_s;
            if delay_max_s / turn_s > CROSSINGS_MAX {
                let limit = "spans too many turns of the crossing frequency";
                return Err(Refusal { name: "delay_max_s", value: delay_max_s, unit: "s", limit });
            }
            let mut at = crossing.first_delay_s;
            while at <= delay_max_s {
                events.push((at, if crossing.destabilises { 2 } else { -2 }));
                at += turn_s;
            }
        }
        events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut unstable = self.unstable_without_delay()?;
        let mut windows: Vec<Window> = Vec::new();
        let mut from_s = 0.0;
        for (at, change) in events {
            if unstable == 0 && at > from_s {
                windows.push(Window { from_s, until_s: at });
            }
            unstable += change;
            from_s = at;
        }
        if unstable == 0 && delay_max_s > from_s {
            windows.push(Window { from_s, until_s: delay_max_s });
        }
        Ok(windows)
    }
}

fn lost() -> Refusal {
    Refusal {
        name: "coefficients",
        value: f64::NAN,
        unit: "of the loop",
        limit: "give a polynomial whose roots cannot be told",
    }
}

/// The value of a polynomial, highest coefficient first.
fn value(coefficients: &[f64], s: Complex<f64>) -> Complex<f64> {
    coefficients.iter().fold(Complex::new(0.0, 0.0), |sum, &coefficient| sum * s + coefficient)
}

fn slope(coefficients: &[f64]) -> Vec<f64> {
    let degree = coefficients.len() - 1;
    coefficients[..degree].iter().enumerate().map(|(i, coefficient)| coefficient * (degree - i) as f64).collect()
}

/// `|P(iω)|² - |Q(iω)|²` as a polynomial in ω², highest first.
fn difference(undelayed: &[f64], delayed: &[f64]) -> Vec<f64> {
    let squared = |all: &[f64]| {
        let degree = all.len().max(1) - 1;
        let mut out = vec![0.0; degree + 1];
        for (i, a) in all.iter().enumerate() {
            for (j, b) in all.iter().enumerate() {
                // Powers p and q of iω, times the conjugate: i^p (-i)^q ω^(p+q), real where p + q is even.
                let (p, q) = (degree - i, degree - j);
                if (p + q) % 2 == 0 {
                    let sign = if (p + 3 * q) % 4 == 0 { 1.0 } else { -1.0 };
                    out[degree - (p + q) / 2] += sign * a * b;
                }
            }
        }
        out
    };
    let mut out = squared(undelayed);
    let other = squared(delayed);
    let shift = out.len() - other.len();
    for (place, coefficient) in out[shift..].iter_mut().zip(other) {
        *place -= coefficient;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::exact::critical_delay;

    #[test]
    fn the_docking_loop_has_one_window() {
        for (mass, stiffness, damping) in [(60.0, 1000.0, 50.0), (15.6, 3000.0, 50.0), (60.0, 1000.0, 800.0)] {
            let windows = ScalarLoop::docking(mass, stiffness, damping).unwrap().windows(20.0).unwrap();
            let edge = critical_delay(mass, stiffness, damping).unwrap().delay_s;
            assert_eq!(windows.len(), 1);
            assert!(windows[0].from_s == 0.0 && (windows[0].until_s - edge).abs() < 1e-12, "{windows:?} {edge}");
        }
        let undamped = ScalarLoop::docking(60.0, 1000.0, 0.0).unwrap().windows(5.0).unwrap();
        assert!(undamped.is_empty(), "{undamped:?}");
    }

    #[test]
    fn a_neutral_loop_is_refused() {
        assert!(ScalarLoop::new(&[1.0, 0.0], &[0.5, 1.0]).is_err());
        assert!(ScalarLoop::new(&[1.0, f64::NAN], &[0.5]).is_err());
        assert!(ScalarLoop::new(&[1.0, 1.0], &[3.0]).unwrap().windows(-1.0).is_err());
    }
}
