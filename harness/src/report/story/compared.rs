//! Curves of a comparison: the blocks with clamped commands, the free runs as a band, force over penetration.

use super::super::page::{Band, Curve, Panel, PlotGroup, Role, XyCurve, XyPlot};
use super::signals::{FORCE_HEIGHT_PX, MM_PER_M, RESIDUAL_HEIGHT_PX, UM_PER_M, curve, panel};
use crate::compare::{Comparison, SessionComparison, Signals, Verdict};

/// More recordings than these make a page that nobody scrolls through.
const SESSIONS_MAX: usize = 4;

/// The recordings that are shown: those outside their noise first, then those with contact, else in their order.
pub(super) fn shown(comparison: &Comparison) -> Vec<&SessionComparison> {
    let mut sessions: Vec<&SessionComparison> = comparison.sessions.iter().collect();
    sessions.sort_by_key(|session| (session.verdict != Verdict::Outside, session.signals.contact_s.is_none()));
    sessions.truncate(SESSIONS_MAX);
    sessions
}

/// Curves over time.
pub(super) fn plots(shown: &[&SessionComparison]) -> Vec<PlotGroup> {
    let group = |(index, session): (usize, &&SessionComparison)| PlotGroup {
        id: format!("session-{}", index + 1),
        title: session.file.clone(),
        note: note(session),
        panels: panels(&session.signals),
        contact: session.signals.contact_s,
    };
    shown.iter().enumerate().map(group).collect()
}

fn note(session: &SessionComparison) -> String {
    let mut note = "Model: commands clamped to the recorded ones. Residual: measured minus model.".to_owned();
    if let Some(free_run) = &session.free_run {
        let (samples, seed) = (free_run.samples, free_run.seed);
        note.push_str(&format!(
            " Free runs start with the recorded motion and feed their own force back: {samples} of them, seed {seed}."
        ));
    }
    note
}

fn panels(signals: &Signals) -> Vec<Panel> {
    let mut panels = Vec::new();
    if !signals.force_time_s.is_empty() {
        panels.push(force(signals));
        let residual = with_gaps("measured - model", Role::Residual, &signals.force_residual_n, 1.0);
        let sigma = 0.5 * signals.force_band_n;
        panels.push(panel("force residual in N", RESIDUAL_HEIGHT_PX, &signals.force_time_s, vec![residual], sigma));
    }
    if !signals.pose_time_s.is_empty() {
        if signals.force_time_s.is_empty() {
            panels.push(position(signals));
        }
        let residual = with_gaps("measured - model", Role::Residual, &signals.pose_residual_m, UM_PER_M);
        let sigma = 0.5 * signals.pose_band_m * UM_PER_M;
        panels.push(panel("position residual in µm", RESIDUAL_HEIGHT_PX, &signals.pose_time_s, vec![residual], sigma));
    }
    panels
}

fn force(signals: &Signals) -> Panel {
    let length = signals.force_time_s.len();
    let has_free_runs = [&signals.free_low_n, &signals.free_high_n, &signals.free_median_n];
    let has_free_runs = length > 0 && has_free_runs.iter().all(|values| values.len() == length);
    let mut curves = vec![with_gaps("measured", Role::Measured, &signals.force_measured_n, 1.0)];
    curves.extend(
        has_free_runs.then(|| curve("free runs, median", Role::Earlier, signals.free_median_n.iter().copied())),
    );
    curves.push(curve("model", Role::Model, signals.force_model_n.iter().copied()));
    let mut panel = panel("force in N", FORCE_HEIGHT_PX, &signals.force_time_s, curves, 0.0);
    panel.band = has_free_runs.then(|| Band {
        low: signals.free_low_n.clone(),
        high: signals.free_high_n.clone(),
        label: "95 % of the free runs".to_owned(),
    });
    panel
}

/// Position itself, for a drive, whose force is an input.
fn position(signals: &Signals) -> Panel {
    let model = signals.pose_model_m.iter().map(|position_m| position_m * MM_PER_M);
    let curves = vec![
        with_gaps("measured", Role::Measured, &signals.pose_measured_m, MM_PER_M),
        curve("model", Role::Model, model),
    ];
    panel("position in mm", FORCE_HEIGHT_PX, &signals.pose_time_s, curves, 0.0)
}

fn with_gaps(label: &str, role: Role, values: &[Option<f64>], factor: f64) -> Curve {
    let y = values.iter().map(|value| value.map(|value| value * factor)).collect();
    Curve { label: label.to_owned(), role, y, dashed: false }
}

/// Force over penetration, in contact.
pub(super) fn loops(shown: &[&SessionComparison]) -> Vec<XyPlot> {
    shown.iter().filter_map(|session| loop_of(&session.file, &session.signals)).collect()
}

fn loop_of(file: &str, signals: &Signals) -> Option<XyPlot> {
    let (first_s, last_s) = signals.contact_s?;
    let inside = |row: &usize| signals.force_time_s.get(*row).is_some_and(|t| (first_s..=last_s).contains(t));
    let rows: Vec<usize> = (0..signals.depth_m.len()).filter(inside).collect();
    let x: Vec<f64> = rows.iter().map(|row| signals.depth_m[*row] * MM_PER_M).collect();
    let measured = |row: &usize| signals.force_measured_n.get(*row).copied().flatten().unwrap_or(f64::NAN);
    let model = |row: &usize| signals.force_model_n.get(*row).copied().unwrap_or(f64::NAN);
    let of = |label: &str, role: Role, y: Vec<f64>| XyCurve { label: label.to_owned(), role, x: x.clone(), y };
    (!rows.is_empty()).then(|| XyPlot {
        title: file.to_owned(),
        x_label: "penetration by the model in mm".to_owned(),
        y_label: "force in N".to_owned(),
        curves: vec![
            of("measured", Role::Measured, rows.iter().map(measured).collect()),
            of("model", Role::Model, rows.iter().map(model).collect()),
        ],
    })
}
