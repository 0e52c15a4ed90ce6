//! The page of a replay: criteria, then what changed, stream by stream.

use super::{Clamp, First, Replayed, Request, Stream};
use crate::recording::Grade;
use crate::report::story::words::{Scale, counted};
use crate::report::{Page, PlotGroup, Role, Row, Section, Table, Tone};
use crate::scenario::page::{columns, curve, panel, summary, tone, verdict_tables};
use sim_core::criterion::Verdict;

const DIGITS: i32 = 4;
const MM_PER_M: f64 = 1e3;

/// The page of a replay. `command` makes it again; `provenance` says of what and with what.
pub fn page(
    request: &Request<'_>,
    replayed: &Replayed,
    verdicts: &[Verdict],
    command: &str,
    provenance: &[(String, String)],
) -> Page {
    let mut tables = verdict_tables(verdicts);
    tables.push(changes(replayed));
    tables.extend(by_faults(replayed));
    let diverged = replayed.diverged(request);
    let name = request.session.file.file_name().unwrap_or_default().to_string_lossy();
    Page {
        title: format!("{name} through model {}", request.model.name),
        tone: if diverged.is_some() { Tone::Bad } else { tone(crate::scenario::judge::outcome(verdicts)) },
        verdict: if diverged.is_some() {
            "diverged: it must be the same, and is not".to_owned()
        } else {
            format!("{}{}", summary(verdicts), graded(request))
        },
        sentences: sentences(request, replayed),
        command: command.to_owned(),
        heat: Vec::new(),
        plots: vec![signals(request, replayed)],
        charts: Vec::new(),
        loops: Vec::new(),
        tables,
        ladder: None,
        provenance: provenance.to_vec(),
    }
}

/// The grade of a recording that is not whole.
fn graded(request: &Request<'_>) -> String {
    match request.session.grade {
        Grade::A => String::new(),
        grade => format!(" (grade {grade:?})"),
    }
}

fn sentences(request: &Request<'_>, replayed: &Replayed) -> Vec<String> {
    let clamped = match request.clamp {
        Clamp::Nothing => "Nothing is clamped: the satellites react.",
        Clamp::Commanded => "The command is clamped to the recording: robot, contact and sensor react.",
        Clamp::Achieved => "The pose is clamped to the recording: contact and sensor react.",
        Clamp::Sensed => "The force is clamped to the recording: the satellites react, our own software alone.",
    };
    let session = request.session;
    let mut all = vec![clamped.to_owned()];
    if session.grade != Grade::A {
        all.insert(0, format!("The recording has grade {:?}: {}.", session.grade, session.grade.about()));
    }
    if let Some(earlier) = request.earlier {
        let faults = if earlier.faults.is_empty() { "no faults" } else { earlier.faults.as_str() };
        all.insert(0, format!("The recording is itself a replay: clamp {}, put in: {faults}.", earlier.clamp));
    }
    all.extend(request.faults.iter().map(|fault| format!("Put in: {}.", fault.words())));
    let unused: Vec<String> = request
        .model
        .chosen(request.catalog)
        .iter()
        .filter(|chosen| request.clamp.silences_effect(chosen))
        .map(|chosen| chosen.kind.id.to_string())
        .collect();
    if !unused.is_empty() {
        all.push(format!("Of the model's effects these lie before the clamp and take no part: {}.", unused.join(", ")));
    }
    all.push(match (request.own, request.clamp, request.seed) {
        (Some(_), Clamp::Nothing, _) => {
            "Start, seed and noise are those of the run that made the recording.".to_owned()
        }
        (_, _, Some(seed)) => format!("The sensor's noise is drawn anew, seed {seed}."),
        _ => "No noise is drawn: differences below the noise of the recording mean nothing.".to_owned(),
    });
    if let Some(at_s) = replayed.made.ran_away_s {
        all.push(format!("The replay ends at {at_s:.3} s: a pose left the hall, the loop ran away."));
    }
    all.push(match replayed.first() {
        Some((stream, first)) => format!("First difference from the recording: {}.", told(stream, &first)),
        None => "Nothing differs from the recording by more than rounding or noise.".to_owned(),
    });
    all
}

/// One number that changed, in words.
pub(crate) fn told(stream: &Stream, first: &First) -> String {
    format!(
        "{}, sample {} at {:.4} s: {}, changed by {}",
        stream.topic,
        first.sample,
        first.time_s,
        Scale::of(stream.unit, first.old).figures(first.old, DIGITS),
        change(stream, first)
    )
}

/// By how much a number changed, with its sign.
fn change(stream: &Stream, first: &First) -> String {
    let change = first.new - first.old;
    let sign = if change > 0.0 { "+" } else { "" };
    format!("{sign}{}", Scale::of(stream.unit, change).figures(change, DIGITS))
}

fn changes(replayed: &Replayed) -> Table {
    let row = |stream: &Stream| {
        let of = |value: f64| Scale::of(stream.unit, value).figures(value, DIGITS);
        let dash = || "-".to_owned();
        let cells = vec![
            stream.topic.clone(),
            if stream.made { "model" } else { "recording" }.to_owned(),
            stream.first.map_or_else(dash, |first| format!("{}, {:.3} s", first.sample, first.time_s)),
            stream.first.map_or_else(dash, |first| of(first.old)),
            stream.first.map_or_else(dash, |first| change(stream, &first)),
            if stream.made { of(stream.rms) } else { dash() },
            if stream.made { of(stream.largest) } else { dash() },
            format!("{} of {}", stream.kept, stream.samples),
        ];
        Row { cells, tone: None }
    };
    Table {
        title: "Against the recording".to_owned(),
        note: "First: the first sample that differs by more than rounding (what our software makes) or four standard \
               deviations of the declared noise (what a sensor tells). Kept: messages whose bytes are those of the recording."
            .to_owned(),
        columns: columns(&["topic", "by", "first"], &["value", "change", "rms", "largest", "kept"]),
        rows: replayed.streams.iter().map(row).collect(),
        section: Section::WhereItFails,
    }
}

fn by_faults(replayed: &Replayed) -> Option<Table> {
    replayed.plain.as_ref()?;
    let row = |stream: &Stream| {
        let first = stream.first_by_faults?;
        let of = |value: f64| Scale::of(stream.unit, value).figures(value, DIGITS);
        let cells = vec![
            stream.topic.clone(),
            format!("{}, {:.4} s", first.sample, first.time_s),
            of(first.old),
            change(stream, &first),
        ];
        Some(Row { cells, tone: None })
    };
    let rows: Vec<Row> = replayed.streams.iter().filter_map(row).collect();
    (!rows.is_empty()).then(|| Table {
        title: "Against the same replay without the faults".to_owned(),
        note: "The first sample of which a bit differs.".to_owned(),
        columns: columns(&["topic", "first"], &["value", "change"]),
        rows,
        section: Section::WhereItFails,
    })
}

fn signals(request: &Request<'_>, replayed: &Replayed) -> PlotGroup {
    let (case, made) = (&replayed.case, &replayed.made);
    let sensor_s: Vec<f64> = (0..case.sensed_n.value.len()).map(|tick| case.sensor_time_s(tick)).collect();
    let loop_s: Vec<f64> = (0..case.commanded.len()).map(|tick| case.loop_time_s(tick)).collect();
    let bias_n = request.model.sensor.bias_n;
    // A replay that ran away is shorter than its recording: nothing is drawn where there is nothing.
    let padded = |values: &[f64], length: usize, factor: f64, offset: f64| -> Vec<f64> {
        (0..length).map(|tick| values.get(tick).map_or(f64::NAN, |value| offset + factor * value)).collect()
    };
    let force = vec![
        curve("recorded", Role::Measured, padded(&case.sensed_n.value, sensor_s.len(), -1.0, bias_n).into_iter()),
        curve("replayed", Role::Model, padded(&made.sensed_n, sensor_s.len(), -1.0, bias_n).into_iter()),
    ];
    let recorded_m: Vec<f64> = case.commanded.iter().map(|motion| motion.position_m).collect();
    let path = vec![
        curve("recorded", Role::Measured, padded(&recorded_m, loop_s.len(), MM_PER_M, 0.0).into_iter()),
        curve("replayed", Role::Model, padded(&made.commanded_m, loop_s.len(), MM_PER_M, 0.0).into_iter()),
    ];
    PlotGroup {
        id: "replay".to_owned(),
        title: request.session.file.display().to_string(),
        note: "Forces resist when positive; positions are penetrations of the nominal contact plane.".to_owned(),
        panels: vec![panel("force in N", sensor_s, force), panel("commanded position in mm", loop_s, path)],
        contact: None,
    }
}

/// 'Three messages of 4000'.
pub(crate) fn copied(copied: crate::recording::Copied) -> String {
    format!("{} of {} replaced", copied.replaced, counted(copied.messages, "message"))
}
