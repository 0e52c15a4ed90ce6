//! What is missing: what was found, what ties with it, how it was ranked, and what could not be seen.

use super::super::axis::fixed;
use super::super::page::{Row, Section, Table, Tone};
use super::table::{numbers, row, table, words};
use super::words::{counted, figures, key, listed, number, parameter_unit, value, value_with_sd};
use crate::diagnose::answer::{Diagnosis, Estimate, Group, Rank};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::collections::BTreeMap;

/// Rows of a ranking; the rest is in the JSON answer.
const RANKS_MAX: usize = 10;
/// A gain this large stands for certainty: no number of it is worth reading.
const GAIN_SHOWN_MAX: f64 = 1e6;

/// All tables of this section.
pub(super) fn tables(answer: &Diagnosis, catalog: &Catalog<Axis>) -> Vec<Table> {
    let mut tables: Vec<Table> = Vec::new();
    tables.extend(found(answer, catalog));
    tables.extend(ties(answer));
    tables.extend(rankings(answer));
    tables.extend(not_visible(answer, catalog));
    tables
}

fn learning_count(answer: &Diagnosis) -> usize {
    answer.sessions.iter().filter(|session| session.role == "learn").count()
}

fn found(answer: &Diagnosis, catalog: &Catalog<Axis>) -> Option<Table> {
    let rows = answer.groups.iter().map(|group| {
        let about = group.effects.first().and_then(|id| catalog.get(id)).map_or("", |kind| kind.about.as_ref());
        row(
            None,
            vec![
                listed(&group.effects, "or"),
                about.to_owned(),
                parameters(&group.parameters, catalog),
                gain(group.held_out_gain),
                wins(answer, group),
                group.reason.clone(),
            ],
        )
    });
    let columns = vec![
        words("effect"),
        words("what it is"),
        words("size ± standard deviation"),
        numbers("held-out gain"),
        numbers("gains in"),
        words("why"),
    ];
    let note = format!(
        "Each learning recording was left out in turn ({}). Held-out gain: by how much twice the log density of the left-out \
         recordings rises with the effect. Effects joined by ‘or’ tell these recordings equally well; size and gain are those \
         of the first.",
        counted(learning_count(answer), "recording")
    );
    table(Section::Missing, "What was found", note, columns, rows.collect())
}

fn parameters(effects: &BTreeMap<String, BTreeMap<String, Estimate>>, catalog: &Catalog<Axis>) -> String {
    let one = |effect: &String, parameter: &String, estimate: &Estimate| {
        let unit = parameter_unit(catalog, effect, parameter);
        let held = if estimate.sd.abs() > 0.0 { "" } else { " (not fitted)" };
        format!("{} {}{held}", key(parameter).0, value_with_sd(estimate.value, estimate.sd, &unit))
    };
    let all = effects.iter().flat_map(|(effect, values)| values.iter().map(move |(name, e)| one(effect, name, e)));
    all.collect::<Vec<String>>().join("; ")
}

/// A gain in −2 ln p; a tenth of it means nothing any more.
fn gain(gain: f64) -> String {
    match gain.abs() {
        size if !gain.is_finite() || size >= GAIN_SHOWN_MAX => "above 1e6".to_owned(),
        size if size < 100.0 => fixed(gain, 1),
        size if size < 1000.0 => fixed(gain, 0),
        _ => figures(gain, 4),
    }
}

/// In how many left-out recordings the best effect of a group gained, when it was accepted.
fn wins(answer: &Diagnosis, group: &Group) -> String {
    let accepted = |rank: &&Rank| rank.accepted && group.effects.first() == Some(&rank.effect);
    let rank = answer.ranking.iter().find(accepted);
    rank.map_or_else(|| "–".to_owned(), |rank| format!("{} of {}", rank.wins, rank.of))
}

fn ties(answer: &Diagnosis) -> Option<Table> {
    let rows = answer.groups.iter().filter(|group| !group.splitting_experiment.is_empty()).map(|group| {
        let sets: Vec<String> = group.alternatives.iter().map(|set| set.join(" + ")).collect();
        let is_tied = sets.len() > 1 || group.effects.len() > 1;
        let tied = if is_tied { listed(&sets, "or") } else { format!("{} alone", listed(&group.effects, "or")) };
        row(is_tied.then_some(Tone::Warning), vec![tied, group.splitting_experiment.clone()])
    });
    let note = "A marked row is a tie: these recordings cannot tell its alternatives apart. The experiment would.";
    let columns = vec![words("what these recordings allow"), words("deciding experiment")];
    table(Section::Missing, "Ties and deciding experiments", note, columns, rows.collect())
}

fn rankings(answer: &Diagnosis) -> Vec<Table> {
    let mut steps: BTreeMap<usize, Vec<&Rank>> = BTreeMap::new();
    for rank in &answer.ranking {
        steps.entry(rank.step).or_default().push(rank);
    }
    steps.into_iter().filter_map(|(step, ranks)| ranking(step, ranks)).collect()
}

fn ranking(step: usize, mut ranks: Vec<&Rank>) -> Option<Table> {
    ranks.sort_by(|a, b| b.accepted.cmp(&a.accepted).then(b.gain.total_cmp(&a.gain)));
    let left = ranks.len().saturating_sub(RANKS_MAX);
    let rows = ranks.iter().take(RANKS_MAX).map(|rank| {
        let cells = vec![
            rank.effect.clone(),
            gain(rank.gain),
            rank.held_out_gain.map_or_else(|| "–".to_owned(), gain),
            rank.held_out_gain.map_or_else(|| "–".to_owned(), |_| format!("{} of {}", rank.wins, rank.of)),
            if rank.accepted { "added" } else { "not added" }.to_owned(),
        ];
        row(rank.accepted.then_some(Tone::Good), cells)
    });
    let mut note = "Gains in −2 ln p. A dash: the fit gained too little to be tried on left-out recordings.".to_owned();
    if left > 0 {
        note.push_str(&format!(" {} with a smaller gain: see the JSON answer.", counted(left, "more effect")));
    }
    let columns = vec![
        words("effect"),
        numbers("gain of the fit"),
        numbers("held-out gain"),
        numbers("gains in"),
        words("decision"),
    ];
    table(Section::Missing, &format!("Ranking, step {step}"), note, columns, rows.collect())
}

fn not_visible(answer: &Diagnosis, catalog: &Catalog<Axis>) -> Option<Table> {
    let rows = answer.not_visible_below.iter().flat_map(|(effect, sizes)| {
        let about = catalog.get(effect).map_or("", |kind| kind.about.as_ref());
        sizes.iter().map(move |(name, size)| unseen(effect, about, name, *size, catalog))
    });
    let note = "Not found does not mean absent: an effect of this size or smaller would have passed unnoticed in these recordings, \
                and nothing is claimed of it. For a frequency it is the other way round: one above the value would have passed.";
    let columns = vec![words("effect"), words("what it is"), words("parameter"), words("could not be seen")];
    table(Section::Missing, "Could not be seen below", note, columns, rows.collect())
}

fn unseen(effect: &str, about: &str, name: &str, size: f64, catalog: &Catalog<Axis>) -> Row {
    let unit = parameter_unit(catalog, effect, name);
    let param = catalog.get(effect).and_then(|kind| kind.params.iter().find(|param| param.name == name));
    let rounded = libm::round(size / step(size)) * step(size);
    let limit = match param {
        Some(param) if param.unit == "Hz" => format!("above {}", value(rounded, &unit)),
        // The search measures sizes from the value at which the effect does nothing.
        Some(param) if param.off.abs() > 0.0 => {
            format!("within {} of {}", value(rounded, &unit), number(param.off))
        }
        _ => format!("below {}", value(rounded, &unit)),
    };
    row(None, vec![effect.to_owned(), about.to_owned(), key(name).0, limit])
}

/// A limit of visibility is an estimate: two digits.
fn step(size: f64) -> f64 {
    let size = size.abs();
    if size > 0.0 && size.is_finite() { libm::pow(10.0, libm::floor(libm::log10(size)) - 1.0) } else { 1.0 }
}
