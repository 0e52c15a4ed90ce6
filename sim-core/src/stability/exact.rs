//! The closed form for one dead time: `m s² + (b s + k) e^{-hs} = 0`.
//!
//! `ω² = (b² + √(b⁴ + 4 m² k²)) / (2 m²)`, `h_crit = atan(b ω / k) / ω`. For m, k, b > 0 the loop is stable for 0 ≤ h < h_crit,
//! and never again beyond. Contact that never pulls is another matter: its e = 1 boundary lies above this one (`impact`).
//!
//! With φ = ω h the edge is `k = m ω² cos φ`, `b = m ω sin φ`, 0 < φ < π/2. At a given h, `φ² cos φ = k h² / m` has two
//! solutions or none: the damping that stabilises is an interval b_lo … b_hi, since too much delayed damping destabilises too.
//! The two meet where `φ tan φ = 2`, at the longest delay that any damping can stabilise: h = 0.7415 √(m/k), b = 1.2788 √(k m).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass | kg |
//! | k, b | stiffness and damping, real and virtual together | N/m, N s/m |
//! | h | dead time of the loop | s |
//! | ω | crossing frequency | rad/s |
//! | φ | phase lost in the dead time at the crossing | rad |
//!
//! Not modelled: sampling (`sampled`), several delays (`spectral`), contact that never pulls (`impact`).
//! Source: `reference/PHYSICS.md`, section 1.3.

use crate::refusal::{Refusal, finite, not_negative, positive};
use core::f64::consts::FRAC_PI_2;

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

/// The damping that stabilises at one delay: between the two, both excluded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingInterval {
    /// Below it the delayed spring feeds the oscillation.
    pub low_n_s_per_m: f64,
    /// Above it the delayed damping does. Infinite without delay.
    pub high_n_s_per_m: f64,
    /// Frequency of the oscillation at the lower edge.
    pub low_frequency_rad_per_s: f64,
    /// Frequency of the oscillation at the upper edge. Infinite without delay.
    pub high_frequency_rad_per_s: f64,
}

/// The longest delay that any damping stabilises, and that damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Longest {
    /// The delay.
    pub delay_s: f64,
    /// The damping that stabilises just up to it.
    pub damping_n_s_per_m: f64,
    /// Frequency of the oscillation there.
    pub frequency_rad_per_s: f64,
}

/// The longest delay that any damping can stabilise. Refuses a mass or stiffness that is not positive.
pub fn longest_delay(mass_kg: f64, stiffness_n_per_m: f64) -> Result<Longest, Refusal> {
    let (mass, stiffness) = checked(mass_kg, stiffness_n_per_m)?;
    let phase = phase_of_longest();
    let frequency_rad_per_s = libm::sqrt(stiffness / (mass * libm::cos(phase)));
    Ok(Longest {
        delay_s: phase / frequency_rad_per_s,
        damping_n_s_per_m: mass * frequency_rad_per_s * libm::sin(phase),
        frequency_rad_per_s,
    })
}

/// The interval of damping that stabilises at this delay, or `None` if there is none.
pub fn damping_interval(
    mass_kg: f64,
    stiffness_n_per_m: f64,
    delay_s: f64,
) -> Result<Option<DampingInterval>, Refusal> {
    let (mass, stiffness) = checked(mass_kg, stiffness_n_per_m)?;
    let delay = not_negative("delay_s", delay_s, "s")?;
    if delay == 0.0 {
        return Ok(Some(DampingInterval {
            low_n_s_per_m: 0.0,
            high_n_s_per_m: f64::INFINITY,
            low_frequency_rad_per_s: libm::sqrt(stiffness / mass),
            high_frequency_rad_per_s: f64::INFINITY,
        }));
    }
    let squared = stiffness * delay * delay / mass;
    let top = phase_of_longest();
    if squared > top * top * libm::cos(top) {
        return Ok(None);
    }
    let residual = |phase: f64| phase * phase * libm::cos(phase) - squared;
    let low = bisected(0.0, top, residual);
    let high = bisected(FRAC_PI_2, top, residual);
    let damping = |phase: f64| mass * phase * libm::sin(phase) / delay;
    Ok(Some(DampingInterval {
        low_n_s_per_m: damping(low),
        high_n_s_per_m: damping(high),
        low_frequency_rad_per_s: low / delay,
        high_frequency_rad_per_s: high / delay,
    }))
}

/// How far a loop is from each of its edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assessment {
    /// Whether the two-sided loop decays.
    pub stable: bool,
    /// The edge over the delay at this damping; `None` without damping, where any delay destabilises.
    pub critical: Option<Critical>,
    /// The edges over the damping at this delay; `None` if no damping stabilises.
    pub interval: Option<DampingInterval>,
    /// The longest delay that any damping stabilises.
    pub longest: Longest,
    /// Delay that may still be added; negative: that is too much.
    pub delay_margin: Margin,
    /// Damping that may still be taken away; `None` if no damping stabilises.
    pub low_margin: Option<Margin>,
    /// Damping that may still be added; `None` if no damping stabilises, infinite without delay.
    pub high_margin: Option<Margin>,
}

/// A distance to an edge, positive on the stable side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// In the unit of what is varied: s or N s/m.
    pub distance: f64,
    /// In per cent of the edge. Infinite where the edge is at zero.
    pub per_cent: f64,
}

impl Margin {
    fn below(edge: f64, value: f64) -> Margin {
        let distance = edge - value;
        Margin { distance, per_cent: if edge.is_infinite() { 100.0 } else { 100.0 * distance / edge } }
    }

    fn above(edge: f64, value: f64) -> Margin {
        let distance = value - edge;
        Margin { distance, per_cent: 100.0 * distance / edge }
    }
}

/// Whether the loop is stable, and its margins. A damping of zero or below is answered: the loop grows.
pub fn assess(
    mass_kg: f64,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    delay_s: f64,
) -> Result<Assessment, Refusal> {
    let longest = longest_delay(mass_kg, stiffness_n_per_m)?;
    let damping = finite("damping_n_s_per_m", damping_n_s_per_m, "N s/m")?;
    let interval = damping_interval(mass_kg, stiffness_n_per_m, delay_s)?;
    let critical = critical_delay(mass_kg, stiffness_n_per_m, damping);
    let edge_s = critical.map_or(0.0, |critical| critical.delay_s);
    Ok(Assessment {
        stable: delay_s < edge_s,
        critical,
        interval,
        longest,
        delay_margin: Margin::below(edge_s, delay_s),
        low_margin: interval.map(|edges| Margin::above(edges.low_n_s_per_m, damping)),
        high_margin: interval.map(|edges| Margin::below(edges.high_n_s_per_m, damping)),
    })
}

fn checked(mass_kg: f64, stiffness_n_per_m: f64) -> Result<(f64, f64), Refusal> {
    Ok((positive("mass_kg", mass_kg, "kg")?, positive("stiffness_n_per_m", stiffness_n_per_m, "N/m")?))
}

/// φ tan φ = 2, where φ² cos φ is largest.
fn phase_of_longest() -> f64 {
    bisected(0.5, 1.5, |phase| phase * libm::tan(phase) - 2.0)
}

/// The root between `from` and `to`, where the function has different signs, to the last bit that bisection can give.
fn bisected(from: f64, to: f64, function: impl Fn(f64) -> f64) -> f64 {
    let rising = function(to) > 0.0;
    let (mut from, mut to) = (from, to);
    loop {
        let middle = 0.5 * (from + to);
        if middle <= from.min(to) || middle >= from.max(to) {
            return middle;
        }
        if (function(middle) > 0.0) == rising { to = middle } else { from = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_and_critical_delay_are_one_curve() {
        for (mass, stiffness, delay) in [(63.2, 1066.0, 0.016), (15.6, 3000.0, 0.032), (60.0, 1000.0, 0.18)] {
            let edges = damping_interval(mass, stiffness, delay).unwrap().unwrap();
            for damping in [edges.low_n_s_per_m, edges.high_n_s_per_m] {
                let found = critical_delay(mass, stiffness, damping).unwrap();
                // Near the tip the curve is a parabola, so that the last bit of one is a root of it of the other.
                assert!((found.delay_s - delay).abs() < 1e-9, "{found:?} {delay}");
            }
        }
    }

    #[test]
    fn the_longest_delay_is_the_tip() {
        let tip = longest_delay(63.2, 1066.0).unwrap();
        assert!((tip.delay_s - 0.7415 * libm::sqrt(63.2 / 1066.0)).abs() < 5e-5 * tip.delay_s);
        assert!((tip.damping_n_s_per_m - 1.2788 * libm::sqrt(63.2 * 1066.0)).abs() < 5e-5 * tip.damping_n_s_per_m);
        assert!(damping_interval(63.2, 1066.0, tip.delay_s * 1.000_001).unwrap().is_none());
        let narrow = damping_interval(63.2, 1066.0, tip.delay_s * 0.999_999).unwrap().unwrap();
        assert!(narrow.low_n_s_per_m < tip.damping_n_s_per_m && tip.damping_n_s_per_m < narrow.high_n_s_per_m);
    }

    #[test]
    fn margins_are_positive_inside_and_negative_outside() {
        let inside = assess(63.2, 1066.0, 40.0, 0.016).unwrap();
        assert!(inside.stable && inside.delay_margin.distance > 0.0);
        assert!((inside.low_margin.unwrap().distance - 22.919).abs() < 5e-4, "{inside:?}");
        for (damping, delay) in [(10.0, 0.016), (0.0, 0.016), (-5.0, 0.0), (7000.0, 0.016), (40.0, 0.2)] {
            let outside = assess(63.2, 1066.0, damping, delay).unwrap();
            assert!(!outside.stable && outside.delay_margin.distance <= 0.0, "{damping} {delay}: {outside:?}");
        }
        let undelayed = assess(63.2, 1066.0, 40.0, 0.0).unwrap();
        assert!(undelayed.stable && undelayed.high_margin.unwrap().distance.is_infinite());
        assert!(assess(63.2, 1066.0, 0.0, 0.0).is_ok_and(|undamped| !undamped.stable), "it neither grows nor decays");
    }

    #[test]
    fn input_without_meaning_is_refused() {
        for (mass, stiffness, damping, delay) in [
            (0.0, 1.0, 1.0, 0.0),
            (1.0, -1.0, 1.0, 0.0),
            (1.0, 1.0, f64::NAN, 0.0),
            (1.0, 1.0, 1.0, -0.1),
            (1.0, 1.0, 1.0, f64::INFINITY),
        ] {
            assert!(assess(mass, stiffness, damping, delay).is_err());
        }
    }
}
