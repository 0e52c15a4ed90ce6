//! A panel as inline SVG: what is seen in print and without JavaScript.

use minijinja::HtmlEscape as Escaped;

use super::axis::{Axis, coordinate as xy, path};
use super::page::{Curve, Panel, PlotGroup, Role};

/// Width of the drawing. At 900 a text of 13 units is 7.6 pt on A4 and still small on a screen.
pub(super) const WIDTH: f64 = 900.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = MARGIN;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 24.0;
/// Width of a digit of the axes' numbers, and what lies right of every drawing at least.
const DIGIT: f64 = 7.5;
const MARGIN: f64 = 10.0;
const LABEL_ROW: f64 = 20.0;
/// Groups of samples per curve; each gives a minimum and a maximum, together about 600 points.
const BUCKETS: usize = 300;

/// The CSS class of a role.
pub(super) fn class(role: Role) -> &'static str {
    match role {
        Role::Measured => "measured",
        Role::Model => "model",
        Role::Earlier => "earlier",
        Role::Residual => "residual",
        Role::Limit => "limit",
    }
}

/// Draws one panel. Only the lowest panel of a group carries the label of the abscissa.
pub(super) fn panel(group: &PlotGroup, panel: &Panel, with_x_label: bool) -> String {
    let height = f64::from(panel.height_px) + if with_x_label { LABEL_ROW } else { 0.0 };
    let x_of_panels = group.panels.iter().flat_map(|panel| panel.x.iter().copied());
    let x = Axis::over(x_of_panels, 0.0, LEFT, WIDTH - RIGHT);
    let y = Axis::over(ordinates(panel), 0.05, f64::from(panel.height_px) - BOTTOM, TOP);
    let mut svg = format!(
        r#"<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{} over {}">"#,
        Escaped(&panel.y_label),
        Escaped(&panel.x_label)
    );
    if let Some((begin, end)) = group.contact {
        let (begin, end) = (x.at(begin).clamp(LEFT, WIDTH - RIGHT), x.at(end).clamp(LEFT, WIDTH - RIGHT));
        svg.push_str(&contact(begin, end, y.to, y.from));
    }
    svg.push_str(&frame(&x, &y));
    if with_x_label {
        let middle = xy(0.5 * (x.from + x.to));
        let text = Escaped(&panel.x_label);
        svg.push_str(&format!(r#"<text x="{middle}" y="{}" class="mid">{text}</text>"#, xy(height - 6.0)));
    }
    svg.push_str(r#"<g transform="scale(.1)">"#);
    svg.push_str(&band(panel, &x, &y));
    for (dash, curve) in dashes(&panel.curves).into_iter().zip(&panel.curves) {
        let d = path(thin(&panel.x, &curve.y).map(|point| point.map(|(a, b)| (x.at(a), y.at(b)))));
        svg.push_str(&format!(r#"<path class="curve {}{dash}" d="{d}"/>"#, class(curve.role)));
    }
    svg.push_str("</g></svg>");
    svg
}

/// The CSS class that dashes a curve, with a leading space. Several earlier models get different dashes.
pub(super) fn dashes(curves: &[Curve]) -> Vec<String> {
    let mut earlier = 0;
    let dash = |curve: &Curve| match (curve.dashed, curve.role) {
        (false, _) => String::new(),
        (true, Role::Earlier) => {
            earlier += 1;
            format!(" dash-{}", (earlier - 1) % 3 + 1)
        }
        (true, _) => " dash-0".to_owned(),
    };
    curves.iter().map(dash).collect()
}

/// Grid, ticks and numbers of both axes.
pub(super) fn frame(x: &Axis, y: &Axis) -> String {
    let mut svg = String::from(r#"<g class="axis">"#);
    for (value, text) in y.ticks(28.0) {
        let at = y.at(value);
        let line = format!(r#"<path d="M{} {}H{}"/>"#, xy(x.from), xy(at), xy(x.to));
        svg.push_str(&line);
        svg.push_str(&format!(r#"<text x="{}" y="{}" class="end">{text}</text>"#, xy(x.from - 6.0), xy(at + 4.0)));
    }
    for (value, text) in x.ticks(80.0) {
        let at = x.at(value);
        let line = format!(r#"<path d="M{} {}V{}"/>"#, xy(at), xy(y.from), xy(y.to));
        svg.push_str(&line);
        // A text that would leave the drawing ends at its edge.
        let half = 0.5 * DIGIT * text.chars().count() as f64;
        let (at, class) = if at + half > x.to + MARGIN { (x.to + MARGIN, "end") } else { (at, "mid") };
        svg.push_str(&format!(r#"<text x="{}" y="{}" class="{class}">{text}</text>"#, xy(at), xy(y.from + 16.0)));
    }
    svg.push_str("</g>");
    svg
}

/// Shades the contact.
fn contact(begin: f64, end: f64, top: f64, bottom: f64) -> String {
    let (width, height) = (xy((end - begin).max(0.5)), xy(bottom - top));
    format!(r#"<rect class="contact" x="{}" y="{}" width="{width}" height="{height}"/>"#, xy(begin), xy(top))
}

/// The band as one closed path, in tenths.
fn band(panel: &Panel, x: &Axis, y: &Axis) -> String {
    let Some(band) = &panel.band else {
        return String::new();
    };
    let edge = |values: &[f64]| -> Vec<Option<(f64, f64)>> {
        let values: Vec<Option<f64>> = values.iter().map(|value| Some(*value)).collect();
        thin(&panel.x, &values).filter(Option::is_some).map(|p| p.map(|(a, b)| (x.at(a), y.at(b)))).collect()
    };
    let outline = edge(&band.high).into_iter().chain(edge(&band.low).into_iter().rev());
    format!(r#"<path class="band" d="{}z"/>"#, path(outline))
}

/// All values that the ordinate has to show.
fn ordinates(panel: &Panel) -> impl Iterator<Item = f64> {
    let curves = panel.curves.iter().flat_map(|curve| curve.y.iter().copied().flatten());
    let band = panel.band.iter().flat_map(|band| band.low.iter().chain(&band.high).copied());
    curves.chain(band)
}

/// Minimum and maximum of each group of samples, in their order; a group that holds a gap ends the line.
fn thin<'a>(x: &'a [f64], y: &'a [Option<f64>]) -> impl Iterator<Item = Option<(f64, f64)>> + 'a {
    let length = x.len().min(y.len());
    let buckets = if length <= 2 * BUCKETS { length } else { BUCKETS };
    let point = move |index: usize| y[index].filter(|v| v.is_finite()).map(|value| (x[index], value));
    (0..buckets).flat_map(move |bucket| {
        let (begin, end) = (bucket * length / buckets, (bucket + 1) * length / buckets);
        let inside = || (begin..end).filter_map(|index| point(index).map(|p| (index, p.1)));
        let low = inside().min_by(|a, b| a.1.total_cmp(&b.1)).map(|found| found.0);
        let high = inside().max_by(|a, b| a.1.total_cmp(&b.1)).map(|found| found.0);
        let has_gap = (begin..end).any(|index| point(index).is_none());
        let (first, second) = if low <= high { (low, high) } else { (high, low) };
        let second = second.filter(|_| first != second);
        let line = [first, second].into_iter().flatten().map(point);
        line.chain(has_gap.then_some(None))
    })
}
