//! Numbers inside the page: 24-bit steps between the extremes of a column, as base64.
//!
//! `value = low + code * (high - low) / 16_777_214`, three bytes little-endian per value, 16_777_215 is a gap. The
//! error is below 3e-8 of the range of the column, which is what a 32-bit float gives at the extremes, and every value
//! costs four characters instead of 5.3. Constant columns and even spacing cost nothing.

use serde::Serialize;

/// The code of a gap.
const GAP: u32 = 0xFF_FFFF;
/// The greatest code of a value.
const TOP: f64 = (GAP - 1) as f64;
/// Rounding that even spacing may show, as a fraction of one step: well below one pixel at any zoom that shows points.
const EVEN_TOLERANCE: f64 = 1e-6;

/// One column of numbers.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub(super) enum Column {
    /// `first + step * index`.
    Even { length: usize, first: f64, step: f64 },
    /// The same value everywhere.
    Constant { length: usize, value: f64 },
    /// Codes between `low` and `high`.
    Codes { length: usize, low: f64, high: f64, codes: String },
}

impl Column {
    /// Packs an abscissa, as even spacing if it is that.
    pub fn abscissa(values: &[f64]) -> Self {
        even(values).unwrap_or_else(|| Self::ordinate(values.iter().map(|value| Some(*value))))
    }

    /// Packs values; `None` and values that are not finite become gaps.
    pub fn ordinate(values: impl ExactSizeIterator<Item = Option<f64>>) -> Self {
        let values: Vec<Option<f64>> = values.map(|value| value.filter(|v| v.is_finite())).collect();
        let length = values.len();
        let finite = || values.iter().copied().flatten();
        let low = finite().fold(f64::INFINITY, f64::min);
        let high = finite().fold(f64::NEG_INFINITY, f64::max);
        // Not above: the column is constant or holds only gaps. Not finite: the range itself overflows.
        let range = if high > low && (high - low).is_finite() { high - low } else { 0.0 };
        if range == 0.0 && finite().count() == length && length > 0 {
            return Self::Constant { length, value: low };
        }
        let code = |value: Option<f64>| match value {
            None => GAP,
            Some(_) if range == 0.0 => 0,
            Some(value) => libm::round((value - low) / range * TOP) as u32,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| code(*value).to_le_bytes().into_iter().take(3)).collect();
        let low = if low.is_finite() { low } else { 0.0 };
        Self::Codes { length, low, high: low + range, codes: base64(&bytes) }
    }
}

/// Even spacing, if all values keep it.
fn even(values: &[f64]) -> Option<Column> {
    let (&[first, ..], &[.., last]) = (values, values) else {
        return None;
    };
    let length = values.len();
    let step = (last - first) / (length.max(2) - 1) as f64;
    let keeps = |(index, value): (usize, &f64)| (first + step * index as f64 - value).abs() <= step * EVEN_TOLERANCE;
    let is_even = step > 0.0 && step.is_finite() && values.iter().enumerate().all(keeps);
    is_even.then_some(Column::Even { length, first, step })
}

/// Base64 of RFC 4648 for a number of bytes that is a multiple of three, so that no padding is needed.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    debug_assert_eq!(bytes.len() % 3, 0);
    let mut text = String::with_capacity(bytes.len() / 3 * 4);
    for three in bytes.chunks_exact(3) {
        let word = u32::from(three[0]) << 16 | u32::from(three[1]) << 8 | u32::from(three[2]);
        for shift in [18, 12, 6, 0] {
            text.push(char::from(LETTERS[(word >> shift & 63) as usize]));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_rfc_4648() {
        assert_eq!(base64(b"foobar"), "Zm9vYmFy");
        assert_eq!(base64(&[0xFF, 0xFF, 0xFE]), "///+");
    }

    #[test]
    fn recognises_the_cheap_columns() {
        assert!(matches!(Column::abscissa(&[0.0, 0.1, 0.2, 0.30000000000000004]), Column::Even { length: 4, .. }));
        assert!(matches!(Column::abscissa(&[0.0, 0.1, 0.3]), Column::Codes { .. }));
        assert!(matches!(Column::ordinate([Some(2.0); 3].into_iter()), Column::Constant { length: 3, .. }));
        let gaps = Column::ordinate([None, Some(f64::NAN)].into_iter());
        assert!(matches!(gaps, Column::Codes { ref codes, .. } if codes == "////////"));
    }
}
