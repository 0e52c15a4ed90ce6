//! From evidence to a word and its sentences. A confident wrong name is the worst failure: every doubt has its own word.

use super::answer::{BaseParameter, TestScore, Verdict};
use super::examine::{Examined, Shared};
use super::fit::Fit;
use super::problem::{Knob, Problem};
use super::quality::{Block, remainder};
use super::random::Decoded;
use super::search::Found;
use crate::model::{Chosen, Model};
use crate::recording::{Grade, Session};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::collections::BTreeMap;

/// Scatter between sessions above this multiple of the declared one is a change, not scatter.
const SCATTER_MAX: f64 = 2.5;
/// A session further from the others than this, in declared standard deviations, is odd.
const ODD: f64 = 4.0;
/// Error on the test recordings over the noise floor, above which they contradict what was learned: as much again as the noise itself.
const TEST_MAX: f64 = 1.5;
/// A base value is wrong beyond this many standard deviations and this many declared repeatabilities.
const WRONG_SD: f64 = 3.0;
const WRONG_REPEATABILITY: f64 = 2.0;
/// The effect of a force sensor that reads too much or too little by a factor, and the factors that it may have.
const SCALE_OF_FORCE: &str = "force-scale";
const SCALES: std::ops::RangeInclusive<f64> = 0.1..=10.0;

/// Everything that a verdict rests on.
pub struct Evidence<'a> {
    /// The recordings that took part.
    pub problem: &'a Problem,
    /// What was found.
    pub found: &'a Found,
    /// How many effects were in the model before.
    pub given: usize,
    /// A random effect, if one was decoded.
    pub decoded: Option<&'a Decoded>,
    /// Residual blocks with what was found.
    pub after: &'a [Vec<Block>],
    /// Base values.
    pub base: &'a BTreeMap<String, BaseParameter>,
}

impl Evidence<'_> {
    fn names(&self) -> Vec<String> {
        let group = |chosen: &Chosen| {
            let id = chosen.kind.id.to_string();
            self.found.ties.get(&id).map_or(id, |group| group.join(" or "))
        };
        let fitted = self.found.best.fit.trial.effects[self.given..].iter().map(group);
        fitted.chain(self.decoded.map(|decoded| decoded.chosen.kind.id.to_string())).collect()
    }

    /// Where something is left, with its misfit.
    pub fn remainder(&self) -> Option<(String, f64)> {
        remainder(self.problem, self.after)
    }

    /// Which nuisance scatters too much, by how much (relative to the declared).
    pub fn varies(&self) -> Option<(&'static str, f64)> {
        let fit = &self.found.best.fit;
        let names = ["force offset", "stiffness", "damping"];
        let ratio = |j: usize| {
            let (sum, n) = (0..self.problem.runs.len())
                .filter(|&run| j < self.problem.runs[run].nuisances)
                .fold((0.0, 0.0), |(sum, n), run| (sum + fit.nuisances[run][j] * fit.nuisances[run][j], n + 1.0));
            if n > 0.0 { libm::sqrt(sum / n) / self.problem.declared[j] } else { 0.0 }
        };
        // The damping of single runs takes what the form of a found effect leaves: it is a change only where nothing was found.
        let counted = if self.names().is_empty() { 3 } else { 2 };
        let worst = (0..counted).map(|j| (names[j], ratio(j))).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let odd = odd_runs(fit, self.problem.runs.len(), counted).first().map(|(_, _)| worst);
        if worst.1 > SCATTER_MAX { Some(worst) } else { odd }
    }
}

/// Runs that differ from the others by more than the declared repeatability allows, and why; `counted` nuisances are looked at.
pub fn odd_runs(fit: &Fit, runs: usize, counted: usize) -> Vec<(usize, String)> {
    let declared = fit.declared;
    let words = ["force offset", "stiffness", "damping"];
    let mut odd = Vec::new();
    for run in 0..runs {
        for j in 0..counted {
            let mut others: Vec<f64> =
                (0..runs).filter(|&other| other != run).map(|other| fit.nuisances[other][j]).collect();
            others.sort_by(f64::total_cmp);
            let middle = others.get(others.len() / 2).copied().unwrap_or(0.0);
            let away = fit.nuisances[run][j] - middle;
            if away.abs() > ODD * declared[j] {
                let size =
                    if j == 0 { format!("{away:+.3} N") } else { format!("{:+.1} %", 100.0 * (libm::exp(away) - 1.0)) };
                odd.push((run, format!("its {} differs from the others' by {size}", words[j])));
                break;
            }
        }
    }
    odd
}

/// The word.
pub fn decide(evidence: &Evidence<'_>, examined: &[Examined], shared: &Shared) -> Verdict {
    let impacts = evidence.problem.runs.iter().filter(|run| run.case.is_impact()).count();
    if shared.convention.is_some() || examined.iter().any(|one| one.defect.is_some()) {
        Verdict::RecordingDefect
    } else if impacts < 2 {
        Verdict::Undecided
    } else if evidence.varies().is_some() && evidence.remainder().is_none() {
        // Scatter that leaves a rest behind is no change from session to session: it is what the model lacks.
        Verdict::VariesBetweenSessions
    } else {
        let base_wrong = evidence.base.values().any(|base| base.wrong);
        match (evidence.names().is_empty(), evidence.remainder().is_some()) {
            (true, true) => Verdict::NoneOfThese,
            (true, false) if base_wrong => Verdict::WrongParameter,
            (true, false) => Verdict::NothingMissing,
            (false, true) => Verdict::PartlyExplained,
            (false, false) => Verdict::Explained,
        }
    }
}

/// An answer that the test recordings contradict is none.
pub fn after_test(verdict: Verdict, test: &BTreeMap<&'static str, TestScore>) -> Verdict {
    if verdict.answers() && contradicted(test) { Verdict::Undecided } else { verdict }
}

fn contradicted(test: &BTreeMap<&'static str, TestScore>) -> bool {
    test.values().any(|score| score.noise_floor > 0.0 && score.after > TEST_MAX * score.noise_floor)
}

/// Base values: nominal, fitted, and whether they are wrong.
pub fn base_parameters(model: &Model, fit: &Fit, mass_kg: f64) -> BTreeMap<String, BaseParameter> {
    let mut all = of_contact(model, fit);
    let nominal = model.plant.mass_kg;
    let wrong = (mass_kg / nominal - 1.0).abs() > 1e-6;
    let mass = BaseParameter { nominal, fitted: mass_kg, sd: 0.0, wrong, looks_like: Vec::new() };
    all.insert("reduced_mass_kg".into(), mass);
    all
}

/// Whether a fit needs values of the contact that the model denies.
pub fn denies_model(model: &Model, fit: &Fit) -> bool {
    of_contact(model, fit).values().any(|base| base.wrong)
}

fn of_contact(model: &Model, fit: &Fit) -> BTreeMap<String, BaseParameter> {
    let (contact, repeat) = (&model.contact, &model.repeatability);
    let rows = [
        ("stiffness_n_per_m", Knob::Stiffness, contact.stiffness_n_per_m, repeat.stiffness_ratio),
        ("damping_n_s_per_m", Knob::Damping, contact.damping_n_s_per_m, repeat.damping_ratio),
    ];
    let judged = |fitted: f64, sd: f64, nominal: f64, ratio: f64| {
        let away = (fitted - nominal).abs();
        away > WRONG_SD * sd && away > WRONG_REPEATABILITY * ratio * nominal
    };
    let mut all = BTreeMap::new();
    for (name, knob, nominal, ratio) in &rows {
        let Some((fitted, sd)) = fit.estimate(knob) else { continue };
        let wrong = judged(fitted, sd, *nominal, *ratio);
        let base = BaseParameter { nominal: *nominal, fitted, sd, wrong, looks_like: Vec::new() };
        all.insert((*name).to_owned(), base);
    }
    // A sensor that reads too much by a factor makes all of the contact stiffer and more damped by it.
    let factor = all.get("stiffness_n_per_m").filter(|base| base.wrong).map(|base| base.fitted / base.nominal);
    let damping = rows[1].2;
    let scaled = |factor: f64| {
        let estimate = fit.estimate(&Knob::Damping);
        estimate.is_none_or(|(fitted, sd)| !judged(fitted, sd, damping * factor, rows[1].3))
    };
    if let (Some(base), Some(factor)) = (all.get_mut("stiffness_n_per_m"), factor)
        && SCALES.contains(&factor)
        && scaled(factor)
    {
        base.looks_like.push(SCALE_OF_FORCE.to_owned());
    }
    all
}

/// Why an effect is named.
pub fn reason(chosen: &Chosen) -> String {
    let kind = &chosen.kind;
    let at_limit = kind
        .params
        .iter()
        .zip(&chosen.values)
        .filter(|(param, value)| !param.discrete && (**value <= param.lower || **value >= param.upper));
    let limits: Vec<String> =
        at_limit.map(|(param, _)| format!("{} is at its limit, which is no estimate", param.name)).collect();
    let warning = if limits.is_empty() { String::new() } else { format!(" ({})", limits.join("; ")) };
    format!("{}: {}{warning}", kind.about, kind.fingerprint)
}

/// The experiment that would split a tie, or isolate a lone effect.
pub fn splitting(effects: &[String], alternatives: &[Vec<String>], catalog: &Catalog<Axis>) -> String {
    let experiment = |id: &String| catalog.get(id).map(|kind| kind.experiment.to_string());
    let sets = alternatives.iter().any(|set| set.len() > 1);
    let named: Vec<String> = effects.iter().take(if sets { 1 } else { 2 }).filter_map(experiment).collect();
    match (effects.len(), sets) {
        (1, false) => format!("nothing needs to be split; to see it alone: {}", named.join("; ")),
        _ => named.join("; "),
    }
}

/// The answer in sentences.
pub fn sentences(
    verdict: Verdict,
    evidence: &Evidence<'_>,
    examined: &[Examined],
    shared: &Shared,
    sessions: &[&Session],
    test: &BTreeMap<&'static str, TestScore>,
) -> Vec<String> {
    let mut out = vec![headline(verdict, evidence)];
    if evidence.problem.runs.iter().filter(|run| run.case.is_impact()).count() < 2 {
        out.push("Fewer than two sound impacts are left: nothing could be left out and told by the others.".into());
    }
    if contradicted(test) {
        out.push("The test recordings stay above their noise: they were made on another rig or in another state, or they hold more than the others show.".into());
    }
    out.extend(shared.convention.clone());
    for (one, session) in examined.iter().zip(sessions) {
        let name = session.file.file_name().unwrap_or_default().to_string_lossy();
        out.extend(one.defect.iter().map(|defect| format!("{name} is left out: {defect}.")));
    }
    for session in sessions.iter().filter(|session| session.grade != Grade::A) {
        let name = session.file.file_name().unwrap_or_default().to_string_lossy();
        out.push(format!("{name} is of grade {:?}: {}.", session.grade, session.grade.about()));
    }
    let noise = &evidence.problem.noise;
    if noise.excess > 0.0 {
        out.push(format!(
            "At rest the force scatters {:.2} times as much as declared: the declared noise was used.",
            noise.excess
        ));
    }
    if let Some((what, ratio)) = evidence.varies().filter(|_| evidence.remainder().is_none()) {
        out.push(format!("The {what} changes between sessions by {ratio:.1} times the declared repeatability."));
    }
    if let Some((place, q)) = evidence.remainder() {
        out.push(format!("The rest is largest in {place}: {:.2} times the noise.", libm::sqrt(q)));
    }
    for (name, base) in evidence.base.iter().filter(|(_, base)| base.wrong) {
        out.push(format!("{name} is {:.6}, not {:.6} (sd {:.2e}).", base.fitted, base.nominal, base.sd));
        for id in &base.looks_like {
            out.push(if id == SCALE_OF_FORCE {
                let factor = base.fitted / base.nominal;
                format!("Impacts cannot tell this from a sensor that reads {factor:.3} times the force ({id}): hang a known weight on it.")
            } else {
                format!("These recordings tell {id} as well, with {name} as the model has it.")
            });
        }
    }
    for (channel, score) in test {
        let (name, factor, unit) = match *channel {
            "force_z_n" => ("the force along the axis", 1.0, "N"),
            _ => ("the reported position", 1e6, "µm"),
        };
        let [before, after, floor] = [score.before, score.after, score.noise_floor].map(|value| value * factor);
        out.push(format!(
            "On the test recordings the error of {name} goes from {before:.3} to {after:.3} {unit}; the noise floor is {floor:.3} {unit}."
        ));
    }
    out
}

fn headline(verdict: Verdict, evidence: &Evidence<'_>) -> String {
    let names = evidence.names().join(" and ");
    match verdict {
        Verdict::NothingMissing => {
            "Nothing is missing that these recordings could show; the sizes that would have been seen are listed."
                .into()
        }
        Verdict::Explained => format!("Missing is an effect of the type {names}; with it the model reaches the noise."),
        Verdict::PartlyExplained => format!(
            "Missing is an effect of the type {names}, and something else that no effect of the catalogue explains."
        ),
        Verdict::NoneOfThese => "Something is missing, and no effect of the catalogue explains it.".into(),
        Verdict::WrongParameter => "No effect is missing: a base value is wrong.".into(),
        Verdict::VariesBetweenSessions => {
            "Something changes from session to session; one model cannot describe them all.".into()
        }
        Verdict::RecordingDefect => {
            "A recording is not what it says it is; settle that before any physics is blamed.".into()
        }
        Verdict::Undecided => "These recordings cannot answer.".into(),
    }
}
