//! One recording: software block, clamped blocks, free run.

use super::clamped::{self, Clamped, Known};
use super::log::Log;
use super::quantity::{self, Sides};
use super::result::{Block, Quantity, SessionComparison, Verdict};
use super::run::FreeRun;
use super::{free_run, shift, signals, words};
use crate::diagnose::problem::{Problem, Trial};
use crate::diagnose::quality;
use crate::diagnose::software::{self, Software};
use crate::model::{Chosen, RigKind};
use sim_core::effect::Catalog;
use sim_core::force_sensor::SensorNoise;
use sim_core::space::Axis;

/// What is the same for all recordings.
pub struct Shared<'a> {
    /// Model, noise, recordings.
    pub problem: &'a Problem,
    /// The model's own values and effects.
    pub trial: &'a Trial,
    /// Effects that are known.
    pub catalog: &'a Catalog<Axis>,
    /// Noise of the sensor in its parts.
    pub noise: SensorNoise,
    /// How well the noise is known; `None` where it is not known at all.
    pub known: Option<Known>,
    /// Free runs.
    pub free_run: FreeRun,
}

/// What one recording says.
pub struct Compared {
    /// For the reader.
    pub session: SessionComparison,
    /// For the heat map over all recordings.
    pub blocks: Vec<quality::Block>,
    /// Sentences.
    pub findings: Vec<(words::Rank, String)>,
}

/// Compares one run of the problem.
pub fn compared(shared: &Shared<'_>, index: usize) -> Compared {
    let Shared { problem, trial, .. } = shared;
    let case = &problem.runs[index].case;
    let clamped = clamped::evaluate(problem, index, trial);
    let software = examined(shared, index);
    let software_sentence = words::software(&software);
    let blocks = clamped::blocks(problem, index, &clamped, &shared.noise, shared.known);
    let (shift_force, shift_pose) = shift::best(problem, index, trial, &clamped);
    let free = free(shared, index, &clamped);
    let (quantities, summary, band) = match free {
        Some((quantities, outcome)) => (quantities, Some(outcome.summary), Some(outcome.force_n)),
        None => (Vec::new(), None, None),
    };
    let fitted = clamped::fitted(problem, index, &clamped.nuisance);
    let findings = words::session(&words::Session {
        file: &case.name,
        grade: case.grade,
        software: &software,
        software_sentence: &software_sentence,
        blocks: &blocks,
        fitted: &fitted,
        shifts: [shift_force.as_ref(), shift_pose.as_ref()],
        quantities: &quantities,
        free_run: summary.as_ref(),
    });
    let session = SessionComparison {
        file: case.name.clone(),
        grade: case.grade,
        kind: case.kind,
        verdict: verdict(&software, &blocks),
        software,
        software_sentence,
        fitted,
        blocks,
        quantities,
        free_run: summary,
        shift_force,
        shift_pose,
        heat: if shared.known.is_some() { clamped::heat(clamped.blocks.iter()) } else { Vec::new() },
        signals: signals::signals(problem, index, trial, &clamped, band.as_ref()),
    };
    Compared { session, blocks: clamped.blocks, findings }
}

/// The software block; a drive has no software.
fn examined(shared: &Shared<'_>, index: usize) -> Software {
    let case = &shared.problem.runs[index].case;
    let delay = shared.catalog.get("command-delay").map(Chosen::at_start);
    match delay {
        Some(delay) if shared.problem.model.rig == RigKind::Docking => {
            software::examine(&shared.problem.model, case, &shared.trial.effects, &delay)
        }
        _ => Software::not_examined(),
    }
}

/// Quantities and free runs of a recording with contact.
fn free(shared: &Shared<'_>, index: usize, clamped: &Clamped) -> Option<(Vec<Quantity>, free_run::Outcome)> {
    clamped.contact?;
    let model = &shared.problem.model;
    let case = &shared.problem.runs[index].case;
    let FreeRun { samples, seed } = shared.free_run;
    let outcome = free_run::run(model, &shared.trial.effects, case, shared.noise, samples, seed);
    let threshold_n = quantity::threshold_n(&shared.noise);
    let recorded = quantity::seen(&Log::recorded(model, case), threshold_n);
    let quantities = quantity::quantities(&Sides {
        recorded: &recorded,
        free: &outcome.seen,
        samples,
        coarse_and_fine: (&outcome.coarse_and_fine.0, &outcome.coarse_and_fine.1),
        noise: shared.noise,
        sensor_period_s: case.rates.sensor_period.seconds(),
        threshold_n,
    });
    Some((quantities, outcome))
}

fn verdict(software: &Software, blocks: &[Block]) -> Verdict {
    let worst = blocks.iter().map(|block| block.verdict).max().unwrap_or(Verdict::CannotSay);
    match (software.closes(), software.is_judged()) {
        (false, _) => Verdict::Outside,
        (true, false) => worst.max(Verdict::CannotSay),
        (true, true) => worst,
    }
}
