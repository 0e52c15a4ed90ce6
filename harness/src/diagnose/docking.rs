//! The diagnosis of a docking cell.

use super::answer::{Cell, Diagnosis, Estimate, Group, Rank, SessionNote, TestScore};
use super::examine::{self, Examined, Shared};
use super::noise::{Noise, trend};
use super::problem::{Knob, Nuisance, Problem, Scratch, Trial};
use super::quality::{self, Block, Channel, Phase};
use super::random::{Decoded, decode, with_packets};
use super::score::{self, Errors};
use super::search::{Found, Rules, Search};
use super::settle;
use super::verdict::{self, Evidence};
use super::{Outcome, Request};
use crate::blocks::{Base, RANDOM};
use crate::case::Case;
use crate::error::Error;
use crate::model::Chosen;
use crate::recording::{Kind, Session};
use std::collections::BTreeMap;

/// Found by the software block alone, exactly.
const CLOCK: &str = "clock-offset";
/// Speed above which the reported pose tells how late it is: over a whole recording, the middle of it. Chosen.
const MOVES_M_PER_S: f64 = 0.005;
/// Share of a tick from which on a link is slower and not only uneven. Chosen.
const LATE: f64 = 0.2;
/// Reading above which the interfaces touch: far above noise, offset and dead band.
const TOUCH_N: f64 = 1.5;

/// Everything that is known before the search.
struct Prepared<'a> {
    sessions: Vec<&'a Session>,
    roles: Vec<&'static str>,
    cases: Vec<Case>,
    examined: Vec<Examined>,
    shared: Shared,
    noise: Noise,
    /// Recordings that take part.
    used: Vec<usize>,
}

pub(super) fn diagnose(request: &Request<'_>) -> Result<Outcome, Error> {
    let prepared = prepare(request)?;
    let used: Vec<Case> = prepared.used.iter().map(|&i| prepared.cases[i].clone()).collect();
    let start = start(request, &prepared.shared);
    let mut problem = with_packets(Problem::docking(request.model, used, prepared.noise), &start);
    let (found, decoded) = search(request, prepared.shared.convention.is_some(), &mut problem, &start);
    conclude(request, &prepared, &problem, &found, decoded.as_ref())
}

fn prepare<'a>(request: &Request<'a>) -> Result<Prepared<'a>, Error> {
    (request.progress)("reading the clocks and examining the software block");
    let sessions: Vec<&Session> = request.learn.iter().chain(request.aux).collect();
    let roles = (0..sessions.len()).map(|i| if i < request.learn.len() { "learn" } else { "aux" }).collect();
    let given = request.model.chosen(request.catalog);
    let cases = settle::cases(sessions.iter().copied(), request.model, &given)?;
    // Along any axis: a stream whose axes are exchanged is a finding, not an error.
    let touches = |channel: &crate::case::Channel| {
        let quiet = channel.value.iter().take(20).sum::<f64>() / channel.value.len().clamp(1, 20) as f64;
        channel.known_values().any(|reading_n| (reading_n - quiet).abs() > TOUCH_N)
    };
    let impacts = || cases.iter().filter(|case| case.is_impact());
    if !impacts().any(|case| touches(&case.sensed_n) || case.across_n.iter().any(touches)) {
        let impact = cases.iter().position(Case::is_impact).unwrap_or(0);
        let what =
            format!("there is no contact in any impact recording: the force never moves by more than {TOUCH_N} N");
        return Err(Error::new(what)
            .file(&sessions[impact].file)
            .place("force along the axis of travel")
            .help("check that the map names the right axis and unit, and that the probe reached the nozzle (z > 0)"));
    }
    let delay = kind_at(request, "command-delay")?;
    let (examined, shared) = examine::all(request.model, &sessions, &cases, &given, &delay);
    let noise = Noise::learn(&cases, request.model);
    let sound = |i: &usize| examined[*i].defect.is_none();
    let used: Vec<usize> = (0..cases.len()).filter(sound).collect();
    Ok(Prepared { sessions, roles, cases, examined, shared, noise, used })
}

fn kind_at(request: &Request<'_>, id: &str) -> Result<Chosen, Error> {
    let kind = request.catalog.get(id).ok_or_else(|| Error::new(format!("the catalogue lacks {id}")))?;
    Ok(Chosen::at_start(kind))
}

/// The model as given; an offset between the clocks that the software block found exactly is in it, and not fitted.
fn start(request: &Request<'_>, shared: &Shared) -> Trial {
    let mut effects = request.model.chosen(request.catalog);
    if let Some(kind) = request.catalog.get(CLOCK).filter(|_| shared.clock_offset_s != 0.0) {
        let mut kind = kind.clone();
        kind.params[0].discrete = true;
        effects.push(Chosen { kind, values: vec![shared.clock_offset_s] });
    }
    Trial { base: Base::of(request.model), effects }
}

/// Searches; where the reported pose keeps a remainder, decodes losses or jitter and searches again.
fn search(request: &Request<'_>, mislabelled: bool, problem: &mut Problem, start: &Trial) -> (Found, Option<Decoded>) {
    let excluded: Vec<&str> = RANDOM.iter().copied().chain([CLOCK]).collect();
    // A stream that carries something else than it says proves nothing about any effect.
    let rules = Rules { effects_max: if mislabelled { 0 } else { request.rules.effects_max }, ..request.rules };
    let run = |problem: &Problem, start: &Trial| {
        Search::new(problem, request.catalog, &excluded, rules, request.progress).run(start)
    };
    let found = run(problem, start);
    let blocks = quality::all_blocks(problem, &found.best.fit.trial, &found.best.fit.nuisances);
    if problem.runs.iter().any(|run| run.schedule.is_some()) {
        // The model as given has such an effect already.
        return (found, None);
    }
    let position = blocks.iter().flatten().filter(|block| block.channel == Channel::Position).map(|block| block.chi2);
    let single = single_sample_chi2(problem, &found);
    if quality::average(position).0 <= quality::Q_MAX && single <= quality::Q_MAX {
        return (found, None);
    }
    (request.progress)("decoding losses and jitter from the reported pose");
    let Some(best) = best_decoding(request, problem, start, &found) else { return (found, None) };
    let runs = problem.runs.iter().zip(&best.schedules).map(|(run, schedule)| run.decoded(&problem.model, schedule));
    problem.runs = runs.collect();
    let again = run(problem, start);
    (again, Some(best))
}

/// Mean square of single position residuals: what is random from sample to sample shows there and not in block means.
fn single_sample_chi2(problem: &Problem, found: &Found) -> f64 {
    let mut scratch = Scratch::default();
    let fit = &found.best.fit;
    let squares = (0..problem.runs.len()).flat_map(|run| {
        let residuals = problem.residuals(run, &fit.trial, &fit.nuisances[run], &mut scratch);
        residuals[problem.force_count(run)..].iter().map(|residual| residual * residual).collect::<Vec<_>>()
    });
    quality::average(squares).0
}

/// The random effect that tells the reported pose best, on the path with or without the delays that were found.
fn best_decoding(request: &Request<'_>, problem: &Problem, start: &Trial, found: &Found) -> Option<Decoded> {
    let mut best: Option<(f64, Decoded)> = None;
    let late = later(request, problem, start);
    for trial in
        [Some(&found.base.fit.trial), Some(&found.best.fit.trial), Some(start), late.as_ref()].into_iter().flatten()
    {
        let mut scratch = Scratch::default();
        let predicted: Vec<Vec<f64>> =
            (0..problem.runs.len()).map(|run| problem.predicted(run, trial, &[0.0; 3], &mut scratch).1).collect();
        let squares: f64 = (0..problem.runs.len())
            .map(|run| {
                let case = &problem.runs[run].case;
                let rms = score::rms(&case.measured_m.value, &predicted[run], &case.measured_m.known);
                rms * rms * case.measured_m.value.len() as f64
                    / problem.noise.position_floor_m
                    / problem.noise.position_floor_m
            })
            .sum();
        for id in RANDOM {
            let Some(kind) = request.catalog.get(id) else { continue };
            let delay_s = score::path_delay_s(request.model, &trial.effects);
            let Some(decoded) = decode(problem, kind, &predicted, delay_s, None) else { continue };
            let left = squares - decoded.gains.iter().sum::<f64>();
            let moving = decoded.gains.iter().filter(|gain| **gain > 0.0).count();
            let counts =
                decoded.gains.iter().sum::<f64>() > request.rules.gain_certain && moving * 2 > problem.runs.len();
            if counts && best.as_ref().is_none_or(|(other, _)| left < other - request.rules.gain_min) {
                best = Some((left, decoded));
            }
        }
    }
    best.map(|(_, decoded)| decoded)
}

/// The start behind a slower link: as late as the reported pose is at most ticks. Losses and jitter are later at some, so that a fit of
/// the delay alone takes a share of them.
fn later(request: &Request<'_>, problem: &Problem, start: &Trial) -> Option<Trial> {
    let kind = request.catalog.get("command-delay")?;
    let mut scratch = Scratch::default();
    let mut late_s: Vec<f64> = Vec::new();
    for (run, here) in problem.runs.iter().enumerate() {
        let (predicted, period_s) =
            (problem.predicted(run, start, &[0.0; 3], &mut scratch).1, here.case.rates.loop_period.seconds());
        for tick in 1..predicted.len().min(here.case.measured_m.value.len()) {
            let speed = (predicted[tick] - predicted[tick - 1]) / period_s;
            if here.case.measured_m.known[tick] && speed.abs() > MOVES_M_PER_S {
                late_s.push((predicted[tick] - here.case.measured_m.value[tick]) / speed);
            }
        }
    }
    late_s.sort_by(f64::total_cmp);
    // A smaller one is what chance makes of the middle.
    let least_s = LATE * problem.model.timing.loop_period_s;
    let delay_s = late_s.get(late_s.len() / 2).copied().filter(|delay_s| delay_s.abs() > least_s)?;
    let (param, mut trial) = (&kind.params[0], start.clone());
    trial.effects.push(Chosen { kind: kind.clone(), values: vec![delay_s.clamp(param.lower, param.upper)] });
    Some(trial)
}

fn conclude(
    request: &Request<'_>,
    prepared: &Prepared<'_>,
    problem: &Problem,
    found: &Found,
    decoded: Option<&Decoded>,
) -> Result<Outcome, Error> {
    (request.progress)("scoring the test recordings");
    let fit = &found.best.fit;
    let given = request.model.chosen(request.catalog).len();
    let nominal = Trial { base: Base::of(request.model), effects: fit.trial.effects[..given].to_vec() };
    let declared = declared_links(request, prepared, problem, &nominal);
    let own_before = score::nuisances(&declared, &nominal);
    let before = quality::all_blocks(&declared, &nominal, &own_before);
    let after = quality::all_blocks(problem, &fit.trial, &fit.nuisances);
    let mut base_parameters = verdict::base_parameters(request.model, &found.best.fit, prepared.shared.mass_kg);
    for base in base_parameters.values_mut().filter(|base| base.wrong) {
        let known = found.instead.iter().filter(|id| !base.looks_like.contains(id)).cloned();
        base.looks_like.extend(known.collect::<Vec<_>>());
    }
    if prepared.shared.convention.is_some() {
        base_parameters.values_mut().for_each(|base| base.wrong = false);
    }
    let evidence = Evidence { problem, found, given, decoded, after: &after, base: &base_parameters };
    let verdict = verdict::decide(&evidence, &prepared.examined, &prepared.shared);
    let effects = request.model.chosen(request.catalog);
    let tests = settle::cases(request.test, request.model, &effects)?;
    let mut known = fit.trial.effects.clone();
    known.extend(decoded.map(|decoded| decoded.chosen.clone()));
    let plain = score::problem(request.model, &tests, prepared.noise, &nominal.effects);
    let full = score::problem(request.model, &tests, prepared.noise, &known);
    let mut steps: Vec<(String, Vec<Errors>)> = Vec::new();
    if let Some(decoded) = decoded {
        steps.push(("nominal".into(), score::errors(&plain, &nominal)));
        steps.push((format!("+ {}", decoded.chosen.kind.id), score::errors(&full, &nominal)));
        let rest = score::trials(&nominal, &fit.trial, given).into_iter().skip(1);
        steps.extend(rest.map(|(label, trial)| (label, score::errors(&full, &trial))));
    } else {
        let all = score::trials(&nominal, &fit.trial, given).into_iter();
        steps.extend(all.map(|(label, trial)| (label, score::errors(&plain, &trial))));
        if steps.len() == 1 && base_parameters.values().any(|base| base.wrong) {
            steps.push(("refitted base".into(), score::errors(&plain, &fit.trial)));
        }
    }
    let floors = Errors { force_n: prepared.noise.force_floor_n, position_m: prepared.noise.position_floor_m };
    let ladder = score::ladder(&steps, floors, tests.iter().map(|case| case.name.clone()).collect());
    let test = test_scores(&steps, &floors);
    let verdict = verdict::after_test(verdict, &test);
    let diagnosis = Diagnosis {
        schema: 1,
        verdict,
        sentences: verdict::sentences(
            verdict,
            &evidence,
            &prepared.examined,
            &prepared.shared,
            &prepared.sessions,
            &test,
        ),
        groups: groups(&evidence, request),
        base_parameters,
        not_visible_below: not_visible(request, found),
        sessions: session_notes(request, prepared, found, &tests),
        misfit_before: misfit(&before),
        misfit_after: misfit(&after),
        test,
        map: map(&before, &after),
        ranking: ranking(found),
        noise: prepared.noise,
        scatter: [0, 1, 2].map(|j| [problem.declared[j], fit.scatter[j]]),
    };
    let learned: Vec<_> = own_before.into_iter().zip(fit.nuisances.iter().copied()).collect();
    let tested: Vec<_> =
        score::nuisances(&plain, &nominal).into_iter().zip(score::nuisances(&full, &fit.trial)).collect();
    let curves = |problems, run, role, own: &[(Nuisance, Nuisance)]| {
        score::curves(problems, run, role, &nominal, &fit.trial, own[run].into())
    };
    let learn =
        (0..learned.len()).map(|run| curves([&declared, problem], run, prepared.roles[prepared.used[run]], &learned));
    let test = (0..tested.len()).map(|run| curves([&plain, &full], run, "test", &tested));
    let curves = learn.chain(test).collect();
    let mut all = known[given..].to_vec();
    all.iter_mut().filter(|chosen| chosen.kind.id == CLOCK).for_each(|chosen| chosen.kind.params[0].discrete = false);
    Ok(Outcome { diagnosis, curves, ladder, found: all, base: fit.trial.base })
}

/// The problem on links as they were declared.
fn declared_links(request: &Request<'_>, prepared: &Prepared<'_>, problem: &Problem, nominal: &Trial) -> Problem {
    if problem.runs.iter().all(|run| run.schedule.is_none()) {
        return problem.clone();
    }
    let cases: Vec<Case> = prepared.used.iter().map(|&i| prepared.cases[i].clone()).collect();
    with_packets(Problem::docking(request.model, cases, prepared.noise), nominal)
}

fn misfit(blocks: &[Vec<Block>]) -> f64 {
    libm::sqrt(quality::average(blocks.iter().flatten().map(|block| block.chi2)).0)
}

fn map(before: &[Vec<Block>], after: &[Vec<Block>]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for channel in [Channel::Force, Channel::Position] {
        for phase in Phase::ALL {
            let of = |all: &[Vec<Block>]| {
                let here = all.iter().flatten().filter(|block| block.phase == phase && block.channel == channel);
                quality::average(here.map(|block| block.chi2))
            };
            let ((q_before, blocks), (q_after, _)) = (of(before), of(after));
            if blocks > 0 {
                cells.push(Cell { phase, channel, before: libm::sqrt(q_before), after: libm::sqrt(q_after), blocks });
            }
        }
    }
    cells
}

fn test_scores(steps: &[(String, Vec<Errors>)], floors: &Errors) -> BTreeMap<&'static str, TestScore> {
    let ends = [steps.first(), steps.last()].map(|step| step.map(|(_, errors)| errors.as_slice()).unwrap_or_default());
    let of = |value: fn(&Errors) -> f64, noise_floor: f64, unit: &'static str| {
        let [before, after] = ends.map(|errors| score::together(errors.iter().map(value)));
        TestScore { before, after, noise_floor, unit }
    };
    BTreeMap::from([
        ("force_z_n", of(|errors| errors.force_n, floors.force_n, "N")),
        ("measured_z_m", of(|errors| errors.position_m, floors.position_m, "m")),
    ])
}

/// What is missing, most important first.
fn groups(evidence: &Evidence<'_>, request: &Request<'_>) -> Vec<Group> {
    let (found, fit) = (evidence.found, &evidence.found.best.fit);
    let mut groups: Vec<Group> = Vec::new();
    for (e, chosen) in fit.trial.effects.iter().enumerate().skip(evidence.given) {
        let id = chosen.kind.id.to_string();
        let effects = found.ties.get(&id).cloned().unwrap_or_else(|| vec![id.clone()]);
        let mut alternatives: Vec<Vec<String>> = effects.iter().map(|effect| vec![effect.clone()]).collect();
        alternatives.extend(found.sets.get(&id).cloned().unwrap_or_default());
        let estimate = |(p, param): (usize, &sim_core::effect::Param)| {
            let sd = fit.estimate(&Knob::Effect(e, p)).map_or(0.0, |(_, sd)| sd);
            (param.name.to_string(), Estimate { value: chosen.values[p], sd })
        };
        let values = chosen.kind.params.iter().enumerate().map(estimate).collect();
        groups.push(Group {
            parameters: BTreeMap::from([(id.clone(), values)]),
            held_out_gain: found.worth.get(&id).copied().unwrap_or_else(|| worth_of_a_given(evidence, e)),
            reason: verdict::reason(chosen),
            splitting_experiment: verdict::splitting(&effects, &alternatives, request.catalog),
            effects,
            alternatives,
        });
    }
    if let Some(decoded) = evidence.decoded {
        let kind = &decoded.chosen.kind;
        let values = kind.params.iter().enumerate().map(|(p, param)| {
            (param.name.to_string(), Estimate { value: decoded.chosen.values[p], sd: decoded.deviations[p] })
        });
        groups.push(Group {
            effects: vec![kind.id.to_string()],
            alternatives: vec![vec![kind.id.to_string()]],
            parameters: BTreeMap::from([(kind.id.to_string(), values.collect())]),
            held_out_gain: decoded.gains.iter().sum(),
            reason: verdict::reason(&decoded.chosen),
            splitting_experiment: kind.experiment.to_string(),
        });
    }
    groups.sort_by(|a, b| b.held_out_gain.total_cmp(&a.held_out_gain));
    groups
}

/// What an effect is worth that was not searched but found exactly: by how much the fit is worse without it.
fn worth_of_a_given(evidence: &Evidence<'_>, member: usize) -> f64 {
    let fit = &evidence.found.best.fit;
    let mut without = fit.trial.clone();
    without.effects.remove(member);
    let runs: Vec<usize> = (0..evidence.problem.runs.len()).collect();
    super::fit::fit(evidence.problem, &without, &runs, Some(fit), &mut Scratch::default()).cost - fit.cost
}

fn not_visible(request: &Request<'_>, found: &Found) -> BTreeMap<String, BTreeMap<String, f64>> {
    let entry = |(id, size): (&String, &f64)| {
        let kind = request.catalog.get(id)?;
        Some((id.clone(), BTreeMap::from([(kind.params[kind.size()].name.to_string(), *size)])))
    };
    found.visible.iter().filter_map(entry).collect()
}

fn ranking(found: &Found) -> Vec<Rank> {
    let rows = found.rankings.iter().enumerate().flat_map(|(step, rows)| rows.iter().map(move |row| (step + 1, row)));
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

fn session_notes(request: &Request<'_>, prepared: &Prepared<'_>, found: &Found, tests: &[Case]) -> Vec<SessionNote> {
    let fit = &found.best.fit;
    let odd = verdict::odd_runs(fit, prepared.used.len(), if found.worth.is_empty() { 3 } else { 2 });
    let mut notes: Vec<SessionNote> = Vec::new();
    for (i, session) in prepared.sessions.iter().enumerate() {
        let run = prepared.used.iter().position(|&used| used == i);
        let examined = &prepared.examined[i];
        let mut words: Vec<String> = examined.defect.iter().map(|defect| format!("{defect}; left out")).collect();
        words.extend(examined.notes.iter().cloned());
        if prepared.cases[i].kind == Kind::Static {
            words.extend(drift_note(&prepared.cases[i], &prepared.noise));
        }
        let differs = run.and_then(|run| odd.iter().find(|(odd, _)| *odd == run));
        words.extend(differs.map(|(_, why)| why.clone()));
        notes.push(SessionNote {
            file: prepared.cases[i].name.clone(),
            role: prepared.roles[i],
            kind: session.kind,
            grade: session.grade,
            sha256: session.sha256.clone(),
            odd: examined.defect.is_some() || differs.is_some(),
            notes: words,
            software: examined.software.clone().filter(|software| software.closure_m.is_some()),
            nuisance: run.map(|run| fit.nuisances[run]),
        });
    }
    notes.extend(request.test.iter().zip(tests).map(|(session, case)| SessionNote {
        file: case.name.clone(),
        role: "test",
        kind: session.kind,
        grade: session.grade,
        sha256: session.sha256.clone(),
        odd: false,
        notes: Vec::new(),
        software: None,
        nuisance: None,
    }));
    notes
}

/// A trend at rest is a finding, never noise.
fn drift_note(case: &Case, noise: &Noise) -> Option<String> {
    let (count, slope, _, _) = trend(&case.sensed_n);
    let period_s = case.rates.sensor_period.seconds();
    // Slow noise leaves fewer independent samples than there are: (1 + φ) / (1 - φ) times fewer at worst.
    let fewer = (1.0 + noise.slow_memory) / (1.0 - noise.slow_memory).max(1e-3);
    let n = count as f64;
    let sd = noise.force_floor_n * libm::sqrt(fewer.min(10.0) * 12.0 / (n * n * n)) / period_s;
    let rate = slope / period_s;
    (rate.abs() > 4.0 * sd).then(|| format!("the reading drifts at rest by {rate:+.3} N/s (sd {sd:.3} N/s)"))
}
