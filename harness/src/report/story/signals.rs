//! What was measured and what the models say: over time, and force over penetration.

use super::super::page::{Band, Curve, Panel, PlotGroup, Role, XyCurve, XyPlot};
use crate::diagnose::answer::Curves;
use crate::diagnose::noise::Noise;

/// More recordings than these make a page that nobody scrolls through.
const TESTS_MAX: usize = 3;
pub(super) const FORCE_HEIGHT_PX: u32 = 230;
pub(super) const RESIDUAL_HEIGHT_PX: u32 = 140;
pub(super) const MM_PER_M: f64 = 1e3;
pub(super) const UM_PER_M: f64 = 1e6;

/// The recordings that are shown: the first test recordings, those with contact first, and the learning recording that the model
/// as given fits worst.
pub(super) fn shown<'a>(curves: &'a [Curves], noise: &Noise) -> Vec<&'a Curves> {
    let tests = |touches: bool| curves.iter().filter(move |c| c.role == "test" && c.contact_s.is_some() == touches);
    let mut shown: Vec<&Curves> = tests(true).take(TESTS_MAX).collect();
    if shown.is_empty() {
        shown.extend(tests(false).take(1));
    }
    let learned = curves.iter().filter(|curves| curves.role == "learn");
    shown.extend(learned.max_by(|a, b| misfit(a, noise).total_cmp(&misfit(b, noise))));
    shown
}

/// Mean square of what the model as given leaves, over the noise, both channels.
fn misfit(curves: &Curves, noise: &Noise) -> f64 {
    let over = |measured: &[f64], before: &[f64], floor: f64| {
        let differences = measured.iter().zip(before).map(|(m, p)| m - p).filter(|d| d.is_finite());
        let (sum, count) = differences.fold((0.0, 0.0), |(sum, count), d| (sum + d * d, count + 1.0));
        let floor = if floor > 0.0 { floor } else { 1.0 };
        if count > 0.0 { sum / count / (floor * floor) } else { 0.0 }
    };
    over(&curves.force_measured_n, &curves.force_before_n, noise.force_floor_n)
        + over(&curves.position_measured_m, &curves.position_before_m, noise.position_floor_m)
}

/// Curves over time.
pub(super) fn plots(shown: &[&Curves], noise: &Noise) -> Vec<PlotGroup> {
    shown.iter().enumerate().map(|(index, curves)| group(index, curves, noise)).collect()
}

fn group(index: usize, curves: &Curves, noise: &Noise) -> PlotGroup {
    let (title, note) = match curves.role {
        "test" => (
            format!("Test recording {}", curves.file),
            "Not used to fit or to choose. Commands are clamped to the recorded ones; residuals are measured minus model.",
        ),
        "learn" => (
            format!("Learning recording {}", curves.file),
            "Of the recordings that were fitted, the one that the model as given fits worst. Residuals are measured minus model.",
        ),
        _ => (format!("Recording {}", curves.file), "Residuals are measured minus model."),
    };
    PlotGroup {
        id: format!("{}-{}", if curves.role.is_empty() { "run" } else { curves.role }, index + 1),
        title,
        note: note.to_owned(),
        panels: panels(curves, noise),
        contact: curves.contact_s,
    }
}

fn panels(curves: &Curves, noise: &Noise) -> Vec<Panel> {
    let changed = curves.force_before_n != curves.force_after_n || curves.position_before_m != curves.position_after_m;
    let mut panels = Vec::new();
    if !curves.force_measured_n.is_empty() {
        let mut force = vec![curve("measured", Role::Measured, curves.force_measured_n.iter().copied())];
        force.extend(changed.then(|| curve("model as given", Role::Earlier, curves.force_before_n.iter().copied())));
        force.push(curve(after_label(changed), Role::Model, curves.force_after_n.iter().copied()));
        panels.push(panel("force in N", FORCE_HEIGHT_PX, &curves.sensor_time_s, force, 0.0));
        let of = |model: &[f64]| residual(&curves.force_measured_n, model, 1.0);
        let force = residuals(changed, of(&curves.force_before_n), of(&curves.force_after_n));
        let band = noise.force_floor_n;
        panels.push(panel("force residual in N", RESIDUAL_HEIGHT_PX, &curves.sensor_time_s, force, band));
    }
    if !curves.position_measured_m.is_empty() {
        let of = |model: &[f64]| residual(&curves.position_measured_m, model, UM_PER_M);
        let position = residuals(changed, of(&curves.position_before_m), of(&curves.position_after_m));
        let band = noise.position_floor_m * UM_PER_M;
        panels.push(panel("position residual in µm", RESIDUAL_HEIGHT_PX, &curves.loop_time_s, position, band));
    }
    panels
}

fn after_label(changed: bool) -> &'static str {
    if changed { "with what was found" } else { "model as given" }
}

fn residual(measured: &[f64], model: &[f64], factor: f64) -> Vec<f64> {
    measured.iter().zip(model).map(|(m, p)| (m - p) * factor).collect()
}

fn residuals(changed: bool, before: Vec<f64>, after: Vec<f64>) -> Vec<Curve> {
    let mut curves = Vec::new();
    curves
        .extend(changed.then(|| Curve { dashed: false, ..curve("model as given", Role::Earlier, before.into_iter()) }));
    curves.push(curve(after_label(changed), Role::Residual, after.into_iter()));
    curves
}

/// A curve without gaps; earlier models are dashed.
pub(super) fn curve(label: &str, role: Role, values: impl Iterator<Item = f64>) -> Curve {
    let dashed = matches!(role, Role::Earlier);
    Curve { label: label.to_owned(), role, y: values.map(Some).collect(), dashed }
}

/// A panel over time; the band is two standard deviations wide on both sides of zero, and absent where there is no noise.
pub(super) fn panel(y_label: &str, height_px: u32, time_s: &[f64], curves: Vec<Curve>, sigma: f64) -> Panel {
    let edge = |sign: f64| vec![sign * 2.0 * sigma; time_s.len()];
    let band = Band { low: edge(-1.0), high: edge(1.0), label: "±2σ of the noise".to_owned() };
    Panel {
        y_label: y_label.to_owned(),
        x_label: "time in s".to_owned(),
        height_px,
        x: time_s.to_vec(),
        curves,
        band: (sigma > 0.0).then_some(band),
    }
}

/// Force over penetration of the shown test recordings, in contact.
pub(super) fn loops(shown: &[&Curves]) -> Vec<XyPlot> {
    shown.iter().filter(|curves| curves.role == "test").filter_map(|curves| loop_of(curves)).collect()
}

fn loop_of(curves: &Curves) -> Option<XyPlot> {
    let (first_s, last_s) = curves.contact_s?;
    let inside = |index: &usize| curves.sensor_time_s.get(*index).is_some_and(|t| (first_s..=last_s).contains(t));
    let rows: Vec<usize> = (0..curves.depth_m.len()).filter(inside).collect();
    let depth_mm: Vec<f64> = rows.iter().map(|row| curves.depth_m[*row] * MM_PER_M).collect();
    let of = |label: &str, role: Role, force_n: &[f64]| XyCurve {
        label: label.to_owned(),
        role,
        x: depth_mm.clone(),
        y: rows.iter().map(|row| force_n.get(*row).copied().unwrap_or(f64::NAN)).collect(),
    };
    let changed = curves.force_before_n != curves.force_after_n;
    let mut drawn = vec![of("measured", Role::Measured, &curves.force_measured_n)];
    drawn.extend(changed.then(|| of("model as given", Role::Earlier, &curves.force_before_n)));
    drawn.push(of(after_label(changed), Role::Model, &curves.force_after_n));
    Some(XyPlot {
        title: curves.file.clone(),
        x_label: "penetration by the last model in mm".to_owned(),
        y_label: "force in N".to_owned(),
        curves: drawn,
    })
}
