//! Numbers, units and names as text: at most four significant digits, a prefix where people use one, never a bare number.

use super::super::axis::fixed;
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// More digits than these are never vouched for.
const DIGITS_MAX: i32 = 4;
/// Sizes outside this range are written with an exponent.
const PLAIN: std::ops::Range<f64> = 1e-3..1e5;
/// A standard deviation gets one digit, unless that would move it by more than this share.
const ONE_DIGIT_MOVES: f64 = 0.1;
/// A space at which no line breaks.
pub(super) const HOLD: char = '\u{a0}';
/// The only unit with a space in it.
const HELD_UNIT: &str = "N\u{a0}s";

/// A unit and what SI values are multiplied by to get there.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Values in SI units times this are values in `unit`.
    pub factor: f64,
    /// The unit as it is printed; empty for a ratio.
    pub unit: String,
}

impl Scale {
    /// The prefix with which a value of this size reads best. Only times, lengths, speeds and energies get one.
    pub fn of(unit: &str, size: f64) -> Self {
        let size = size.abs();
        let has_prefix = matches!(unit, "s" | "m" | "m/s" | "J");
        let (factor, prefix) = match size {
            _ if !has_prefix || size >= 1.0 || size <= 0.0 || size.is_nan() => (1.0, ""),
            _ if size >= 1e-3 => (1e3, "m"),
            _ => (1e6, "µ"),
        };
        Scale { factor, unit: format!("{prefix}{}", printed_unit(unit)) }
    }

    /// A value in SI units as text, with this many digits and the unit.
    pub fn figures(&self, value: f64, digits: i32) -> String {
        joined(&figures(value * self.factor, digits), &self.unit)
    }

    /// A value in SI units with its standard deviation; see [`value_with_sd`].
    pub fn with_sd(&self, fitted: f64, sd: f64) -> String {
        if !fitted.is_finite() {
            return "not finite".to_owned();
        }
        let (value, sd) = (fitted * self.factor, sd * self.factor);
        if sd.abs() <= 0.0 {
            return joined(&number(value), &self.unit);
        }
        if !sd.is_finite() {
            return format!("{}, sd unknown", joined(&number(value), &self.unit));
        }
        match pair(value, sd) {
            (text, Some(sd_text)) => joined(&format!("{text} ±{HOLD}{sd_text}"), &self.unit),
            (text, None) => format!("{}, sd below its last digit", joined(&text, &self.unit)),
        }
    }

    /// A label that ends in the unit, as plots and columns want it.
    pub fn label(&self, name: &str) -> String {
        if self.unit.is_empty() { name.to_owned() } else { format!("{name} in {}", self.unit) }
    }
}

/// A unit as people write it: exponents raised, nothing for a ratio.
pub fn printed_unit(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    unit.replace("^2", "²").replace("^3", "³").replace("m2", "m²").replace("m3", "m³")
}

/// A number with this many significant digits, exponent where it would be long.
pub fn figures(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "not finite".to_owned();
    }
    if value.abs() <= 0.0 {
        return "0".to_owned();
    }
    let digits = digits.clamp(1, DIGITS_MAX);
    written(value, digits - 1 - exponent(value), is_plain(value))
}

/// A number as somebody typed it: four significant digits, no zeros behind the point that say nothing.
pub fn number(value: f64) -> String {
    let text = figures(value, DIGITS_MAX);
    let (mantissa, power) = text.split_at(text.find('e').unwrap_or(text.len()));
    if !mantissa.contains('.') {
        return text;
    }
    format!("{}{power}", mantissa.trim_end_matches('0').trim_end_matches('.'))
}

/// A value with its unit.
pub fn value(value: f64, unit: &str) -> String {
    let scale = Scale::of(unit, value);
    joined(&number(value * scale.factor), &scale.unit)
}

/// A value with its standard deviation and its unit, as `8.00 ± 0.01 ms`.
///
/// The standard deviation decides how many digits are shown. Zero means that the value was not fitted.
pub fn value_with_sd(fitted: f64, sd: f64, unit: &str) -> String {
    let size = if sd.is_finite() { fitted.abs().max(sd) } else { fitted };
    Scale::of(unit, size).with_sd(fitted, sd)
}

/// A value and its standard deviation with the same last digit and the same exponent; the latter is `None` below that digit.
fn pair(value: f64, sd: f64) -> (String, Option<String>) {
    let size = value.abs().max(sd);
    let wanted = sd_decimals(sd);
    let decimals = wanted.min(DIGITS_MAX - 1 - exponent(size));
    let is_shown = sd >= 0.5 * power(-decimals);
    if is_plain(size) {
        let text = |value: f64| written(value, decimals, true);
        return (text(value), is_shown.then(|| text(sd)));
    }
    let exponent = exponent(rounded(size, decimals));
    let text = |value: f64| format!("{}e{exponent}", mantissa(value, decimals, exponent));
    (text(value), is_shown.then(|| text(sd)))
}

/// How many decimals a standard deviation is worth.
fn sd_decimals(sd: f64) -> i32 {
    let one = -exponent(sd);
    let moves = (rounded(sd, one) - sd).abs() > ONE_DIGIT_MOVES * sd;
    if moves { one + 1 } else { one }
}

/// A number with its last digit at `decimals` places behind the point; negative places round before it.
fn written(value: f64, decimals: i32, is_plain: bool) -> String {
    let value = rounded(value, decimals);
    if is_plain {
        return fixed(value, decimals.max(0) as usize);
    }
    let exponent = exponent(value);
    format!("{}e{exponent}", mantissa(value, decimals, exponent))
}

fn mantissa(value: f64, decimals: i32, exponent: i32) -> String {
    fixed(rounded(value, decimals) / power(exponent), (decimals + exponent).max(0) as usize)
}

fn rounded(value: f64, decimals: i32) -> f64 {
    // Powers with a positive exponent are whole numbers and therefore exact.
    if decimals >= 0 {
        libm::round(value * power(decimals)) / power(decimals)
    } else {
        libm::round(value / power(-decimals)) * power(-decimals)
    }
}

fn is_plain(value: f64) -> bool {
    PLAIN.contains(&value.abs())
}

/// Decimal exponent of the first digit.
fn exponent(value: f64) -> i32 {
    if value.abs() > 0.0 { libm::floor(libm::log10(value.abs())) as i32 } else { 0 }
}

fn power(exponent: i32) -> f64 {
    libm::pow(10.0, f64::from(exponent))
}

/// A number and its unit, kept on one line.
pub(super) fn joined(number: &str, unit: &str) -> String {
    if unit.is_empty() { number.to_owned() } else { format!("{number}{HOLD}{unit}").replace("N s", HELD_UNIT) }
}

/// Endings of keys and their units, longer ones first.
const ENDINGS: [(&str, &str); 14] = [
    ("_n_s_per_m2", "N s/m^2"),
    ("_n_s_per_m", "N s/m"),
    ("_n_per_m3", "N/m^3"),
    ("_n_per_m", "N/m"),
    ("_n_per_s", "N/s"),
    ("_m_per_s", "m/s"),
    ("_ratio", "1"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_1", "1"),
    ("_s", "s"),
    ("_m", "m"),
    ("_n", "N"),
    ("_j", "J"),
];

/// A key of a file as words and its unit: `contact.stiffness_n_per_m` is `stiffness`, in `N/m`.
pub fn key(key: &str) -> (String, &'static str) {
    let last = key.rsplit('.').next().unwrap_or(key);
    let found = ENDINGS.iter().find_map(|(ending, unit)| last.strip_suffix(ending).map(|name| (name, *unit)));
    let (name, unit) = found.unwrap_or((last, "1"));
    (name.replace('_', " "), unit)
}

/// Unit of a parameter: as the catalogue has it, else from the ending of its name.
pub fn parameter_unit(catalog: &Catalog<Axis>, effect: &str, parameter: &str) -> String {
    let known = catalog.get(effect).and_then(|kind| kind.params.iter().find(|param| param.name == parameter));
    known.map_or_else(|| key(parameter).1.to_owned(), |param| param.unit.to_string())
}

/// `a`, `a or b`, `a, b or c`.
pub fn listed(items: &[String], last: &str) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., end] => format!("{} {last} {end}", first.join(", ")),
    }
}

/// A count with its noun: `1 recording`, `3 recordings`.
pub fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_carry_their_uncertainty_and_unit() {
        let table = [
            (9.1e6, 3e5, "N/m^3", "9.1e6 ± 0.3e6 N/m³"),
            (0.008, 1e-5, "s", "8.00 ± 0.01 ms"),
            (0.008, 1.4e-5, "s", "8.000 ± 0.014 ms"),
            (0.0079, 3.3e-4, "s", "7.9 ± 0.3 ms"),
            (1066.3, 4.2, "N/m", "1066 ± 4 N/m"),
            (1066.3, 0.012, "N/m", "1066 N/m, sd below its last digit"),
            (15.23, 0.25, "Hz", "15.23 ± 0.25 Hz"),
            (2.0, 0.0, "1", "2"),
            (-0.31, 0.02, "N", "-0.31 ± 0.02 N"),
            (2e-5, 3e-5, "m", "20 ± 30 µm"),
            (1e-4, 3e-4, "N", "1e-4 ± 3e-4 N"),
            (0.02, 0.3, "N", "0.0 ± 0.3 N"),
            (1.02, f64::INFINITY, "1", "1.02, sd unknown"),
            (996_000.0, 9_700.0, "N/m", "9.96e5 ± 0.10e5 N/m"),
            (12_345.0, 310.0, "N s/m^2", "12300 ± 300 N s/m²"),
            (f64::NAN, 1.0, "N", "not finite"),
        ];
        for (value, sd, unit, text) in table {
            assert_eq!(value_with_sd(value, sd, unit).replace(HOLD, " "), text, "{value} ± {sd} {unit}");
        }
    }

    #[test]
    fn numbers_have_at_most_four_digits() {
        for (value, text) in
            [(1066.0, "1066"), (0.25, "0.25"), (1.23456, "1.235"), (123_456.0, "1.235e5"), (0.0, "0"), (2e-6, "2e-6")]
        {
            assert_eq!(number(value), text);
        }
        assert_eq!([figures(0.25, 3), figures(9.996, 3), figures(2e-13, 2)], ["0.250", "10.00", "2.0e-13"]);
        assert_eq!([value(0.0005, "m"), value(0.016, "s"), value(1.5, "1")], ["500\u{a0}µm", "16\u{a0}ms", "1.5"]);
    }

    #[test]
    fn keys_become_words() {
        assert_eq!(key("contact.stiffness_n_per_m"), ("stiffness".to_owned(), "N/m"));
        assert_eq!(key("natural_frequency_hz"), ("natural frequency".to_owned(), "Hz"));
        assert_eq!(key("order"), ("order".to_owned(), "1"));
    }

    #[test]
    fn items_are_listed() {
        let items: Vec<String> = ["a", "b", "c"].map(String::from).to_vec();
        assert_eq!([listed(&items, "or"), listed(&items[..1], "or")], ["a, b or c", "a"]);
        assert_eq!([counted(1, "block"), counted(0, "block")], ["1 block", "0 blocks"]);
    }
}
