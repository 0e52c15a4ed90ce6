//! Input without meaning: refused with name, value, unit and limit. What is merely unstable is answered, not refused.

use alloc::format;
use alloc::string::String;

/// Sizes outside this range are written with an exponent: 1e300, and not 301 digits.
const PLAIN: core::ops::Range<f64> = 1e-4..1e7;

/// A number with all its digits, as somebody would type it.
pub fn plain(value: f64) -> String {
    let is_plain = value == 0.0 || PLAIN.contains(&value.abs()) || !value.is_finite();
    if is_plain { format!("{value}") } else { format!("{value:e}") }
}

/// A value that no physics can have.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{name} = {} {unit} {limit}", plain(*value))]
pub struct Refusal {
    /// What it is called, with its unit, as users type it.
    pub name: &'static str,
    /// The value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// The limit that it breaks, as the end of a sentence: `is not above 0`.
    pub limit: &'static str,
}

/// The value, if it is finite and above zero.
pub fn positive(name: &'static str, value: f64, unit: &'static str) -> Result<f64, Refusal> {
    let limit = if value.is_finite() { "is not above 0" } else { "is not a finite number" };
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(Refusal { name, value, unit, limit }) }
}

/// The value, if it is finite and not below zero.
pub fn not_negative(name: &'static str, value: f64, unit: &'static str) -> Result<f64, Refusal> {
    let limit = if value.is_finite() { "is below 0" } else { "is not a finite number" };
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err(Refusal { name, value, unit, limit }) }
}

/// The value, if it is finite.
pub fn finite(name: &'static str, value: f64, unit: &'static str) -> Result<f64, Refusal> {
    if value.is_finite() { Ok(value) } else { Err(Refusal { name, value, unit, limit: "is not a finite number" }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    #[test]
    fn a_refusal_says_name_value_unit_and_limit() {
        assert_eq!(positive("mass_kg", 0.0, "kg").unwrap_err().to_string(), "mass_kg = 0 kg is not above 0");
        assert_eq!(not_negative("delay_s", -0.5, "s").unwrap_err().to_string(), "delay_s = -0.5 s is below 0");
        assert_eq!(finite("x_m", f64::NAN, "m").unwrap_err().to_string(), "x_m = NaN m is not a finite number");
        assert_eq!(positive("mass_kg", 2.0, "kg"), Ok(2.0));
    }

    #[test]
    fn long_numbers_have_an_exponent() {
        let texts = [1e300, -1e-9, 63.2057, 1e7, 9_999_999.5, 1e-4, 0.0, f64::INFINITY].map(plain);
        assert_eq!(texts, ["1e300", "-1e-9", "63.2057", "1e7", "9999999.5", "0.0001", "0", "inf"]);
    }
}
