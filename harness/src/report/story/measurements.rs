//! The page of two measurements: limits, what differs, the curves of both since first contact.

use super::super::page::{Curve, Page, Panel, PlotGroup, Role, Section, Table, Tone};
use super::maps::channel_of_key;
use super::signals::{FORCE_HEIGHT_PX, MM_PER_M, panel};
use super::table::{numbers, row, table, words};
use super::words::{Scale, counted, joined, listed, number};
use crate::compare::{CompareVerdict, Difference, Measurements, Outcome, RunAgainst, Verdict};

/// An uncertainty below this share of its value is rounding. Chosen: far below any sensor, far above a sum of a hundred doubles.
const ROUNDING: f64 = 1e-9;

/// The page of recordings against a reference. `command` makes it again.
pub fn measurements(answer: &Measurements, command: &str, provenance: &[(String, String)]) -> Page {
    Page {
        title: format!("{} against the measurement {}", counted(answer.runs.len(), "recording"), answer.reference),
        tone: match answer.verdict {
            CompareVerdict::InsideNoise | CompareVerdict::Pass => Tone::Good,
            CompareVerdict::CannotSay | CompareVerdict::Undecided => Tone::Warning,
            CompareVerdict::Outside | CompareVerdict::Fail => Tone::Bad,
        },
        verdict: verdict(answer),
        sentences: answer.findings.clone(),
        command: command.to_owned(),
        heat: Vec::new(),
        plots: answer.runs.iter().enumerate().map(|(place, run)| group(place, run, &answer.reference)).collect(),
        loops: Vec::new(),
        charts: Vec::new(),
        tables: limits(answer).into_iter().chain(answer.runs.iter().filter_map(quantities)).collect(),
        ladder: None,
        provenance: provenance.to_vec(),
    }
}

fn verdict(answer: &Measurements) -> String {
    let held = |outcome: Outcome| answer.limits.iter().filter(|limit| limit.outcome == outcome).count();
    let all = counted(answer.limits.len(), "limit");
    match answer.verdict {
        CompareVerdict::InsideNoise => "the measurements agree within their uncertainty".to_owned(),
        CompareVerdict::Outside => format!("the measurements differ: {}", listed(&outside(answer), "and")),
        CompareVerdict::CannotSay => "cannot say: a quantity or its uncertainty is not known".to_owned(),
        CompareVerdict::Pass => format!("pass: {all} held, uncertainty included"),
        CompareVerdict::Fail => format!("fail: {} of {all} exceeded, uncertainty included", held(Outcome::Fail)),
        CompareVerdict::Undecided => format!("undecided: {} of {all} within the uncertainty", held(Outcome::Undecided)),
    }
}

/// What differs, each named once.
fn outside(answer: &Measurements) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let differs = |one: &&Difference| one.verdict == Verdict::Outside && !one.about.ends_with("decides nothing");
    for one in answer.runs.iter().flat_map(|run| &run.quantities).filter(differs) {
        let name = channel_of_key(&one.name);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn limits(answer: &Measurements) -> Option<Table> {
    let rows = answer.limits.iter().map(|limit| {
        let (tone, outcome) = match limit.outcome {
            Outcome::Pass => (Tone::Good, "pass"),
            Outcome::Fail => (Tone::Bad, "fail"),
            Outcome::Undecided => (Tone::Warning, "undecided"),
        };
        let scale = Scale::of(&limit.unit, limit.limit.max(limit.value.unwrap_or(0.0)));
        let cells = vec![
            limit.session.clone(),
            channel_of_key(&limit.channel),
            joined(&number(limit.limit * scale.factor), &scale.unit),
            with_uncertainty(limit.value, limit.uncertainty, &scale),
            outcome.to_owned(),
        ];
        row(Some(tone), cells)
    });
    let columns =
        vec![words("recording"), words("quantity"), numbers("limit"), numbers("difference ± 2u"), words("outcome")];
    let note =
        "Pass: the absolute difference and 2u together are within the limit; fail: it exceeds it by more than 2u.";
    table(Section::Verdict, "Limits", note, columns, rows.collect())
}

fn quantities(run: &RunAgainst) -> Option<Table> {
    let rows = run.quantities.iter().map(|one| {
        let (tone, word) = match one.verdict {
            Verdict::InsideNoise => (Tone::Good, "inside"),
            Verdict::CannotSay => (Tone::Warning, "cannot say"),
            Verdict::Outside => (Tone::Bad, "outside"),
        };
        let tone = if one.about.ends_with("decides nothing") { None } else { Some(tone) };
        let scale = Scale::of(&one.unit, one.value.unwrap_or(0.0).abs().max(one.reference.unwrap_or(0.0).abs()));
        let cells = vec![
            channel_of_key(&one.name),
            with_uncertainty(one.value, one.value_uncertainty, &scale),
            with_uncertainty(one.reference, one.reference_uncertainty, &scale),
            with_uncertainty(one.difference, one.uncertainty, &scale),
            word.to_owned(),
        ];
        row(tone, cells)
    });
    let columns = vec![
        words("quantity"),
        numbers("this recording ± 2u"),
        numbers("reference ± 2u"),
        numbers("difference ± 2u"),
        words("verdict"),
    ];
    let how: Vec<String> =
        run.quantities.iter().map(|one| format!("{}: {}", channel_of_key(&one.name), one.about)).collect();
    let note = format!("Difference: this recording minus the reference. {}.", how.join(". "));
    table(Section::Quantities, &run.file, note, columns, rows.collect())
}

fn with_uncertainty(value: Option<f64>, twice: Option<f64>, scale: &Scale) -> String {
    match (value, twice) {
        // What was recorded exactly has the scatter of rounding.
        (Some(value), Some(twice)) if twice < ROUNDING * value.abs() => scale.with_sd(value, 0.0),
        (Some(value), Some(twice)) => scale.with_sd(value, twice),
        (Some(value), None) => format!("{}, u unknown", joined(&number(value * scale.factor), &scale.unit)),
        _ => "–".to_owned(),
    }
}

fn group(place: usize, run: &RunAgainst, reference: &str) -> PlotGroup {
    let curves = &run.curves;
    let mut panels: Vec<Panel> = Vec::new();
    let known = |values: &[f64]| values.iter().map(|value| Some(*value)).collect::<Vec<_>>();
    if !curves.force_time_s.is_empty() {
        let both = pair(known(&curves.force_n), curves.force_reference_n.clone(), 1.0);
        panels.push(panel("force in N", FORCE_HEIGHT_PX, &curves.force_time_s, both, 0.0));
    }
    if !curves.pose_time_s.is_empty() {
        let both = pair(known(&curves.position_m), curves.position_reference_m.clone(), MM_PER_M);
        panels.push(panel("position beyond first contact in mm", FORCE_HEIGHT_PX, &curves.pose_time_s, both, 0.0));
    }
    PlotGroup {
        id: format!("run-{}", place + 1),
        title: format!("{} and {reference}", run.file),
        note: "Each counts time from its own first contact; nothing else is shifted, and nothing is scaled.".to_owned(),
        panels,
        contact: Some((0.0, curves.contact_s)),
    }
}

fn pair(here: Vec<Option<f64>>, there: Vec<Option<f64>>, factor: f64) -> Vec<Curve> {
    let scaled = |values: Vec<Option<f64>>| values.into_iter().map(|value| value.map(|value| value * factor)).collect();
    vec![
        Curve { label: "this recording".to_owned(), role: Role::Measured, y: scaled(here), dashed: false },
        Curve { label: "reference".to_owned(), role: Role::Earlier, y: scaled(there), dashed: true },
    ]
}
