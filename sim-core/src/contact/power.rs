//! A power that keeps its sign: `sign(x) |x|^q`, so that a rate of -1 m/s to the power 1.3 still resists.
//!
//! The powers one and three halves are products and a root: exact to rounding, and several times cheaper than `libm::pow`.

use crate::refusal::{self, Refusal};

/// An exponent, and the cheapest way to raise to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Power {
    One,
    ThreeHalves,
    Other(f64),
}

impl Power {
    /// The power of this exponent, which must be above zero.
    pub(super) fn new(name: &'static str, exponent: f64) -> Result<Self, Refusal> {
        let exponent = refusal::positive(name, exponent, "")?;
        let is = |known: f64| exponent.to_bits() == known.to_bits();
        Ok(if is(1.0) {
            Power::One
        } else if is(1.5) {
            Power::ThreeHalves
        } else {
            Power::Other(exponent)
        })
    }

    /// `sign(base) |base|^exponent`.
    pub(super) fn of(self, base: f64) -> f64 {
        match self {
            Power::One => base,
            Power::ThreeHalves => base * libm::sqrt(base.abs()),
            Power::Other(exponent) => libm::copysign(libm::pow(base.abs(), exponent), base),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_power_keeps_the_sign_and_the_short_cuts_agree_with_the_long_way() {
        for (power, exponent) in [(Power::One, 1.0), (Power::ThreeHalves, 1.5), (Power::Other(0.7), 0.7)] {
            assert_eq!(Power::new("exponent", exponent).unwrap(), power);
            for base in [1e-6, 0.008, 1.0, 3.0_f64] {
                let long = libm::pow(base, exponent);
                // Two roundings of the short cut, one of libm::pow.
                assert!((power.of(base) - long).abs() <= 4.0 * f64::EPSILON * long);
                assert_eq!(power.of(-base).to_bits(), (-power.of(base)).to_bits());
            }
            assert!(power.of(0.0).abs() <= 0.0);
        }
        assert!(Power::new("exponent", 0.0).is_err());
    }
}
