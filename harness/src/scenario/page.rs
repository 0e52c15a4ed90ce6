//! The page of a run: verdicts first, then what was seen, then what it was made from.

use super::run::Ran;
use crate::report::story::words::{Scale, counted};
use crate::report::{Column, Curve, Page, Panel, PlotGroup, Role, Row, Section, Table, Tone};
use sim_core::criterion::{Outcome, Verdict};

/// Digits of a value, a limit and a margin.
const DIGITS: i32 = 4;
pub(crate) const MM_PER_M: f64 = 1e3;
const PANEL_HEIGHT_PX: u32 = 220;

/// Columns of a heading: words to the left, numbers to the right.
pub(crate) fn columns(words: &[&str], numbers: &[&str]) -> Vec<Column> {
    let column = |label: &&str, align_right| Column { label: (*label).to_owned(), align_right };
    let words = words.iter().map(|label| column(label, false));
    words.chain(numbers.iter().map(|label| column(label, true))).collect()
}

/// A curve without gaps.
pub(crate) fn curve(label: &str, role: Role, y: impl Iterator<Item = f64>) -> Curve {
    Curve { label: label.to_owned(), role, y: y.map(Some).collect(), dashed: false }
}

/// A panel over time.
pub(crate) fn panel(label: &str, time_s: Vec<f64>, curves: Vec<Curve>) -> Panel {
    Panel {
        y_label: label.to_owned(),
        x_label: "time in s".to_owned(),
        height_px: PANEL_HEIGHT_PX,
        x: time_s,
        curves,
        band: None,
    }
}

/// How an outcome is marked.
pub(crate) fn tone(outcome: Outcome) -> Tone {
    match outcome {
        Outcome::Pass => Tone::Good,
        Outcome::Undecided => Tone::Warning,
        Outcome::Fail => Tone::Bad,
    }
}

fn word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Pass => "pass",
        Outcome::Undecided => "undecided",
        Outcome::Fail => "fail",
    }
}

/// The verdicts, one line each; and how each value was had.
pub(crate) fn verdict_tables(verdicts: &[Verdict]) -> Vec<Table> {
    if verdicts.is_empty() {
        return Vec::new();
    }
    let line = |(nth, verdict): (usize, &Verdict)| {
        let size = [verdict.value, verdict.limit].into_iter().flatten().fold(0.0, |size: f64, v| size.max(v.abs()));
        let scale = Scale::of(verdict.unit, size);
        let text = |value: Option<f64>| value.map_or("-".to_owned(), |value| scale.figures(value, DIGITS));
        let cells = vec![
            format!("{}", nth + 1),
            verdict.criterion.clone(),
            word(verdict.outcome).to_owned(),
            text(verdict.value),
            text(verdict.uncertainty),
            // A smallest value and a largest one look alike.
            verdict.bound.map_or_else(String::new, |bound| format!("{} ", bound.words())) + &text(verdict.limit),
            text(verdict.margin),
        ];
        Row { cells, tone: Some(tone(verdict.outcome)) }
    };
    let why = |(nth, verdict): (usize, &Verdict)| {
        let at = verdict.at.map_or("-".to_owned(), |at| format!("{:.3} s", at.seconds()));
        Row { cells: vec![format!("{}", nth + 1), at, verdict.why.clone()], tone: None }
    };
    vec![
        Table {
            title: "Criteria".to_owned(),
            note:
                "A margin is positive on the good side. Undecided: it is below the uncertainty (2 standard deviations)."
                    .to_owned(),
            columns: columns(&["", "criterion", "verdict"], &["value", "±", "limit", "margin"]),
            rows: verdicts.iter().enumerate().map(line).collect(),
            section: Section::Verdict,
        },
        Table {
            title: "How each was had".to_owned(),
            note: String::new(),
            columns: columns(&["", "at", "what"], &[]),
            rows: verdicts.iter().enumerate().map(why).collect(),
            section: Section::Quantities,
        },
    ]
}

/// The last line: how many criteria held.
pub(crate) fn summary(verdicts: &[Verdict]) -> String {
    let count = |outcome: Outcome| verdicts.iter().filter(|verdict| verdict.outcome == outcome).count();
    let (failed, undecided) = (count(Outcome::Fail), count(Outcome::Undecided));
    let all = || counted(verdicts.len(), "criterion").replace("criterions", "criteria");
    match (verdicts.len(), failed, undecided) {
        (0, ..) => "pass: it ran, and nothing was asked of it".to_owned(),
        (_, 0, 0) => format!("pass: {} held", all()),
        (_, 0, undecided) => format!("undecided: {undecided} of {}", all()),
        (_, failed, 0) => format!("fail: {failed} of {}", all()),
        (_, failed, undecided) => format!("fail: {failed} of {}, {undecided} undecided", all()),
    }
}

/// The page of a run. `command` makes it again; `files` are what was written.
pub fn page(ran: &Ran, command: &str, files: &[(String, String)]) -> Page {
    let (scenario, verdicts) = (&ran.scenario, ran.verdicts.as_slice());
    let mut sentences: Vec<String> = scenario.about.split('\n').map(str::trim).map(str::to_owned).collect();
    sentences.retain(|sentence| !sentence.is_empty());
    sentences.push(match ran.contact_s {
        Some((first_s, last_s)) => format!("The interfaces first touch at {first_s:.3} s and last at {last_s:.3} s."),
        None => "The interfaces never touch.".to_owned(),
    });
    sentences.extend(ran.faults.iter().map(|fault| format!("Put in: {fault}.")));
    if let Some(at_s) = ran.ran_away_s {
        sentences.push(format!("The run ends at {at_s:.3} s: a pose left the hall, the loop ran away."));
    }
    let [scenario_sha256, model_sha256] = &ran.sha256;
    let mut provenance = vec![
        ("program".to_owned(), format!("dockhil {}", env!("CARGO_PKG_VERSION"))),
        (format!("scenario {}", scenario.name), format!("sha256 {scenario_sha256}")),
        (format!("model {}", ran.model), format!("sha256 {model_sha256}")),
        ("seed".to_owned(), scenario.seed.to_string()),
        ("fingerprint".to_owned(), ran.fingerprint.clone()),
    ];
    provenance.extend_from_slice(files);
    Page {
        title: format!("Scenario {}", scenario.name),
        tone: tone(super::judge::outcome(verdicts)),
        verdict: summary(verdicts),
        sentences,
        command: command.to_owned(),
        heat: Vec::new(),
        plots: ran.plots.clone(),
        charts: Vec::new(),
        loops: ran.loops.clone(),
        tables: verdict_tables(verdicts),
        ladder: None,
        provenance,
    }
}

/// Panels over the time of a run.
pub(crate) fn over_time(title: &str, panels: Vec<Panel>, contact: Option<(f64, f64)>) -> PlotGroup {
    let note = "Forces resist when positive; positions are penetrations of the nominal contact plane.".to_owned();
    PlotGroup { id: "run".to_owned(), title: title.to_owned(), note, panels, contact }
}
