//! The blocks with their inputs clamped: residuals of force and reported pose, and how far above the noise they are.
//!
//! Each recording may fit its own force offset, stiffness and damping, with the declared repeatability as their prior and three
//! times that as their limit: what needs more is no repeatability, and stays in the residual. A drive may fit its position and
//! velocity at the start. What was fitted is said, and so is the residual without it.

use super::agreement::Agreement;
use super::log::contact_force_n;
use super::quantity::autocovariance;
use super::result::{Block, Fitted, HeatCell, HeatRow, Verdict};
use crate::case::{Case, Channel};
use crate::diagnose::fit::{held, own_nuisance};
use crate::diagnose::nuisance::bounded;
use crate::diagnose::problem::{Nuisance, Problem, Scratch, Trial};
use crate::diagnose::quality::{self, Contact, Phase};
use crate::model::RigKind;
use sim_core::force_sensor::SensorNoise;
use sim_core::trace::Trace;

/// How far the window of the RMSE reaches beyond the contact.
const MARGIN_S: f64 = 0.020;
/// Least limit of Q, above which noise alone is not believed.
const Q_LIMIT_MIN: f64 = 1.35;
/// Significance for a whole recording and for one phase of it; a phase is one of many that are looked at.
const SIGMAS_SESSION: f64 = 3.0;
const SIGMAS_PHASE: f64 = 4.0;

/// How well the noise is known: how many independent values the recording at rest gave; infinite where it was declared.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Of the force: blocks of 40 ms, since the slow part decides its misfit.
    pub force: f64,
    /// Of the position, whose noise is white: samples.
    pub position: f64,
}

impl Known {
    /// From the recording at rest, if there is one.
    pub fn from_rest(at_rest: Option<&Case>) -> Self {
        match at_rest {
            Some(case) => Known {
                force: case.sensed_n.known_values().count() as f64 * case.rates.sensor_period.seconds()
                    / quality::BLOCK_S,
                position: case.measured_m.known_values().count() as f64,
            },
            None => Known { force: f64::INFINITY, position: f64::INFINITY },
        }
    }
}

/// One recording under the model.
pub struct Clamped {
    /// What was fitted of this recording.
    pub nuisance: Nuisance,
    /// Reading of the force block, in N, with that.
    pub force_n: Vec<f64>,
    /// Position of the path block, in m, with that.
    pub measured_m: Vec<f64>,
    /// Residuals in multiples of the noise, force first.
    pub residuals: Vec<f64>,
    /// Statistics over blocks of 40 ms.
    pub blocks: Vec<quality::Block>,
    /// Contact by the model's path.
    pub contact: Option<Contact>,
    plain_force_n: Vec<f64>,
    plain_m: Vec<f64>,
}

/// Evaluates one run of a problem.
pub fn evaluate(problem: &Problem, index: usize, trial: &Trial) -> Clamped {
    let mut scratch = Scratch::default();
    let nuisance = match problem.model.rig {
        RigKind::Docking => bounded(problem, index, trial, &mut scratch),
        RigKind::Drive => own_nuisance(problem, &held(problem, trial), index, &mut scratch),
    };
    let first = problem.first_nuisance(&problem.runs[index]);
    let (force_n, measured_m) = predicted(problem, index, trial, &nuisance, &mut scratch);
    let (plain_force_n, plain_m) = predicted(problem, index, trial, &first, &mut scratch);
    let residuals = problem.residuals(index, trial, &nuisance, &mut scratch);
    let blocks = quality::blocks(problem, index, &residuals);
    let run = &problem.runs[index];
    let contact = if run.case.is_impact() { Contact::of(run) } else { None };
    Clamped { nuisance, force_n, measured_m, residuals, blocks, contact, plain_force_n, plain_m }
}

fn predicted(
    problem: &Problem,
    index: usize,
    trial: &Trial,
    nuisance: &Nuisance,
    scratch: &mut Scratch,
) -> (Vec<f64>, Vec<f64>) {
    let run = &problem.runs[index];
    match problem.model.rig {
        RigKind::Docking => problem.predicted(index, trial, nuisance, scratch),
        RigKind::Drive => {
            let first = sim_core::space::AxisMotion::moving(nuisance[0], nuisance[1]);
            let mut trace = Trace::default();
            let span = run.span.clone();
            let positions = crate::blocks::drive(&run.case, span, first, &trial.base, &trial.effects, &mut trace);
            (Vec::new(), positions)
        }
    }
}

/// What was fitted, in words and numbers.
pub fn fitted(problem: &Problem, index: usize, nuisance: &Nuisance) -> Vec<Fitted> {
    let declared = problem.declared.iter().map(|sd| sd.is_finite().then_some(*sd));
    let names = match problem.model.rig {
        RigKind::Docking => [("force offset", "N"), ("ln stiffness ratio", "1"), ("ln damping ratio", "1")],
        RigKind::Drive => [("position at the start", "m"), ("velocity at the start", "m/s"), ("", "")],
    };
    let all = names.iter().zip(nuisance).zip(declared);
    all.take(problem.runs[index].nuisances)
        .map(|(((name, unit), value), declared)| Fitted {
            name: (*name).into(),
            unit: (*unit).into(),
            value: *value,
            declared,
        })
        .collect()
}

/// The path and the force block of a docking cell, or the one block of a drive.
pub fn blocks(
    problem: &Problem,
    index: usize,
    clamped: &Clamped,
    noise: &SensorNoise,
    known: Option<Known>,
) -> Vec<Block> {
    let case = &problem.runs[index].case;
    let window = clamped.contact.map(|contact| (contact.first_s - MARGIN_S, contact.last_s + MARGIN_S));
    let position_gamma = |lag: usize| {
        let sigma_m = problem.noise.position_floor_m;
        if lag == 0 { sigma_m * sigma_m } else { 0.0 }
    };
    let drive = problem.model.rig == RigKind::Drive;
    let force_n = |reading_n: &[f64]| contact_force_n(&problem.model, case, &case.commanded, reading_n);
    let measured_n = Channel { value: force_n(&case.sensed_n.value), known: case.sensed_n.known.clone() };
    let (model_n, plain_n) = (force_n(&clamped.force_n), force_n(&clamped.plain_force_n));
    let path = Residual {
        name: if drive { "drive: applied force → position" } else { "path: command → measured pose" },
        channel: quality::Channel::Position,
        unit: "m",
        floor: if known.is_some() { problem.noise.position_floor_m } else { 0.0 },
        measured: &case.measured_m,
        model: &clamped.measured_m,
        plain: &clamped.plain_m,
        window: if drive { Some((f64::NEG_INFINITY, f64::INFINITY)) } else { window },
        time_s: &|tick| case.loop_time_s(tick),
        gamma: &position_gamma,
    };
    let force = Residual {
        name: "force: achieved pose → reading",
        channel: quality::Channel::Force,
        unit: "N",
        floor: problem.noise.force_floor_n,
        measured: &measured_n,
        model: &model_n,
        plain: &plain_n,
        window,
        time_s: &|tick| case.sensor_time_s(tick),
        gamma: &|lag| autocovariance(noise, lag),
    };
    let all: Vec<&Residual<'_>> = if drive { vec![&path] } else { vec![&path, &force] };
    all.into_iter().map(|residual| residual.block(&clamped.blocks, known)).collect()
}

/// One channel of a block.
struct Residual<'a> {
    name: &'a str,
    channel: quality::Channel,
    unit: &'a str,
    floor: f64,
    measured: &'a Channel,
    model: &'a [f64],
    plain: &'a [f64],
    window: Option<(f64, f64)>,
    time_s: &'a dyn Fn(usize) -> f64,
    gamma: &'a dyn Fn(usize) -> f64,
}

impl Residual<'_> {
    fn block(&self, blocks: &[quality::Block], known: Option<Known>) -> Block {
        let everywhere = (f64::NEG_INFINITY, f64::INFINITY);
        let (rms, _) = self.rms(self.model, everywhere);
        let (rms_unfitted, _) = self.rms(self.plain, everywhere);
        let contact = self.window.map(|window| self.rms(self.model, window)).filter(|(_, count)| *count > 0);
        let here = || blocks.iter().filter(|block| block.channel == self.channel);
        let (q, count) = quality::average(here().map(|block| block.chi2));
        let rest = match self.channel {
            quality::Channel::Force => known.map_or(f64::INFINITY, |known| known.force),
            quality::Channel::Position => known.map_or(f64::INFINITY, |known| known.position),
        };
        let limit = q_limit(count, rest, SIGMAS_SESSION);
        let outside = |phase: &Phase| {
            let (q, count) = quality::average(here().filter(|b| b.phase == *phase).map(|b| b.chi2));
            count > 0 && q > q_limit(count, rest, SIGMAS_PHASE)
        };
        let phases_outside: Vec<Phase> = Phase::ALL.into_iter().filter(outside).collect();
        let is_outside = q > limit || q.is_nan() || !phases_outside.is_empty();
        Block {
            block: self.name.into(),
            channel: channel_name(self.channel).into(),
            rms,
            rms_unfitted,
            rms_contact: contact.map(|(rms, _)| rms),
            rms_contact_uncertainty: contact.map(|(rms, count)| self.uncertainty(rms, count)),
            agreement: self.window.and_then(|window| Agreement::of(&self.pairs(self.model, window))),
            noise_floor: self.floor,
            unit: self.unit.into(),
            misfit: known.map(|_| libm::sqrt(q)),
            misfit_limit: libm::sqrt(limit),
            phases_outside: if known.is_some() { phases_outside } else { Vec::new() },
            verdict: match (known.is_some(), is_outside) {
                (false, _) => Verdict::CannotSay,
                (true, true) => Verdict::Outside,
                (true, false) => Verdict::InsideNoise,
            },
        }
    }

    /// Root mean square of what is known within a window, and how many samples that is.
    fn rms(&self, model: &[f64], window: (f64, f64)) -> (f64, usize) {
        let pairs = self.pairs(model, window);
        let sum: f64 = pairs.iter().map(|(measured, model)| (measured - model) * (measured - model)).sum();
        (libm::sqrt(sum / (pairs.len() as f64).max(1.0)), pairs.len())
    }

    /// Measured and computed, where measured and within a window.
    fn pairs(&self, model: &[f64], window: (f64, f64)) -> Vec<(f64, f64)> {
        let all = self.measured.value.iter().zip(model).zip(&self.measured.known).enumerate();
        let inside = |tick: usize| (self.time_s)(tick) >= window.0 && (self.time_s)(tick) <= window.1;
        let known = all.filter(|(tick, (_, known))| **known && inside(*tick));
        known.map(|(_, ((measured, model), _))| (*measured, *model)).collect()
    }

    /// Twice the standard deviation of an RMSE over `count` samples of a model error with the sensor's noise on top.
    ///
    /// `var(RMSE²) = (2 Σ γ_k² + 4 e² Σ γ_k) / n` with the mean square e² of the error itself.
    fn uncertainty(&self, rms: f64, count: usize) -> f64 {
        let (mut squares, mut sum) = (0.0, 0.0);
        for lag in 0..count.min(500) {
            let gamma = (self.gamma)(lag);
            let twice = if lag == 0 { 1.0 } else { 2.0 };
            squares += twice * gamma * gamma;
            sum += twice * gamma;
        }
        let error = (rms * rms - (self.gamma)(0)).max(0.0);
        let variance = (2.0 * squares + 4.0 * error * sum) / count as f64;
        libm::sqrt(variance) / rms.max(f64::MIN_POSITIVE)
    }
}

/// The value that a mean of `count` squares of white noise stays below, at this many sigma (Wilson and Hilferty 1931), when the
/// noise itself is known from `rest` values only: relative variances add.
fn q_limit(count: usize, rest: f64, sigmas: f64) -> f64 {
    let spread = 2.0 / 9.0 * (1.0 / (count as f64).max(1.0) + 1.0 / rest.max(1.0));
    let root = 1.0 - spread + sigmas * libm::sqrt(spread);
    (root * root * root).max(Q_LIMIT_MIN)
}

/// The name of a channel as `--limit` takes it.
pub fn channel_name(channel: quality::Channel) -> &'static str {
    match channel {
        quality::Channel::Force => "force_z_n",
        quality::Channel::Position => "measured_z_m",
    }
}

/// Misfit by channel and phase.
pub fn heat<'a>(blocks: impl Iterator<Item = &'a quality::Block> + Clone) -> Vec<HeatRow> {
    let row = |channel: quality::Channel| {
        let cell = |phase: Phase| {
            let here = blocks.clone().filter(|block| block.channel == channel && block.phase == phase);
            let (q, blocks) = quality::average(here.map(|block| block.chi2));
            (blocks > 0).then(|| HeatCell { phase, misfit: libm::sqrt(q), blocks })
        };
        HeatRow { channel: channel_name(channel).into(), cells: Phase::ALL.into_iter().filter_map(cell).collect() }
    };
    [quality::Channel::Force, quality::Channel::Position]
        .map(row)
        .into_iter()
        .filter(|row| !row.cells.is_empty())
        .collect()
}
