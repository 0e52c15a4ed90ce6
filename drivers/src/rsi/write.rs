//! Numbers as they go onto the wire: fixed decimals, a point, no exponent, no NaN, and -0 as 0.
//!
//! A value is rounded to the nearest decimal, the even one in the middle between two. What was really sent is what a ledger of
//! commands must hold, not what was asked for: [`sent`].

/// Most decimals that a controller is known to print or take.
pub const DECIMALS_MAX: u8 = 32;

/// A value that cannot be written.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{0} is not finite and cannot be sent")]
pub struct NotFinite(pub f64);

/// `value` with so many `decimals` (at most [`DECIMALS_MAX`]).
pub fn fixed(value: f64, decimals: u8) -> Result<String, NotFinite> {
    if !value.is_finite() {
        return Err(NotFinite(value));
    }
    let text = format!("{value:.*}", usize::from(decimals.min(DECIMALS_MAX)));
    let nothing = text.bytes().all(|byte| b"-0.".contains(&byte));
    Ok(if nothing { text.trim_start_matches('-').to_owned() } else { text })
}

/// The value that the other side reads when `value` is sent with so many `decimals`; itself when it cannot be sent.
pub fn sent(value: f64, decimals: u8) -> f64 {
    fixed(value, decimals).ok().and_then(|text| text.parse().ok()).unwrap_or(value)
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "proves that bits are equal")]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_out() {
        let cases = [
            (0.0, 4, "0.0000"),
            (-0.0, 4, "0.0000"),
            (-0.000_049, 4, "0.0000"),
            (-0.000_051, 4, "-0.0001"),
            (1e-9, 6, "0.000000"),
            (5.0, 6, "5.000000"),
            (-347.967_4, 4, "-347.9674"),
            (1e21, 1, "1000000000000000000000.0"),
            (2.5, 0, "2"),
            (0.1, 1, "0.1"),
        ];
        for (value, decimals, text) in cases {
            assert_eq!(fixed(value, decimals).unwrap(), text);
        }
    }

    #[test]
    fn what_is_not_finite_is_not_written() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(fixed(value, 4).is_err());
        }
        assert_eq!(fixed(f64::INFINITY, 4).unwrap_err().to_string(), "inf is not finite and cannot be sent");
    }

    #[test]
    fn what_was_sent_is_what_is_read() {
        assert_eq!(sent(1.234_56, 4), 1.2346);
        assert_eq!(sent(-0.000_01, 4).to_bits(), 0.0_f64.to_bits());
        // More decimals than allowed are not written.
        assert_eq!(fixed(0.5, 200).unwrap().len(), 2 + 32);
    }
}
