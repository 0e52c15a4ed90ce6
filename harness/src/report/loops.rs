//! Force over penetration as inline SVG: a loop is not a function of time, so it is not thinned in time.

use minijinja::HtmlEscape as Escaped;

use super::axis::{Axis, coordinate as xy, path};
use super::page::{Role, XyCurve, XyPlot};
use super::still::{class, frame};

const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 360.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 44.0;
/// Points closer than this to the last one drawn are left out; below the width of a line.
const STEP_MIN: f64 = 0.7;

/// Draws one plot.
pub(super) fn plot(plot: &XyPlot) -> String {
    let abscissae = plot.curves.iter().flat_map(|curve| curve.x.iter().copied());
    let ordinates = plot.curves.iter().flat_map(|curve| curve.y.iter().copied());
    let x = Axis::over(abscissae, 0.03, LEFT, WIDTH - RIGHT);
    let y = Axis::over(ordinates, 0.05, HEIGHT - BOTTOM, TOP);
    let mut svg = format!(
        r#"<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{}: {} over {}">"#,
        Escaped(&plot.title),
        Escaped(&plot.y_label),
        Escaped(&plot.x_label)
    );
    svg.push_str(&frame(&x, &y));
    let (left, centre) = (14.0, xy(0.5 * (y.from + y.to)));
    let turned = format!(r#"transform="rotate(-90 {left} {centre})""#);
    let label = Escaped(&plot.y_label);
    svg.push_str(&format!(r#"<text x="{left}" y="{centre}" class="mid" {turned}>{label}</text>"#));
    let (middle, bottom) = (xy(0.5 * (x.from + x.to)), xy(HEIGHT - 8.0));
    svg.push_str(&format!(r#"<text x="{middle}" y="{bottom}" class="mid">{}</text>"#, Escaped(&plot.x_label)));
    for curve in &plot.curves {
        svg.push_str(&line(curve, &x, &y));
    }
    svg.push_str("</svg>");
    svg
}

/// The CSS class that dashes a curve: everything but the measurement, so that curves differ without colour.
pub(super) fn dash(role: Role) -> &'static str {
    match role {
        Role::Measured | Role::Residual => "",
        Role::Model | Role::Limit => " dash-0",
        Role::Earlier => " dash-1",
    }
}

/// One curve, its begin marked by a dot.
fn line(curve: &XyCurve, x: &Axis, y: &Axis) -> String {
    let drawn: Vec<Option<(f64, f64)>> = curve
        .x
        .iter()
        .zip(&curve.y)
        .map(|(a, b)| (a.is_finite() && b.is_finite()).then(|| (x.at(*a), y.at(*b))))
        .collect();
    let class = class(curve.role);
    let d = path(thin(&drawn).into_iter());
    let mut svg = format!(r#"<g transform="scale(.1)"><path class="curve {class}{}" d="{d}"/></g>"#, dash(curve.role));
    if let Some((begin_x, begin_y)) = drawn.iter().copied().flatten().next() {
        svg.push_str(&format!(r#"<circle class="dot {class}" cx="{}" cy="{}" r="3.5"/>"#, xy(begin_x), xy(begin_y)));
    }
    svg
}

/// Leaves out points that lie within a line's width of the last one drawn; the last point stays.
fn thin(points: &[Option<(f64, f64)>]) -> Vec<Option<(f64, f64)>> {
    let mut kept: Vec<Option<(f64, f64)>> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let is_last = index + 1 == points.len();
        let is_near = match (kept.last(), point) {
            (Some(Some(last)), Some(here)) => (here.0 - last.0).abs() + (here.1 - last.1).abs() < STEP_MIN,
            _ => false,
        };
        if !is_near || is_last {
            kept.push(*point);
        }
    }
    kept
}
