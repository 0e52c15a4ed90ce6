//! A calibration in words: a table of numbers, what the poses could show and which to add, what is left.

use super::ft::{FtCalibration, NamedNumber};
use crate::report::story::words::figures;
use nalgebra::Vector3;
use sim_core::calibration::observability::Weakest;
use sim_core::calibration::{Pattern, Shape};

/// Digits of a standard deviation: it is itself known to a tenth at best.
const DIGITS: i32 = 2;
/// Part of a unit vector that makes it one axis: within 18 degrees.
const ALONG: f64 = 0.95;
const READINGS: [&str; 6] = ["fx", "fy", "fz", "tx", "ty", "tz"];
const AXES: [&str; 3] = ["x", "y", "z"];

/// The whole result as text.
pub fn text(found: &FtCalibration) -> String {
    let mut lines = vec![format!(
        "{} poses at rest, {} directions of gravity, {:.0} degrees apart at most; {} iterations",
        found.poses.len(),
        found.observability.directions,
        found.observability.opening_deg,
        found.iterations
    )];
    lines.push(format!(
        "noise of a pose: {} N, {} N m ({}); weighted rms {:.2}",
        figures(found.force_sigma_n, DIGITS),
        figures(found.torque_sigma_n_m, DIGITS),
        found.noise_source,
        found.weighted_rms
    ));
    lines.push(String::new());
    lines.extend(number_lines(&found.numbers));
    lines.push(String::new());
    lines.push(format!("  {:<9} {:>10} {:>10}", "residual", "sd", "largest"));
    for (axis, name) in READINGS.iter().enumerate() {
        let unit = if axis < 3 { "N" } else { "N m" };
        lines.push(format!("  {name:<9} {:>10.4} {:>10.4} {unit}", found.residual_sd[axis], found.residual_max[axis]));
    }
    lines.push(String::new());
    if found.patterns.is_empty() {
        lines.push("residuals: white against every angle and against the order".to_owned());
    }
    lines.extend(found.patterns.iter().map(|words| format!("residuals: {words}")));
    lines.extend(observability_lines(found));
    lines.extend(found.findings.iter().cloned());
    lines.join("\n") + "\n"
}

/// One line for each vector or number.
fn number_lines(numbers: &[NamedNumber]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut rest = numbers;
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|number| number.name == first.name).count();
        let (own, others) = rest.split_at(count);
        let list = |of: fn(&NamedNumber) -> f64| own.iter().map(|n| digits(of(n))).collect::<Vec<_>>().join(" ");
        let values = format!("  {:<36}{}  {}", first.name, list(|number| number.value), first.unit);
        lines.push(values.trim_end_matches("  1").to_owned());
        lines.push(format!("  {:<36}{}", "  ± 1 sd", list(|number| number.deviation)));
        rest = others;
    }
    lines
}

fn digits(value: f64) -> String {
    format!("{value:>12.6}")
}

/// What the poses could show, and which to add.
fn observability_lines(found: &FtCalibration) -> Vec<String> {
    let seen = &found.found;
    let newton = |value: f64| format!("{} N", figures(value, DIGITS));
    let mut lines = vec![format!(
        "what the calibration is worth: a predicted force is known to {} in the poses, to {} in any attitude; \
         {} poses spread evenly would give {}",
        newton(seen.visited_n),
        newton(seen.anywhere_n),
        found.poses.len(),
        newton(seen.even_n)
    )];
    if seen.is_enough() {
        lines.push("more attitudes would help little".to_owned());
        return lines;
    }
    let half = found.observability.opening_deg / 2.0;
    lines.push(format!(
        "attitudes within ±{half:.0} degrees leave {} at {} ({} if spread evenly){}: add poses",
        axis_name(&seen.bias.direction, "the bias"),
        newton(seen.bias.deviation),
        newton(seen.bias.even),
        seen.misalignment.as_ref().map_or_else(String::new, misalignment_words)
    ));
    for addition in &seen.add {
        let d = addition.direction;
        lines.push(format!(
            "  add: gravity along ({:+.2}, {:+.2}, {:+.2}) of the sensor; then at most {} in any attitude, bias to {}",
            d.x,
            d.y,
            d.z,
            newton(addition.anywhere_n),
            newton(addition.bias_n)
        ));
    }
    lines
}

fn misalignment_words(weakest: &Weakest) -> String {
    let turn = axis_name(&weakest.direction, "the misalignment");
    format!(", {turn} at {} mrad", figures(weakest.deviation * 1e3, DIGITS))
}

/// 'the bias along x', or along a direction that is no axis.
pub fn axis_name(direction: &Vector3<f64>, what: &str) -> String {
    let most = direction.iamax();
    if direction[most].abs() >= ALONG {
        return format!("{what} along {}", AXES[most]);
    }
    format!("{what} along ({:+.2}, {:+.2}, {:+.2})", direction.x, direction.y, direction.z)
}

/// A pattern with its likely cause.
pub fn pattern_words(pattern: &Pattern) -> String {
    let unit = if pattern.axis < 3 { "N" } else { "N m" };
    let size = format!("{} {:.3} {unit}", READINGS[pattern.axis], pattern.amplitude);
    match pattern.shape {
        Shape::Once(about) => format!(
            "{size} with sin and cos of gravity's angle about {}: centre of mass, misalignment, mass or crosstalk is left \
             (try --crosstalk)",
            AXES[about]
        ),
        Shape::Twice(about) => format!(
            "{size} with twice gravity's angle about {}: something grows with the square of the load, such as a tool or arm that \
             sags",
            AXES[about]
        ),
        Shape::Order => format!(
            "{size} over the order of the poses: the bias drifts (warm the sensor up, or record its temperature and use \
             --temperature)"
        ),
    }
}
