//! The page of a comparison: limits with value and margin first, then software and blocks, then what gates nothing.

use super::super::page::{Heat, HeatRow, Page, Section, Table, Tone};
use super::compared;
use super::maps::channel_of_key;
use super::quantities::grades;
use super::table::{numbers, row, table, words};
use super::words::{HOLD, Scale, counted, figures, joined, key, listed, number, value, value_with_sd};
use crate::compare::{
    Agreement, Block, CompareVerdict, Comparison, Fitted, LimitResult, Outcome, SessionComparison, Shift, Verdict,
};
use crate::diagnose::quality::Phase;

/// More sentences than these are a list, and stand in a table.
const SENTENCES_MAX: usize = 6;
/// A heat map per recording, up to this many recordings.
const MAPS_MAX: usize = 4;

/// The page of a comparison. `command` makes it again.
pub fn comparison(comparison: &Comparison, command: &str, provenance: &[(String, String)]) -> Page {
    let shown = compared::shown(comparison);
    let tables = [limits, more_findings, misfits, shifts, quantities, errors, fitted, sessions];
    let mut all_provenance = provenance.to_vec();
    all_provenance.push(("noise floor".to_owned(), noise(comparison)));
    all_provenance.push(("answer format".to_owned(), comparison.schema.to_string()));
    Page {
        title: format!("Model {} against {}", comparison.model, counted(comparison.sessions.len(), "recording")),
        tone: tone(comparison.verdict),
        verdict: verdict(comparison),
        sentences: comparison.findings.iter().take(SENTENCES_MAX).cloned().collect(),
        command: command.to_owned(),
        heat: maps(comparison),
        plots: compared::plots(&shown),
        loops: compared::loops(&shown),
        charts: Vec::new(),
        tables: tables.iter().filter_map(|of| of(comparison)).collect(),
        ladder: None,
        provenance: all_provenance,
    }
}

fn tone(verdict: CompareVerdict) -> Tone {
    match verdict {
        CompareVerdict::InsideNoise | CompareVerdict::Pass => Tone::Good,
        CompareVerdict::CannotSay | CompareVerdict::Undecided => Tone::Warning,
        CompareVerdict::Outside | CompareVerdict::Fail => Tone::Bad,
    }
}

fn verdict(comparison: &Comparison) -> String {
    let held = |outcome: Outcome| comparison.limits.iter().filter(|limit| limit.outcome == outcome).count();
    let all = counted(comparison.limits.len(), "limit");
    match comparison.verdict {
        CompareVerdict::InsideNoise => "inside the noise: software closes, every block is at its noise".to_owned(),
        CompareVerdict::Outside => format!("outside the noise: {}", listed(&outside(comparison), "and")),
        CompareVerdict::CannotSay if !is_judged(comparison) => {
            "cannot say: too much is missing in a recording to judge the software".to_owned()
        }
        CompareVerdict::CannotSay => "cannot say: the noise is not known".to_owned(),
        CompareVerdict::Pass => format!("pass: {all} held, uncertainty included"),
        CompareVerdict::Fail => format!("fail: {} of {all} exceeded, uncertainty included", held(Outcome::Fail)),
        CompareVerdict::Undecided if held(Outcome::Undecided) == 0 && !is_judged(comparison) => {
            "undecided: too much is missing in a recording to judge the software".to_owned()
        }
        CompareVerdict::Undecided if held(Outcome::Undecided) == 0 => {
            "undecided: the software block does not close".to_owned()
        }
        CompareVerdict::Undecided => format!("undecided: {} of {all} within the uncertainty", held(Outcome::Undecided)),
    }
}

fn is_judged(comparison: &Comparison) -> bool {
    comparison.sessions.iter().all(|session| session.software.is_judged())
}

/// What is outside, each named once.
fn outside(comparison: &Comparison) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    if comparison.sessions.iter().any(|session| !session.software.closes()) {
        names.push("software block".to_owned());
    }
    let blocks = comparison.sessions.iter().flat_map(|session| &session.blocks);
    for block in blocks.filter(|block| block.verdict == Verdict::Outside) {
        let name = format!("{} block", block.block.split(':').next().unwrap_or(&block.block));
        if !names.contains(&name) {
            names.push(name);
        }
    }
    if names.is_empty() { vec!["see the recordings".to_owned()] } else { names }
}

fn judged(verdict: Verdict) -> (Tone, &'static str) {
    match verdict {
        Verdict::InsideNoise => (Tone::Good, "inside"),
        Verdict::CannotSay => (Tone::Warning, "cannot say"),
        Verdict::Outside => (Tone::Bad, "outside"),
    }
}

fn limits(comparison: &Comparison) -> Option<Table> {
    let rows = comparison.limits.iter().map(|limit| {
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
            difference(limit.value, limit.uncertainty, &scale),
            margin(limit, &scale),
            outcome.to_owned(),
        ];
        row(Some(tone), cells)
    });
    let columns = vec![
        words("recording"),
        words("quantity"),
        numbers("limit"),
        numbers("value ± 2u"),
        numbers("margin"),
        words("outcome"),
    ];
    let note = "Value: root mean square of a channel in contact and 20 ms on either side, or absolute difference of a quantity. \
                Margin: limit minus value. Pass: margin of at least 2u; fail: exceeded by more than 2u; undecided between.";
    table(Section::Verdict, "Limits", note, columns, rows.collect())
}

fn margin(limit: &LimitResult, scale: &Scale) -> String {
    limit.value.map_or_else(dash, |value| scale.figures(limit.limit - value, 2))
}

fn difference(value: Option<f64>, uncertainty: Option<f64>, scale: &Scale) -> String {
    match (value, uncertainty) {
        (Some(value), Some(uncertainty)) => scale.with_sd(value, uncertainty),
        (Some(value), None) => format!("{}, uncertainty unknown", scale.figures(value, 3)),
        (None, _) => "not found".to_owned(),
    }
}

fn dash() -> String {
    "–".to_owned()
}

fn more_findings(comparison: &Comparison) -> Option<Table> {
    let rows = comparison.findings.iter().skip(SENTENCES_MAX).map(|finding| row(None, vec![finding.clone()]));
    table(Section::Verdict, "More findings", "", vec![words("finding")], rows.collect())
}

fn maps(comparison: &Comparison) -> Vec<Heat> {
    let mut maps: Vec<Heat> = Vec::new();
    maps.extend(map("all recordings", &comparison.heat));
    let count = comparison.sessions.len();
    if (2..=MAPS_MAX).contains(&count) {
        maps.extend(comparison.sessions.iter().filter_map(|session| map(&session.file, &session.heat)));
    }
    maps
}

fn map(title: &str, rows: &[crate::compare::HeatRow]) -> Option<Heat> {
    let occurs = |phase: &Phase| rows.iter().any(|row| row.cells.iter().any(|cell| cell.phase == *phase));
    let phases: Vec<Phase> = Phase::ALL.into_iter().filter(occurs).collect();
    let row = |row: &crate::compare::HeatRow| HeatRow {
        label: channel_of_key(&row.channel),
        cells: phases
            .iter()
            .map(|phase| row.cells.iter().find(|cell| cell.phase == *phase).map(|c| c.misfit))
            .collect(),
    };
    let least = rows.iter().flat_map(|row| row.cells.iter().map(|cell| cell.blocks)).filter(|n| *n > 0).min();
    let note = least.map_or_else(String::new, |least| {
        let scatter = figures(1.0 / libm::sqrt(2.0 * least as f64), 1);
        format!("noise alone reads 1 ±{HOLD}{scatter} in the smallest cell, of {}", counted(least, "block"))
    });
    (!phases.is_empty()).then(|| Heat {
        title: title.to_owned(),
        note,
        columns: phases.iter().map(|phase| phase.name().to_owned()).collect(),
        rows: rows.iter().map(row).collect(),
        unit: "times noise".to_owned(),
    })
}

fn misfits(comparison: &Comparison) -> Option<Table> {
    let rows = each_block(comparison).map(|(session, block)| {
        let (tone, verdict) = judged(block.verdict);
        let phases: Vec<String> = block.phases_outside.iter().map(|phase| phase.name().to_owned()).collect();
        let cells = vec![
            session.file.clone(),
            block.block.clone(),
            block.misfit.map_or_else(dash, |misfit| figures(misfit, 3)),
            figures(block.misfit_limit, 3),
            block.misfit.map_or_else(dash, |misfit| figures(block.misfit_limit - misfit, 2)),
            if phases.is_empty() { dash() } else { listed(&phases, "and") },
            verdict.to_owned(),
        ];
        row(Some(tone), cells)
    });
    let columns = vec![
        words("recording"),
        words("block"),
        numbers("misfit, times noise"),
        numbers("limit, times noise"),
        numbers("margin"),
        words("phases outside"),
        words("verdict"),
    ];
    let note = "Inputs of each block clamped to the recording. Misfit: root mean square of means over 40 ms, over their noise. \
                Limit: what noise alone would not exceed.";
    table(Section::WhereItFails, "Blocks against their noise", note, columns, rows.collect())
}

fn errors(comparison: &Comparison) -> Option<Table> {
    let rows = each_block(comparison).map(|(session, block)| {
        let scale = Scale::of(&block.unit, block.rms.max(block.rms_unfitted));
        let floor = if block.noise_floor > 0.0 { scale.figures(block.noise_floor, 3) } else { "not known".to_owned() };
        let contact = match block.rms_contact {
            None => dash(),
            rms => difference(rms, block.rms_contact_uncertainty, &scale),
        };
        let cells = vec![
            session.file.clone(),
            channel_of_key(&block.channel),
            scale.figures(block.rms_unfitted, 3),
            scale.figures(block.rms, 3),
            floor,
            contact,
            block.agreement.as_ref().map_or_else(dash, agreement),
        ];
        row(None, cells)
    });
    let columns = vec![
        words("recording"),
        words("channel"),
        numbers("nothing fitted"),
        numbers("fitted of this recording"),
        numbers("noise floor"),
        numbers("fitted, in contact ± 2u"),
        numbers("fit; magnitude, phase error"),
    ];
    let note = "Root mean square of the residual. Fitted: see ‘Fitted of each recording’. Fit, over contact: nothing left would be a \
                hundred, below zero is worse than a constant. Magnitude and phase error by Sprague and Geers.";
    table(Section::Quantities, "Error of the blocks", note, columns, rows.collect())
}

/// Fit, magnitude and phase error. Noise alone keeps a fit below a hundred, and rounding must not put it there.
fn agreement(of: &Agreement) -> String {
    let fit = match of.fit_percent {
        fit if fit > 99.9 => "above 99.9".to_owned(),
        fit => figures(fit, 3),
    };
    let errors = [of.magnitude_percent, of.phase_percent].map(|percent| joined(&figures(percent, 2), "%"));
    format!("{}; {}", joined(&fit, "%"), errors.join(", "))
}

fn each_block(comparison: &Comparison) -> impl Iterator<Item = (&SessionComparison, &Block)> {
    comparison.sessions.iter().flat_map(|session| session.blocks.iter().map(move |block| (session, block)))
}

fn quantities(comparison: &Comparison) -> Option<Table> {
    let all = comparison.sessions.iter().flat_map(|session| session.quantities.iter().map(move |q| (session, q)));
    let rows = all.map(|(session, quantity)| {
        // A quantity gates nothing, so that it is never marked as a failure.
        let (tone, verdict) = match judged(quantity.verdict) {
            (Tone::Bad, verdict) => (Tone::Warning, verdict),
            judged => judged,
        };
        let size = quantity.measured.unwrap_or(0.0).abs().max(quantity.model.unwrap_or(0.0).abs());
        let scale = Scale::of(&quantity.unit, size);
        let own = |value: Option<f64>| value.map_or_else(|| "not found".to_owned(), |value| scale.figures(value, 3));
        let u = [quantity.u_data, quantity.u_input, quantity.u_numerical].map(|u| figures(u * scale.factor, 2));
        let cells = vec![
            session.file.clone(),
            key(&quantity.name).0,
            own(quantity.measured),
            own(quantity.model),
            difference(quantity.difference, quantity.uncertainty, &scale),
            joined(&u.join(", "), &scale.unit),
            verdict.to_owned(),
        ];
        row(Some(tone), cells)
    });
    let columns = vec![
        words("recording"),
        words("quantity"),
        numbers("measured"),
        numbers("free runs, mean"),
        numbers("difference ± 2u"),
        numbers("u: data, input, numerical"),
        words("against 2u"),
    ];
    let note = "Free runs against the recording; shown, and gating nothing unless a limit is set. Difference: model minus \
                measured; u² is the sum of the squares of the three. Inside: not to be told from measurement error.";
    table(Section::Quantities, "Quantities of interest", note, columns, rows.collect())
}

fn shifts(comparison: &Comparison) -> Option<Table> {
    let of = |session: &SessionComparison, channel: &str, shift: &Option<Shift>| {
        let shift = shift.as_ref()?;
        let direction = if shift.shift_ms > 0.0 { "measured later" } else { "measured earlier" };
        let cells = vec![
            session.file.clone(),
            channel.to_owned(),
            value_with_sd(shift.shift_ms * 1e-3, 2.0 * shift.sd_ms * 1e-3, "s"),
            direction.to_owned(),
            joined(&figures(100.0 * shift.share_of_excess, 2), "%"),
        ];
        Some(row(shift.finding.then_some(Tone::Warning), cells))
    };
    let both = |session: &SessionComparison| {
        [of(session, "force", &session.shift_force), of(session, "reported position", &session.shift_pose)]
    };
    let rows = comparison.sessions.iter().flat_map(both).flatten();
    let columns = vec![
        words("recording"),
        words("channel"),
        numbers("shift ± 2 sd"),
        words("direction"),
        numbers("share of the excess"),
    ];
    let note = "The shift in time that would fit best. Reported, applied nowhere. Marked: larger than its uncertainty and worth it.";
    table(Section::WhereItFails, "Shift in time", note, columns, rows.collect())
}

fn fitted(comparison: &Comparison) -> Option<Table> {
    let row_of = |session: &SessionComparison, fitted: &Fitted| {
        let declared = fitted.declared.filter(|declared| *declared > 0.0);
        let cells = vec![
            session.file.clone(),
            fitted.name.clone(),
            value(fitted.value, &fitted.unit),
            declared.map_or_else(|| "free".to_owned(), |declared| value(declared, &fitted.unit)),
            declared.map_or_else(dash, |declared| figures((fitted.value / declared).abs(), 2)),
        ];
        row(None, cells)
    };
    let of =
        |session: &SessionComparison| -> Vec<_> { session.fitted.iter().map(|one| row_of(session, one)).collect() };
    let rows = comparison.sessions.iter().flat_map(of);
    let columns = vec![
        words("recording"),
        words("what"),
        numbers("fitted"),
        numbers("declared, one sd"),
        numbers("over declared"),
    ];
    let note = "Each recording fits these for itself, with the declared repeatability as their prior. A ratio of 0 changes nothing.";
    table(Section::Quantities, "Fitted of each recording", note, columns, rows.collect())
}

fn sessions(comparison: &Comparison) -> Option<Table> {
    let rows = comparison.sessions.iter().map(|session| {
        let (tone, verdict) = judged(session.verdict);
        let free_runs = session
            .free_run
            .as_ref()
            .map_or_else(dash, |free_run| format!("{} ran, {} diverged", free_run.samples, free_run.diverged));
        let cells = vec![
            session.file.clone(),
            session.kind.id().to_owned(),
            format!("{:?}", session.grade),
            session.software_sentence.clone(),
            free_runs,
            verdict.to_owned(),
        ];
        row(Some(tone), cells)
    });
    let columns = vec![
        words("recording"),
        words("kind"),
        words("grade"),
        words("software block"),
        words("free runs"),
        words("verdict"),
    ];
    let note = format!(
        "Grades: {}. Software block: recorded force in, command out; what closes to rounding is our own software as the model \
         describes it.",
        grades(comparison.sessions.iter().map(|session| session.grade))
    );
    table(Section::Quantities, "Recordings", note, columns, rows.collect())
}

fn noise(comparison: &Comparison) -> String {
    let source = if comparison.noise.learned { "learned from a recording at rest" } else { "as the model declares it" };
    let force = value(comparison.noise.force_floor_n, "N");
    let position = value(comparison.noise.position_floor_m, "m");
    format!("force {force}, position {position} (one standard deviation), {source}")
}
