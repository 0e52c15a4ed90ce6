//! The data of the interactive plots, as JSON inside the page.

use serde::Serialize;

use super::axis::unit_of;
use super::decimate::{ROWS_MAX, rows};
use super::pack::Column;
use super::page::{Panel, PlotGroup};
use super::still::{class, dashes};

#[derive(Serialize)]
struct LiveGroup<'a> {
    title: &'a str,
    contact: Option<(f64, f64)>,
    panels: Vec<LivePanel<'a>>,
}

#[derive(Serialize)]
struct LivePanel<'a> {
    y_label: &'a str,
    x_label: &'a str,
    x_unit: &'a str,
    unit: &'a str,
    height: u32,
    x: Column,
    curves: Vec<LiveCurve<'a>>,
    band: Option<LiveBand<'a>>,
}

#[derive(Serialize)]
struct LiveCurve<'a> {
    label: &'a str,
    role: &'static str,
    dash: Option<u8>,
    y: Column,
}

#[derive(Serialize)]
struct LiveBand<'a> {
    label: &'a str,
    low: Column,
    high: Column,
}

/// One group as JSON that may stand in a script element.
pub(super) fn json(group: &PlotGroup) -> String {
    let contact = group.contact.filter(|(begin, end)| begin.is_finite() && end.is_finite());
    let live = LiveGroup { title: &group.title, contact, panels: group.panels.iter().map(panel).collect() };
    let text = serde_json::to_string(&live).expect("a view model holds only strings and numbers");
    // A less-than sign occurs in strings only, so the escape is always legal and `</script>` cannot occur.
    text.replace('<', "\\u003c")
}

/// Whether some curve of the group is drawn with fewer points than it has.
pub(super) fn is_thinned(group: &PlotGroup) -> bool {
    group.panels.iter().any(|panel| panel.x.len() > ROWS_MAX)
}

fn panel(panel: &Panel) -> LivePanel<'_> {
    let band_edges: Vec<Vec<Option<f64>>> = panel
        .band
        .iter()
        .flat_map(|band| [&band.low, &band.high])
        .map(|edge| edge.iter().map(|value| Some(*value)).collect())
        .collect();
    let series: Vec<&[Option<f64>]> =
        panel.curves.iter().map(|curve| &curve.y[..]).chain(band_edges.iter().map(|edge| &edge[..])).collect();
    let kept = rows(panel.x.len(), &series, ROWS_MAX);
    let pick = |values: &[Option<f64>]| Column::ordinate(kept.iter().map(|row| values.get(*row).copied().flatten()));
    let x: Vec<f64> = kept.iter().map(|row| panel.x[*row]).collect();
    let curves = panel.curves.iter().zip(dashes(&panel.curves)).map(|(curve, dash)| LiveCurve {
        label: &curve.label,
        role: class(curve.role),
        dash: dash.chars().last().and_then(|digit| digit.to_digit(10)).map(|digit| digit as u8),
        y: pick(&curve.y),
    });
    let curves = curves.collect();
    let band = match (&panel.band, &band_edges[..]) {
        (Some(band), [low, high]) => Some(LiveBand { label: &band.label, low: pick(low), high: pick(high) }),
        _ => None,
    };
    LivePanel {
        y_label: &panel.y_label,
        x_label: &panel.x_label,
        x_unit: unit_of(&panel.x_label),
        unit: unit_of(&panel.y_label),
        height: panel.height_px,
        x: Column::abscissa(&x),
        curves,
        band,
    }
}
