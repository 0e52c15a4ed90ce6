//! The page of a diagnosis: the answer first, then what carries it.

use super::super::page::{Page, Tone};
use super::words::{counted, listed};
use super::{ladder, maps, missing, quantities, signals};
use crate::diagnose::answer::{BaseParameter, Curves, Diagnosis, Group, Ladder, Verdict};
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// The verdict names this many other effects of a tie; the table names all.
const TIES_MAX: usize = 2;

/// The page of a diagnosis. `command` makes it again; `catalog` gives units and meanings.
pub fn diagnosis(
    answer: &Diagnosis,
    curves: &[Curves],
    ladder: Option<&Ladder>,
    catalog: &Catalog<Axis>,
    command: &str,
    provenance: &[(String, String)],
) -> Page {
    let shown = signals::shown(curves, &answer.noise);
    let mut tables = missing::tables(answer, catalog);
    let ladder = ladder.filter(|ladder| !ladder.sessions.is_empty());
    tables.extend(ladder.map(ladder::tables).unwrap_or_default());
    tables.extend(quantities::tables(answer));
    Page {
        title: title(answer, provenance),
        tone: tone(answer.verdict),
        verdict: verdict(answer),
        sentences: answer.sentences.clone(),
        command: command.to_owned(),
        heat: maps::maps(answer, &found(answer)),
        plots: signals::plots(&shown, &answer.noise),
        loops: signals::loops(&shown),
        charts: Vec::new(),
        tables,
        ladder: ladder.map(ladder::drawn),
        provenance: all_provenance(answer, provenance),
    }
}

fn tone(verdict: Verdict) -> Tone {
    match verdict {
        Verdict::NothingMissing | Verdict::Explained | Verdict::WrongParameter => Tone::Good,
        Verdict::Undecided | Verdict::PartlyExplained | Verdict::VariesBetweenSessions => Tone::Warning,
        Verdict::NoneOfThese | Verdict::RecordingDefect => Tone::Bad,
    }
}

fn title(answer: &Diagnosis, provenance: &[(String, String)]) -> String {
    let count = |role: &str| answer.sessions.iter().filter(|session| session.role == role).count();
    let (learned, tested) = (count("learn"), count("test"));
    let title = title_with_model("Diagnosis", provenance);
    format!("{title}: {} learned from, {} tested on", counted(learned, "recording"), tested)
}

/// `Diagnosis of nominal.toml`, if the provenance names a model.
pub(super) fn title_with_model(what: &str, provenance: &[(String, String)]) -> String {
    let model = provenance.iter().find(|(key, _)| key == "model").map(|(_, value)| value);
    model.map_or_else(|| what.to_owned(), |model| format!("{what} of {model}"))
}

/// What was found, most important first; ties in brackets.
fn found(answer: &Diagnosis) -> String {
    answer.groups.iter().map(names).collect::<Vec<String>>().join(" + ")
}

fn names(group: &Group) -> String {
    let Some((best, tied)) = group.effects.split_first() else {
        return "something without a name".to_owned();
    };
    let mut names: Vec<String> = tied.iter().take(TIES_MAX).cloned().collect();
    let more = tied.len().saturating_sub(TIES_MAX);
    if more > 0 {
        names.push(counted(more, "other"));
    }
    if names.is_empty() { best.clone() } else { format!("{best} (or {})", listed(&names, "or")) }
}

fn verdict(answer: &Diagnosis) -> String {
    let found = found(answer);
    match answer.verdict {
        Verdict::NothingMissing => "nothing missing: the model reaches the noise of these recordings".to_owned(),
        Verdict::Explained => match &wrong(answer)[..] {
            [] => format!("explained: {found}"),
            wrong => format!("explained: {found}, with a wrong {}", listed(wrong, "and")),
        },
        Verdict::PartlyExplained => format!("partly explained: {found}, and something else is left"),
        Verdict::NoneOfThese => {
            "none of these: something is missing that no effect of the catalogue explains".to_owned()
        }
        Verdict::WrongParameter => format!("wrong parameter: {}", listed(&wrong(answer), "and")),
        Verdict::VariesBetweenSessions => format!("varies between recordings: {}", listed(&varying(answer), "and")),
        Verdict::RecordingDefect => format!("recording defect: {}", listed(&odd(answer), "and")),
        Verdict::Undecided => "undecided: these recordings cannot answer".to_owned(),
    }
}

fn wrong(answer: &Diagnosis) -> Vec<String> {
    let wrong = answer.base_parameters.iter().filter(|(_, base)| base.wrong);
    let named = |(key, base): (&String, &BaseParameter)| {
        let name = super::words::key(key).0;
        if base.looks_like.is_empty() { name } else { format!("{name} (or {})", base.looks_like.join(" or ")) }
    };
    wrong.map(named).collect()
}

/// Scatter that was found above what is declared.
fn varying(answer: &Diagnosis) -> Vec<String> {
    let names = ["force offset", "stiffness", "damping"].into_iter().zip(&answer.scatter);
    let names: Vec<String> =
        names.filter(|(_, [declared, found])| found > declared).map(|(n, _)| n.to_owned()).collect();
    if names.is_empty() { vec!["more than is declared".to_owned()] } else { names }
}

fn odd(answer: &Diagnosis) -> Vec<String> {
    let odd: Vec<String> =
        answer.sessions.iter().filter(|session| session.odd).map(|session| session.file.clone()).collect();
    if odd.is_empty() { vec!["see the notes of the recordings".to_owned()] } else { odd }
}

/// What the caller says, the noise, and the hash of every recording that it did not name.
fn all_provenance(answer: &Diagnosis, provenance: &[(String, String)]) -> Vec<(String, String)> {
    let mut all = provenance.to_vec();
    let source = if answer.noise.learned { "learned from a recording at rest" } else { "as the model declares it" };
    let force = super::words::value(answer.noise.force_floor_n, "N");
    let position = super::words::value(answer.noise.position_floor_m, "m");
    all.push((
        "noise floor".to_owned(),
        format!("force {force}, position {position} (one standard deviation), {source}"),
    ));
    for session in &answer.sessions {
        let is_named = provenance.iter().any(|(_, value)| value.contains(&session.sha256));
        if !is_named && !session.sha256.is_empty() {
            all.push((session.file.clone(), format!("sha256 {}", session.sha256)));
        }
    }
    all.push(("answer format".to_owned(), answer.schema.to_string()));
    all
}
