//! Numbers as they come from the wire: `-?digits[.digits]`, and nothing else.
//!
//! The reader of documents is liberal; that of numbers is not. `1,5` read as 1 or 15, or `NaN` passed on, moves a robot.

use core::fmt;

/// A value on the wire that is no number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BadNumber {
    /// Element.
    pub tag: String,
    /// Attribute; empty for the text of the element.
    pub attribute: String,
    /// What stands there; at most 40 characters of it.
    pub text: String,
    /// What is wrong.
    pub why: NumberWhy,
}

/// Why a text is no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum NumberWhy {
    /// The element is there, the attribute is not.
    Absent,
    /// Nothing.
    Empty,
    /// A comma, as some locales write the point.
    Comma,
    /// An exponent.
    Exponent,
    /// `nan`, `inf`, or more digits than a double holds.
    NotFinite,
    /// Anything else.
    NotANumber,
}

impl NumberWhy {
    /// Its name in counts and reports.
    pub fn id(&self) -> &'static str {
        match self {
            NumberWhy::Absent => "number-absent",
            NumberWhy::Empty => "number-empty",
            NumberWhy::Comma => "number-comma",
            NumberWhy::Exponent => "number-exponent",
            NumberWhy::NotFinite => "number-not-finite",
            NumberWhy::NotANumber => "number-none",
        }
    }
}

impl fmt::Display for BadNumber {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let point = if self.attribute.is_empty() { "" } else { "." };
        write!(out, "{}{point}{} = '{}': ", self.tag, self.attribute, self.text)?;
        out.write_str(match self.why {
            NumberWhy::Absent => "the attribute is missing",
            NumberWhy::Empty => "no number",
            NumberWhy::Comma => "a comma; numbers on this wire have a point",
            NumberWhy::Exponent => "an exponent; numbers on this wire are written out",
            NumberWhy::NotFinite => "not finite",
            NumberWhy::NotANumber => "no number of the form -12.5",
        })
    }
}

impl core::error::Error for BadNumber {}

/// The number that `text` is; white space around it is allowed.
pub fn parse(text: &str) -> Result<f64, NumberWhy> {
    let text = text.trim_ascii();
    if text.is_empty() {
        return Err(NumberWhy::Empty);
    }
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, part) = digits.split_once('.').unwrap_or((digits, "0"));
    let all_digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    if !all_digits(whole) || !all_digits(part) {
        return Err(reason(digits));
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(NumberWhy::NotFinite),
    }
}

/// Which of the known mistakes it is.
fn reason(digits: &str) -> NumberWhy {
    let lower = digits.to_ascii_lowercase();
    if ["nan", "inf", "infinity"].iter().any(|word| lower == *word || lower == format!("+{word}")) {
        NumberWhy::NotFinite
    } else if lower.bytes().all(|byte| byte.is_ascii_digit() || b".,".contains(&byte)) && lower.contains(',') {
        NumberWhy::Comma
    } else if lower.parse::<f64>().is_ok() && lower.contains('e') {
        NumberWhy::Exponent
    } else {
        NumberWhy::NotANumber
    }
}

/// Digits after the point, as printed.
pub fn decimals(text: &str) -> usize {
    text.trim_ascii().split_once('.').map_or(0, |(_, part)| part.len())
}

impl BadNumber {
    /// Of this element and attribute.
    pub(super) fn new(tag: &str, attribute: &str, text: &str, why: NumberWhy) -> Self {
        let text = text.chars().take(40).collect();
        BadNumber { tag: tag.to_owned(), attribute: attribute.to_owned(), text, why }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_one_form() {
        for (text, value) in
            [("0", 0.0), ("-347.9674", -347.9674), ("1.00", 1.0), ("0000000000", 0.0), (" 12.5\r\n", 12.5)]
        {
            assert_eq!(parse(text), Ok(value), "{text}");
        }
        // Beyond 2^32, and with more digits than a double holds.
        assert_eq!(parse("123645634563"), Ok(123_645_634_563.0));
        assert_eq!(parse("0.12345678901234567890123456789012"), Ok(0.123_456_789_012_345_68));
    }

    #[test]
    fn each_mistake_has_its_name() {
        use NumberWhy::{Comma, Empty, Exponent, NotANumber, NotFinite};
        let cases = [
            ("", Empty),
            ("  ", Empty),
            ("1,5", Comma),
            ("-1.234,5", Comma),
            ("1e3", Exponent),
            ("-1.5E-07", Exponent),
            ("NaN", NotFinite),
            ("-nan", NotFinite),
            ("inf", NotFinite),
            ("-Infinity", NotFinite),
            ("+1", NotANumber),
            (".5", NotANumber),
            ("5.", NotANumber),
            ("--5", NotANumber),
            ("1.#QNAN", NotANumber),
            ("0x10", NotANumber),
            ("1 2", NotANumber),
            ("five", NotANumber),
        ];
        for (text, why) in cases {
            assert_eq!(parse(text), Err(why), "{text}");
        }
        assert_eq!(parse(&"9".repeat(400)), Err(NotFinite));
    }

    #[test]
    fn decimals_are_counted_as_printed() {
        for (text, count) in [("0", 0), ("1.0", 1), ("226966.9326", 4), ("0.00000", 5), ("-1.", 0)] {
            assert_eq!(decimals(text), count, "{text}");
        }
    }
}
