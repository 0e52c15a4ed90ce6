//! The error ladder as inline SVG: a bar per model, a dot per test session, the noise floor as a dashed line.

use minijinja::HtmlEscape as Escaped;

use super::axis::{Axis, coordinate as xy, number};
use super::page::{LadderChannel, LadderStep};
use super::still::WIDTH;
use super::wrap::wrap;

/// Characters of a step's name in one line, and what a character takes at most at 13 units.
const LABEL_CHARACTERS: usize = 38;
const LABEL_WIDTH: f64 = 270.0;
/// Room on the right for a value and its ratio to the noise floor.
const VALUE_WIDTH: f64 = 170.0;
const HEAD: f64 = 34.0;
const FOOT: f64 = 42.0;
const LINE: f64 = 16.0;
const BAR: f64 = 16.0;

/// Draws the ladder of one channel.
pub(super) fn channel(channel: &LadderChannel) -> String {
    let labels: Vec<Vec<String>> = channel.steps.iter().map(|step| wrap(&step.label, LABEL_CHARACTERS)).collect();
    let heights: Vec<f64> = labels.iter().map(|lines| LINE * lines.len() as f64 + 14.0).collect();
    let bottom = HEAD + heights.iter().sum::<f64>();
    let height = bottom + FOOT;
    let axis = axis(channel);
    let name = Escaped(&channel.label);
    let mut svg = format!(r#"<svg viewBox="0 0 {WIDTH} {}" role="img" aria-label="{name}: error">"#, xy(height));
    svg.push_str(&scale(channel, &axis, bottom));
    let mut top = HEAD;
    for ((step, lines), height) in channel.steps.iter().zip(&labels).zip(&heights) {
        svg.push_str(&bar(step, lines, channel, &axis, top + 0.5 * height));
        top += height;
    }
    svg.push_str(&floor(channel, &axis, bottom));
    svg.push_str("</svg>");
    svg
}

/// From zero to a little above the greatest value.
fn axis(channel: &LadderChannel) -> Axis {
    let of_steps = channel.steps.iter().flat_map(|step| step.per_session.iter().copied().chain([step.value]));
    let most = of_steps.chain([channel.noise_floor]).filter(|value| value.is_finite()).fold(0.0, f64::max);
    let high = if most > 0.0 { 1.04 * most } else { 1.0 };
    Axis { low: 0.0, high, from: LABEL_WIDTH, to: WIDTH - VALUE_WIDTH }
}

/// Grid, numbers and unit of the abscissa, and the heads of the columns.
fn scale(channel: &LadderChannel, axis: &Axis, bottom: f64) -> String {
    let mut svg = String::from(r#"<g class="axis">"#);
    for (value, text) in axis.ticks(80.0) {
        let at = xy(axis.at(value));
        svg.push_str(&format!(r#"<path d="M{at} {}V{HEAD}"/>"#, xy(bottom)));
        svg.push_str(&format!(r#"<text x="{at}" y="{}" class="mid">{text}</text>"#, xy(bottom + 16.0)));
    }
    let (middle, below) = (xy(0.5 * (axis.from + axis.to)), xy(bottom + 34.0));
    let (label, unit) = (Escaped(&channel.label), Escaped(&channel.unit));
    svg.push_str(&format!(r#"<text x="{middle}" y="{below}" class="mid">error of {label} in {unit}</text></g>"#));
    svg.push_str(&format!(r#"<text x="{}" y="{}" class="end head">value</text>"#, xy(WIDTH - 80.0), xy(HEAD - 10.0)));
    svg.push_str(&format!(r#"<text x="{WIDTH}" y="{}" class="end head">over noise</text>"#, xy(HEAD - 10.0)));
    svg
}

/// One model: its name, its bar, a dot per session, its value.
fn bar(step: &LadderStep, lines: &[String], channel: &LadderChannel, axis: &Axis, middle: f64) -> String {
    let mut svg = String::new();
    let first = middle - 0.5 * LINE * (lines.len() as f64 - 1.0) + 4.5;
    for (index, line) in lines.iter().enumerate() {
        let y = xy(first + LINE * index as f64);
        svg.push_str(&format!(r#"<text x="{}" y="{y}" class="end">{}</text>"#, xy(axis.from - 10.0), Escaped(line)));
    }
    if step.value.is_finite() {
        let (x, y, width) = (xy(axis.from), xy(middle - 0.5 * BAR), xy((axis.at(step.value) - axis.from).max(0.0)));
        svg.push_str(&format!(r#"<rect class="bar" x="{x}" y="{y}" width="{width}" height="{BAR}"/>"#));
    }
    for value in step.per_session.iter().filter(|value| value.is_finite()) {
        let (x, y) = (xy(axis.at(*value)), xy(middle));
        svg.push_str(&format!(r#"<circle class="session" cx="{x}" cy="{y}" r="4"/>"#));
    }
    let (value, unit) = (number(step.value), Escaped(&channel.unit));
    let y = xy(middle + 4.5);
    svg.push_str(&format!(r#"<text x="{}" y="{y}" class="end value">{value} {unit}</text>"#, xy(WIDTH - 80.0)));
    if channel.noise_floor > 0.0 {
        let ratio = super::heat::cell(Some(step.value / channel.noise_floor));
        svg.push_str(&format!(r#"<text x="{WIDTH}" y="{y}" class="end">{ratio} ×</text>"#));
    }
    svg
}

/// The noise floor, in front of the bars, named at its top.
fn floor(channel: &LadderChannel, axis: &Axis, bottom: f64) -> String {
    let at = axis.at(channel.noise_floor);
    if !at.is_finite() {
        return String::new();
    }
    let (value, unit) = (number(channel.noise_floor), Escaped(&channel.unit));
    // The name begins at the line, or ends there if there is no room to the right.
    let (class, x) = if at < 0.5 * (axis.from + axis.to) { ("", at - 4.0) } else { ("end ", at + 4.0) };
    let (x, y, at) = (xy(x), xy(HEAD - 10.0), xy(at));
    let line = format!(r#"<path class="floor" d="M{at} {}V{}"/>"#, xy(HEAD - 5.0), xy(bottom));
    format!(r#"{line}<text x="{x}" y="{y}" class="{class}head">noise floor {value} {unit}</text>"#)
}
