//! A stable domain as inline SVG: strips of stability, curves over them, and the operating point with its cross hairs.

use minijinja::HtmlEscape as Escaped;

use super::axis::{Axis, coordinate as xy, path};
use super::loops::dash;
use super::page::Chart;
use super::still::{class, frame};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 46.0;

/// Draws one chart.
pub(super) fn drawing(chart: &Chart) -> String {
    let x = Axis { low: chart.x_range.0, high: chart.x_range.1, from: LEFT, to: WIDTH - RIGHT };
    let y = Axis { low: chart.y_range.0, high: chart.y_range.1, from: HEIGHT - BOTTOM, to: TOP };
    let (title, over, up) = (Escaped(&chart.title), Escaped(&chart.x_label), Escaped(&chart.y_label));
    let mut svg = format!(
        r#"<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}: stable domain, {up} over {over}">"#
    );
    svg.push_str(&shaded("stable", &chart.strips, &x, &y));
    svg.push_str(&shaded("untold", &chart.untold, &x, &y));
    svg.push_str(&frame(&x, &y));
    let (left, centre) = (14.0, xy(0.5 * (y.from + y.to)));
    svg.push_str(&format!(
        r#"<text x="{left}" y="{centre}" class="mid" transform="rotate(-90 {left} {centre})">{up}</text>"#
    ));
    let (middle, bottom) = (xy(0.5 * (x.from + x.to)), xy(HEIGHT - 8.0));
    svg.push_str(&format!(r#"<text x="{middle}" y="{bottom}" class="mid">{over}</text>"#));
    for curve in &chart.curves {
        let inside = |(a, b): (&f64, &f64)| {
            let (a, b) = (x.at(*a), y.at(*b));
            ((LEFT..=WIDTH - RIGHT).contains(&a) && (TOP..=HEIGHT - BOTTOM).contains(&b)).then_some((a, b))
        };
        let d = path(curve.x.iter().zip(&curve.y).map(inside));
        let class = class(curve.role);
        let line = format!(r#"<path class="curve {class}{}" d="{d}"/>"#, dash(curve.role));
        svg.push_str(&format!(r#"<g transform="scale(.1)">{line}</g>"#));
    }
    svg.push_str(&operating_point(chart, &x, &y));
    svg.push_str("</svg>");
    svg
}

/// All strips as one shaded path; neighbours overlap by a hair, so that no gaps show.
fn shaded(class: &str, strips: &[Vec<(f64, f64)>], x: &Axis, y: &Axis) -> String {
    let width = (x.to - x.from) / strips.len().max(1) as f64;
    let mut d = String::new();
    for (index, strip) in strips.iter().enumerate() {
        let left = x.from + width * index as f64;
        for (low, high) in strip {
            let (bottom, top) = (y.at(*low), y.at(*high));
            let right = xy((left + width + 0.2).min(x.to));
            d.push_str(&format!("M{} {}V{}H{right}V{}Z", xy(left), xy(bottom), xy(top), xy(bottom)));
        }
    }
    format!(r#"<path class="{class}" d="{d}"/>"#)
}

/// A dot with cross hairs; a point outside the domain has none.
fn operating_point(chart: &Chart, x: &Axis, y: &Axis) -> String {
    let (a, b) = (x.at(chart.point.0), y.at(chart.point.1));
    if !((LEFT..=WIDTH - RIGHT).contains(&a) && (TOP..=HEIGHT - BOTTOM).contains(&b)) {
        return String::new();
    }
    let (a, b) = (xy(a), xy(b));
    format!(
        r#"<path class="floor" d="M{a} {}V{}M{} {b}H{}"/><circle class="point" cx="{a}" cy="{b}" r="5"/>"#,
        xy(y.from),
        xy(y.to),
        xy(x.from),
        xy(x.to)
    )
}
