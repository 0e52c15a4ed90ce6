//! The diagnosis of a drive: a known force in, the reported position out, with no contact and no satellites.
//!
//! The error of a free-running position is no noise: it is the model's own, and its samples hang together. So its size is taken
//! from the best model so far, samples closer than a quarter of a second count once, and what is left out together is a whole
//! recording. With a single learning recording its five blocks are left out instead; they are not independent, and an effect
//! that they prefer is named only if the error also falls on the test recording.

use super::answer::{BaseParameter, Cell, Curves, Diagnosis, Estimate, Group, Rank, SessionNote, TestScore, Verdict};
use super::fit::{fit, held, own_nuisance};
use super::noise::Noise;
use super::problem::{Knob, Problem, Scratch, Trial, effective_sigma_m};
use super::quality::{Channel, Phase};
use super::score::{self, Errors};
use super::search::{Found, Search, Tried};
use super::{Outcome, Request, verdict};
use crate::case::Case;
use crate::error::Error;
use crate::model::Model;
use sim_core::effect::{Catalog, Kind};
use sim_core::space::Axis;
use std::collections::BTreeMap;

/// Blocks that a single recording is cut into.
pub(super) const BLOCKS: usize = 5;
/// An effect is confirmed if it lowers the error on the test recording at least by this share.
const CONFIRMED: f64 = 0.02;

/// Noise of a problem that has none: only the size of its residuals.
pub(super) fn noise(sigma_m: f64) -> Noise {
    Noise {
        slow_memory: 0.0,
        average: 0.0,
        innovation_n: 1.0,
        force_floor_n: 0.0,
        position_floor_m: sigma_m,
        learned: false,
        excess: 0.0,
    }
}

/// The catalogue with everything fixed that a model need not name: an error of millimetres says nothing of such details.
fn without_fine_points(catalog: &Catalog<Axis>) -> Catalog<Axis> {
    let fixed = |kind: &Kind<Axis>| {
        let mut kind = kind.clone();
        kind.params.iter_mut().filter(|param| param.default.is_some()).for_each(|param| param.discrete = true);
        kind
    };
    Catalog::of(catalog.kinds().iter().map(fixed).collect())
}

/// A problem whose residuals have about unit size under this trial.
fn problem(model: &Model, cases: &[Case], blocks: usize, trial: &Trial) -> Problem {
    let mut problem = Problem::drive(model, cases, blocks, noise(1.0));
    let runs: Vec<usize> = (0..problem.runs.len()).collect();
    let fitted = fit(&problem, trial, &runs, None, &mut Scratch::default());
    let rms_m = rms_of(&problem, &fitted.trial, &fitted.nuisances);
    problem.noise = noise(effective_sigma_m(rms_m, model.timing.loop_period_s));
    problem
}

fn rms_of(problem: &Problem, trial: &Trial, nuisances: &[super::problem::Nuisance]) -> f64 {
    let mut scratch = Scratch::default();
    let squares = (0..problem.runs.len()).flat_map(|run| problem.residuals(run, trial, &nuisances[run], &mut scratch));
    score::together(squares) * problem.noise.position_floor_m
}

/// Root mean square of the position on whole recordings, free-running from where they are seen to start; nothing is fitted.
pub(super) fn errors(model: &Model, cases: &[Case], trial: &Trial) -> Vec<Errors> {
    let problem = Problem::drive_whole(model, cases, noise(1e-3));
    let fit = held(&problem, trial);
    let mut scratch = Scratch::default();
    let of = |run: usize| {
        let own = own_nuisance(&problem, &fit, run, &mut scratch);
        let residuals = problem.residuals(run, trial, &own, &mut scratch);
        Errors { force_n: 0.0, position_m: score::together(residuals.into_iter()) * 1e-3 }
    };
    (0..cases.len()).map(of).collect()
}

pub(super) fn diagnose(request: &Request<'_>) -> Result<Outcome, Error> {
    let on_clock = |sessions: &[crate::recording::Session]| -> Result<Vec<Case>, Error> {
        sessions.iter().map(|session| Case::of(session, request.model)).collect()
    };
    let (learn, test) = (on_clock(request.learn)?, on_clock(request.test)?);
    let model = request.model;
    let blocks = BLOCKS;
    let catalog = without_fine_points(request.catalog);
    let start = Trial { base: crate::blocks::Base::of(model), effects: model.chosen(request.catalog) };
    let given = start.effects.len();

    let mut trial = start.clone();
    let mut steps: Vec<(String, Trial)> = Vec::new();
    let mut rejected: Vec<String> = Vec::new();
    let mut last: Option<(Problem, Found)> = None;
    let mut rankings: Vec<Vec<super::search::Ranked>> = Vec::new();
    let mut worth = BTreeMap::new();
    let mut ties = BTreeMap::new();
    let mut misfit = [0.0; 2];
    for round in 0..request.rules.effects_max {
        let scaled = problem(model, &learn, blocks, &trial);
        let rules = super::search::Rules { effects_max: 1, ..request.rules };
        let folds = (0..learn.len()).flat_map(|case| {
            let runs: Vec<usize> = (case * blocks..(case + 1) * blocks).collect();
            if learn.len() == 1 { runs.into_iter().map(|run| vec![run]).collect() } else { vec![runs] }
        });
        let excluded: Vec<&str> = rejected.iter().map(String::as_str).collect();
        let search = Search::new(&scaled, &catalog, &excluded, rules, request.progress).with_folds(folds.collect());
        let found = search.run(&trial);
        if round == 0 {
            steps.push(("nominal".into(), found.base.fit.trial.clone()));
            misfit[0] = rms_of(&scaled, &found.base.fit.trial, &found.base.fit.nuisances);
        }
        rankings.extend(found.rankings.iter().cloned());
        let added =
            found.best.fit.trial.effects.last().filter(|_| found.best.fit.trial.effects.len() > trial.effects.len());
        let Some(added) = added.map(|chosen| chosen.kind.id.to_string()) else {
            last = Some((scaled, found));
            break;
        };
        let of = |trial: &Trial| score::together(errors(model, &test, trial).iter().map(|errors| errors.position_m));
        let (before, after) = (of(&found.base.fit.trial), of(&found.best.fit.trial));
        if learn.len() == 1 && after > (1.0 - CONFIRMED) * before {
            rejected.push(added);
            last = Some((scaled, Found { best: found.base.clone(), ..found }));
            continue;
        }
        worth.extend(found.worth.clone());
        ties.extend(found.ties.clone());
        trial = found.best.fit.trial.clone();
        steps.push((format!("+ {added}"), trial.clone()));
        last = Some((scaled, found));
    }
    let (scaled, found) =
        last.ok_or_else(|| Error::new("the search had no round").help("raise the number of effects"))?;
    let best: &Tried = &found.best;
    misfit[1] = rms_of(&scaled, &best.fit.trial, &best.fit.nuisances);
    let scored: Vec<(String, Vec<Errors>)> =
        steps.iter().map(|(label, trial)| (label.clone(), errors(model, &test, trial))).collect();
    let floor_m = misfit[1];
    let ladder = score::ladder(
        &scored,
        Errors { force_n: 0.0, position_m: 0.0 },
        test.iter().map(|case| case.name.clone()).collect(),
    );
    let ends = [scored.first(), scored.last()];
    let [before, after] =
        ends.map(|end| score::together(end.iter().flat_map(|(_, errors)| errors.iter().map(|e| e.position_m))));
    let score = TestScore { before, after, noise_floor: 0.0, unit: "m" };
    let groups = groups(request, best, given, &ties, &worth);
    let named: Vec<String> = groups.iter().map(|group| group.effects[0].clone()).collect();
    let verdict = if named.is_empty() { Verdict::NothingMissing } else { Verdict::Explained };
    let mut sentences = vec![if named.is_empty() {
        "No effect of the catalogue lowers the error on recordings that a fit has not seen.".to_string()
    } else {
        format!(
            "Missing is an effect of the type {}; it lowers the error on recordings that a fit has not seen.",
            named.join(" and ")
        )
    }];
    sentences.extend(
        rejected
            .iter()
            .map(|id| format!("{id} improves blocks of the learning recording, but not the test recording: rejected.")),
    );
    sentences.push(format!(
        "On the test recordings the position goes from {:.2} to {:.2} mm, free-running.",
        before * 1e3,
        after * 1e3
    ));
    sentences.push(format!("What is left on the learning recordings, {:.2} mm, is the model's own error, not noise: no floor is known for a drive.", floor_m * 1e3));
    let deviations = best.fit.deviations();
    let base = |knob: Knob, nominal: f64| {
        let at = best.fit.knobs.iter().position(|other| *other == knob);
        let sd = at.map_or(f64::MAX, |at| deviations[at].min(f64::MAX));
        BaseParameter { nominal, fitted: best.fit.trial.get(&knob), sd, wrong: false, looks_like: Vec::new() }
    };
    let diagnosis = Diagnosis {
        schema: 1,
        verdict,
        sentences,
        groups,
        base_parameters: BTreeMap::from([
            ("mass_kg".to_string(), base(Knob::Mass, model.plant.mass_kg)),
            ("damping_n_s_per_m".to_string(), base(Knob::Damping, model.contact.damping_n_s_per_m)),
            ("offset_n".to_string(), base(Knob::Offset, model.contact.offset_n)),
        ]),
        not_visible_below: BTreeMap::new(),
        sessions: notes(request, &learn, &test),
        misfit_before: misfit[0] / floor_m,
        misfit_after: 1.0,
        test: BTreeMap::from([("measured_z_m", score)]),
        map: vec![Cell {
            phase: Phase::FreeFlight,
            channel: Channel::Position,
            before: misfit[0] / floor_m,
            after: 1.0,
            blocks: scaled.runs.len(),
        }],
        ranking: ranks(&rankings),
        noise: scaled.noise,
        scatter: [[0.0; 2]; 3],
    };
    let nominal = &steps[0].1;
    let curves = learn.iter().map(|case| (case, "learn")).chain(test.iter().map(|case| (case, "test")));
    let curves = curves.map(|(case, role)| curves_of(model, case, role, nominal, &best.fit.trial)).collect();
    let found = best.fit.trial.effects[given..].to_vec();
    Ok(Outcome { diagnosis, curves, ladder, found, base: best.fit.trial.base })
}

fn groups(
    request: &Request<'_>,
    best: &Tried,
    given: usize,
    ties: &BTreeMap<String, Vec<String>>,
    worth: &BTreeMap<String, f64>,
) -> Vec<Group> {
    let group = |(e, chosen): (usize, &crate::model::Chosen)| {
        let id = chosen.kind.id.to_string();
        let effects = ties.get(&id).cloned().unwrap_or_else(|| vec![id.clone()]);
        let alternatives: Vec<Vec<String>> = effects.iter().map(|effect| vec![effect.clone()]).collect();
        let estimate = |(p, param): (usize, &sim_core::effect::Param)| {
            let sd = best.fit.estimate(&Knob::Effect(e, p)).map_or(0.0, |(_, sd)| sd);
            (param.name.to_string(), Estimate { value: chosen.values[p], sd })
        };
        let parameters = BTreeMap::from([(id.clone(), chosen.kind.params.iter().enumerate().map(estimate).collect())]);
        Group {
            parameters,
            held_out_gain: worth.get(&id).copied().unwrap_or(0.0),
            reason: verdict::reason(chosen),
            splitting_experiment: verdict::splitting(&effects, &alternatives, request.catalog),
            effects,
            alternatives,
        }
    };
    best.fit.trial.effects.iter().enumerate().skip(given).map(group).collect()
}

fn ranks(rankings: &[Vec<super::search::Ranked>]) -> Vec<Rank> {
    let rows = rankings.iter().enumerate().flat_map(|(step, rows)| rows.iter().map(move |row| (step + 1, row)));
    rows.map(|(step, row)| Rank {
        step,
        effect: row.id.clone(),
        gain: row.gain,
        held_out_gain: (!row.gains.is_empty()).then(|| row.gains.iter().sum()),
        wins: row.gains.iter().filter(|gain| **gain > 0.0).count(),
        of: row.gains.len(),
        accepted: row.accepted,
    })
    .collect()
}

fn notes(request: &Request<'_>, learn: &[Case], test: &[Case]) -> Vec<SessionNote> {
    let all = request.learn.iter().zip(learn).map(|(session, case)| (session, case, "learn"));
    let all = all.chain(request.test.iter().zip(test).map(|(session, case)| (session, case, "test")));
    all.map(|(session, case, role)| SessionNote {
        file: case.name.clone(),
        role,
        kind: session.kind,
        grade: session.grade,
        sha256: session.sha256.clone(),
        odd: false,
        notes: session.findings.iter().map(|finding| format!("{}: {}", finding.topic, finding.what)).collect(),
        software: None,
        nuisance: None,
    })
    .collect()
}

fn curves_of(model: &Model, case: &Case, role: &'static str, before: &Trial, after: &Trial) -> Curves {
    let problem = Problem::drive_whole(model, std::slice::from_ref(case), noise(1e-3));
    let mut scratch = Scratch::default();
    let mut position = |trial: &Trial| -> Vec<f64> {
        let own = own_nuisance(&problem, &held(&problem, trial), 0, &mut scratch);
        let residuals = problem.residuals(0, trial, &own, &mut scratch);
        case.measured_m.value.iter().zip(residuals).map(|(measured, residual)| measured - residual * 1e-3).collect()
    };
    Curves {
        file: case.name.clone(),
        role,
        contact_s: None,
        sensor_time_s: Vec::new(),
        force_measured_n: Vec::new(),
        force_before_n: Vec::new(),
        force_after_n: Vec::new(),
        depth_m: Vec::new(),
        loop_time_s: (0..case.measured_m.value.len()).map(|tick| case.loop_time_s(tick)).collect(),
        position_measured_m: case.measured_m.value.clone(),
        position_before_m: position(before),
        position_after_m: position(after),
    }
}
