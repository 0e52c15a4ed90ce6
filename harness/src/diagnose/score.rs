//! Error on test recordings: commands clamped, blocks at their own rate; only offset and stiffness, inside the declared
//! repeatability, are fitted for each of them.

use super::answer::{Curves, Ladder, LadderChannel, LadderStep};
use super::noise::Noise;
use super::nuisance::bounded;
use super::problem::{Nuisance, Problem, Scratch, Trial};
use super::quality::Contact;
use super::random::with_packets;
use super::settle;
use crate::case::Case;
use crate::model::{Chosen, Model};
use std::collections::BTreeMap;

/// How many of the nuisances a test recording may fit: offset and stiffness.
const TEST_NUISANCES: usize = 2;

/// Root mean squares of one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Force along the axis, N.
    pub force_n: f64,
    /// Reported position, m.
    pub position_m: f64,
}

/// The test recordings as a problem of their own; random effects among `found` are decoded with their parameters as they are.
pub fn problem(model: &Model, cases: &[Case], noise: Noise, found: &[Chosen]) -> Problem {
    let trial = Trial { base: crate::blocks::Base::of(model), effects: found.to_vec() };
    let mut problem = with_packets(Problem::docking(model, cases.to_vec(), noise), &trial);
    for run in &mut problem.runs {
        run.nuisances = run.nuisances.min(TEST_NUISANCES);
    }
    problem
}

/// Delay from a command to its report, by the model and its effects.
pub fn path_delay_s(model: &Model, effects: &[Chosen]) -> f64 {
    let extra =
        effects.iter().filter(|chosen| matches!(chosen.kind.id.as_ref(), "command-delay" | "measurement-delay"));
    model.timing.command_delay_s + model.timing.measurement_delay_s + extra.map(|chosen| chosen.values[0]).sum::<f64>()
}

/// Nuisances of every run under a trial.
pub fn nuisances(problem: &Problem, trial: &Trial) -> Vec<Nuisance> {
    let mut scratch = Scratch::default();
    (0..problem.runs.len()).map(|run| bounded(problem, run, trial, &mut scratch)).collect()
}

/// Errors of every run under a trial.
pub fn errors(problem: &Problem, trial: &Trial) -> Vec<Errors> {
    let own = nuisances(problem, trial);
    let mut scratch = Scratch::default();
    let of = |run: usize| {
        let (force_n, position_m) = problem.predicted(run, trial, &own[run], &mut scratch);
        let case = &problem.runs[run].case;
        Errors {
            force_n: rms(&case.sensed_n.value, &force_n, &case.sensed_n.known),
            position_m: rms(&case.measured_m.value, &position_m, &case.measured_m.known),
        }
    };
    (0..problem.runs.len()).map(of).collect()
}

/// Root mean square of a difference, over what is known.
pub fn rms(measured: &[f64], predicted: &[f64], known: &[bool]) -> f64 {
    let pairs = measured.iter().zip(predicted).zip(known).filter(|(_, known)| **known);
    let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), ((m, p), _)| (sum + (m - p) * (m - p), count + 1.0));
    if count > 0.0 { libm::sqrt(sum / count) } else { 0.0 }
}

/// Root mean square over several recordings.
pub fn together(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    if count > 0.0 { libm::sqrt(sum / count) } else { 0.0 }
}

/// A ladder from labelled errors.
pub fn ladder(steps: &[(String, Vec<Errors>)], floors: Errors, sessions: Vec<String>) -> Ladder {
    let channel = |unit: &'static str, floor: f64, of: fn(&Errors) -> f64| LadderChannel {
        unit,
        noise_floor: floor,
        steps: steps
            .iter()
            .map(|(label, errors)| {
                let rms = together(errors.iter().map(of));
                let excess = libm::sqrt((rms * rms - floor * floor).max(0.0));
                LadderStep { label: label.clone(), rms, excess, per_session: errors.iter().map(of).collect() }
            })
            .collect(),
    };
    let mut channels = BTreeMap::new();
    if floors.force_n > 0.0 {
        channels.insert("force_z_n", channel("N", floors.force_n, |errors| errors.force_n));
    }
    channels.insert("measured_z_m", channel("m", floors.position_m, |errors| errors.position_m));
    Ladder { schema: 1, channels, sessions }
}

/// Nominal, + effect 1, + effect 2 …: `given` effects are in every step.
pub fn trials(nominal: &Trial, found: &Trial, given: usize) -> Vec<(String, Trial)> {
    let mut steps = vec![("nominal".to_string(), nominal.clone())];
    for count in given + 1..=found.effects.len() {
        let trial = Trial { base: found.base, effects: found.effects[..count].to_vec() };
        steps.push((format!("+ {}", found.effects[count - 1].kind.id), trial));
    }
    steps
}

/// The ladder of a model on recordings: its base values, then its effects one after the other.
pub fn ladder_of(
    model: &Model,
    catalog: &sim_core::effect::Catalog<sim_core::space::Axis>,
    test: &[crate::recording::Session],
    aux: &[crate::recording::Session],
) -> Result<Ladder, crate::error::Error> {
    let effects = model.chosen(catalog);
    let cases = settle::cases(test, model, &effects)?;
    let base = Trial { base: crate::blocks::Base::of(model), effects: Vec::new() };
    let full = Trial { effects: effects.clone(), ..base.clone() };
    let sessions = cases.iter().map(|case| case.name.clone()).collect();
    if model.rig == crate::model::RigKind::Drive {
        let steps: Vec<(String, Vec<Errors>)> = trials(&base, &full, 0)
            .into_iter()
            .map(|(label, trial)| (label, super::drive::errors(model, &cases, &trial)))
            .collect();
        return Ok(ladder(&steps, Errors { force_n: 0.0, position_m: 0.0 }, sessions));
    }
    let rest = settle::cases(aux.iter().chain(test), model, &effects)?;
    let noise = Noise::learn(&rest, model);
    let steps: Vec<(String, Vec<Errors>)> = trials(&base, &full, 0)
        .into_iter()
        .map(|(label, trial)| (label, errors(&problem(model, &cases, noise, &trial.effects), &trial)))
        .collect();
    let floors = Errors { force_n: noise.force_floor_n, position_m: noise.position_floor_m };
    Ok(ladder(&steps, floors, sessions))
}

/// Signals of one run under two trials, for pictures: the first on links as they were declared, the second on those that were found.
pub fn curves(
    [plain, problem]: [&Problem; 2],
    run: usize,
    role: &'static str,
    before: &Trial,
    after: &Trial,
    own: [Nuisance; 2],
) -> Curves {
    let here = &problem.runs[run];
    let case = &here.case;
    let mut scratch = Scratch::default();
    let (force_before, position_before_m) = plain.predicted(run, before, &own[0], &mut Scratch::default());
    let (force_after, position_after_m) = problem.predicted(run, after, &own[1], &mut scratch);
    let bias_n = problem.model.sensor.bias_n;
    let weight_n = problem.model.sensor.tool_mass_kg * crate::blocks::GRAVITY_M_PER_S2;
    let path = crate::blocks::path(&problem.model, case, &after.effects, here.schedule.as_ref());
    let at = |tick: usize| {
        let step = (case.rates.sensor_phase.0 + tick as i64 * case.rates.sensor_period.0) / case.rates.physics_step.0;
        path.achieved[(step as usize).min(path.achieved.len() - 1)]
    };
    let resisting = |reading: &[f64]| -> Vec<f64> {
        let of = |(tick, reading): (usize, &f64)| bias_n + weight_n * libm::sin(at(tick).pitch_rad) - reading;
        reading.iter().enumerate().map(of).collect()
    };
    Curves {
        file: case.name.clone(),
        role,
        contact_s: Contact::of(here).map(|contact| (contact.first_s, contact.last_s)),
        sensor_time_s: (0..case.sensed_n.value.len()).map(|tick| case.sensor_time_s(tick)).collect(),
        force_measured_n: resisting(&case.sensed_n.value),
        force_before_n: resisting(&force_before),
        force_after_n: resisting(&force_after),
        depth_m: (0..case.sensed_n.value.len()).map(|tick| at(tick).position_m).collect(),
        loop_time_s: (0..case.measured_m.value.len()).map(|tick| case.loop_time_s(tick)).collect(),
        position_measured_m: case.measured_m.value.clone(),
        position_before_m,
        position_after_m,
    }
}
