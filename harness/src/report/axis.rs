//! Axes of the drawings that need no JavaScript: range, round ticks, numbers as text.

use std::fmt::Write as _;

/// Numbers of this size, and of more decimals than these, would not fit beside an axis: they get an exponent.
const LONG: f64 = 1e7;
const DECIMALS_MAX: usize = 5;
/// Keeps a power of ten that was computed from falling below itself.
const ALMOST: f64 = 1.0 + 1e-9;

/// A linear map from values to drawing units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Value at the begin of the axis.
    pub low: f64,
    /// Value at the end of the axis; greater than `low`.
    pub high: f64,
    /// Drawing unit at `low`.
    pub from: f64,
    /// Drawing unit at `high`; less than `from` where the axis points up.
    pub to: f64,
}

impl Axis {
    /// The range of the finite values, widened by `margin` of its width on both sides.
    pub fn over(values: impl Iterator<Item = f64>, margin: f64, from: f64, to: f64) -> Self {
        let finite = values.filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = match high - low {
            width if width > 0.0 => (low - margin * width, high + margin * width),
            // A constant curve lies in the middle of a range as wide as its value.
            width if width >= 0.0 => (low - 0.5 * low.abs().max(1.0), high + 0.5 * high.abs().max(1.0)),
            _ => (0.0, 1.0),
        };
        Self { low, high, from, to }
    }

    /// Drawing unit of a value.
    pub fn at(&self, value: f64) -> f64 {
        self.from + (value - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// Round values with their texts, about one per `spacing` drawing units.
    pub fn ticks(&self, spacing: f64) -> Vec<(f64, String)> {
        let count = ((self.to - self.from).abs() / spacing).max(1.0);
        let (step, decimals) = round_step((self.high - self.low) / count);
        let is_long = self.low.abs().max(self.high.abs()) >= LONG || decimals > DECIMALS_MAX;
        let first = libm::ceil(self.low / step);
        let last = libm::floor(self.high / step);
        let mut ticks = Vec::new();
        let mut index = first;
        while index <= last && ticks.len() < 100 {
            ticks.push((index * step, if is_long { short(index * step, step) } else { fixed(index * step, decimals) }));
            index += 1.0;
        }
        ticks
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`, and the decimals that it needs.
fn round_step(least: f64) -> (f64, usize) {
    let mut exponent = libm::floor(libm::log10(least));
    let mut power = libm::pow(10.0, exponent);
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= least).unwrap_or_else(|| {
        exponent += 1.0;
        power *= 10.0;
        1.0
    });
    (factor * power, (-exponent).clamp(0.0, 12.0) as usize)
}

/// A tick with an exponent, and as many digits as tell it from the next one.
fn short(value: f64, step: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = libm::floor(libm::log10(value.abs() * ALMOST)) - libm::floor(libm::log10(step * ALMOST));
    format!("{value:.*e}", digits.clamp(0.0, 12.0) as usize)
}

/// A number with fixed decimals, never `-0`.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        _ => text,
    }
}

/// A number as a reader wants it: four significant digits from 1 upwards, three below, at most three decimals more
/// than needed for that.
pub(super) fn number(value: f64) -> String {
    if !value.is_finite() {
        return "not finite".to_owned();
    }
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits_before = libm::floor(libm::log10(size)) + 1.0;
    let significant = if size >= 1.0 { 4.0 } else { 3.0 };
    fixed(value, (significant - digits_before).clamp(0.0, 7.0) as usize)
}

/// The unit of a label: what follows the last ` in `, or stands in brackets at the end; empty if there is none.
pub(super) fn unit_of(label: &str) -> &str {
    let label = label.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some(unit) = label.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
            return unit.1.trim();
        }
    }
    label.rsplit_once(" in ").map_or("", |(_, unit)| unit.trim())
}

/// A coordinate with one decimal, which is a tenth of a CSS pixel.
pub(super) fn coordinate(value: f64) -> String {
    let text = fixed(value, 1);
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// An SVG path in tenths of a drawing unit, as relative steps because they are short. `None` begins a new line.
pub(super) fn path(points: impl Iterator<Item = Option<(f64, f64)>>) -> String {
    let mut text = String::new();
    let mut pen: Option<(i64, i64)> = None;
    for point in points {
        let Some((x, y)) = point else {
            pen = None;
            continue;
        };
        let here = (libm::round(x * 10.0) as i64, libm::round(y * 10.0) as i64);
        let (letter, dx, dy) = match pen {
            Some(last) if last == here => continue,
            Some(last) => ('l', here.0 - last.0, here.1 - last.1),
            None => ('M', here.0, here.1),
        };
        let comma = if dy < 0 { "" } else { " " };
        write!(text, "{letter}{dx}{comma}{dy}").expect("writing to a string cannot fail");
        // A line that consists of one point is drawn as a dot by the round line cap.
        if letter == 'M' {
            text.push_str("l0 0");
        }
        pen = Some(here);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [(0.7041, "0.704"), (1.1239, "1.124"), (12.345, "12.35"), (-0.0, "0"), (0.04519, "0.0452")]
        {
            assert_eq!(number(value), text);
        }
        assert_eq!(number(1234.5), "1234");
        assert_eq!(number(f64::NAN), "not finite");
        assert_eq!(fixed(-0.0001, 2), "0.00");
    }

    #[test]
    fn units_come_from_labels() {
        for (label, unit) in [("force x in N", "N"), ("gap [mm]", "mm"), ("rate (deg/s)", "deg/s"), ("count", "")] {
            assert_eq!(unit_of(label), unit);
        }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis { low: -0.13, high: 1.01, from: 0.0, to: 400.0 };
        let texts: Vec<String> = axis.ticks(80.0).into_iter().map(|tick| tick.1).collect();
        assert_eq!(texts, ["0.0", "0.5", "1.0"]);
        let axis = Axis { low: 0.0, high: 2.4e9, from: 0.0, to: 400.0 };
        let texts: Vec<String> = axis.ticks(80.0).into_iter().map(|tick| tick.1).collect();
        assert_eq!(texts, ["0", "5e8", "1.0e9", "1.5e9", "2.0e9"]);
        let axis = Axis { low: 0.0, high: 3e-6, from: 0.0, to: 240.0 };
        let texts: Vec<String> = axis.ticks(80.0).into_iter().map(|tick| tick.1).collect();
        assert_eq!(texts, ["0", "1e-6", "2e-6", "3e-6"]);
    }
}
