//! Recordings, a model and its noise as one least-squares problem: what can be turned, and the residuals that follow.
//!
//! Residuals are in multiples of their noise: whitened force first, then reported position. What may differ from run to run is a
//! nuisance of that run with a declared scatter: offset of the force, stiffness, damping. A drive has no declared scatter; its
//! nuisances are the position and velocity at the start of each block, free.

use crate::blocks::{self, Base, Path, Schedule};
use crate::case::Case;
use crate::clamp::Clamp;
use crate::diagnose::noise::Noise;
use crate::model::{Chosen, Model, RigKind};
use sim_core::space::{Axis, AxisMotion};
use sim_core::trace::Trace;
use std::ops::Range;

/// What can be turned, shared by all runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Knob {
    /// Moving mass of a drive.
    Mass,
    /// Stiffness.
    Stiffness,
    /// Damping.
    Damping,
    /// Constant force of a drive.
    Offset,
    /// A parameter of an effect: which effect, which parameter.
    Effect(usize, usize),
}

/// A model under trial: base values and effects.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Base values.
    pub base: Base,
    /// Effects with their values.
    pub effects: Vec<Chosen>,
}

impl Trial {
    /// The knobs that a fit may turn. Choices are not among them.
    pub fn knobs(&self, rig: RigKind) -> Vec<Knob> {
        let mut knobs = match rig {
            RigKind::Docking => vec![Knob::Stiffness, Knob::Damping],
            RigKind::Drive => vec![Knob::Mass, Knob::Damping, Knob::Offset],
        };
        for (e, chosen) in self.effects.iter().enumerate() {
            let fitted = chosen.kind.params.iter().enumerate().filter(|(_, param)| !param.discrete);
            knobs.extend(fitted.map(|(p, _)| Knob::Effect(e, p)));
        }
        knobs
    }

    /// The value of a knob.
    pub fn get(&self, knob: &Knob) -> f64 {
        match *knob {
            Knob::Mass => self.base.mass_kg,
            Knob::Stiffness => self.base.stiffness_n_per_m,
            Knob::Damping => self.base.damping_n_s_per_m,
            Knob::Offset => self.base.offset_n,
            Knob::Effect(e, p) => self.effects[e].values[p],
        }
    }

    /// Turns a knob, no further than its limits.
    pub fn set(&mut self, knob: &Knob, value: f64) {
        let (lower, upper) = self.limits(knob);
        let value = value.clamp(lower, upper);
        match *knob {
            Knob::Mass => self.base.mass_kg = value,
            Knob::Stiffness => self.base.stiffness_n_per_m = value,
            Knob::Damping => self.base.damping_n_s_per_m = value,
            Knob::Offset => self.base.offset_n = value,
            Knob::Effect(e, p) => self.effects[e].values[p] = value,
        }
    }

    /// The limits of a knob.
    pub fn limits(&self, knob: &Knob) -> (f64, f64) {
        match *knob {
            Knob::Mass => (1e-6, f64::INFINITY),
            Knob::Stiffness | Knob::Damping => (0.0, f64::INFINITY),
            Knob::Offset => (f64::NEG_INFINITY, f64::INFINITY),
            Knob::Effect(e, p) => {
                let param = &self.effects[e].kind.params[p];
                (param.lower, param.upper)
            }
        }
    }

    /// A change of a knob that matters.
    pub fn matter(&self, knob: &Knob) -> f64 {
        match *knob {
            Knob::Mass | Knob::Stiffness | Knob::Damping => 0.01 * self.get(knob).abs().max(1.0),
            Knob::Offset => 0.1,
            Knob::Effect(e, p) => self.effects[e].kind.params[p].scale,
        }
    }

    /// A small change of a knob for a difference quotient, away from its upper limit.
    pub fn nudge(&self, knob: &Knob) -> f64 {
        let value = self.get(knob);
        let size = match *knob {
            Knob::Mass | Knob::Stiffness => 1e-4 * value.abs().max(1e-3),
            Knob::Damping => 1e-3 * value.abs().max(1.0),
            Knob::Offset => 1e-3,
            Knob::Effect(e, p) => 2e-3 * self.effects[e].kind.params[p].scale,
        };
        if value + size > self.limits(knob).1 { -size } else { size }
    }
}

/// How far runs scatter, one standard deviation each: offset in N, stiffness and damping relative.
pub type Scatter = [f64; 3];

/// What differs in one run: for a docking cell offset in N and the logarithms of stiffness and damping; for a drive the
/// position in m and the velocity in m/s at its start.
pub type Nuisance = [f64; 3];

/// One run of the problem.
#[derive(Debug, Clone)]
pub struct Run {
    /// The recording.
    pub case: Case,
    /// Ticks of the loop that count: all of a docking recording, one block of a drive.
    pub span: Range<usize>,
    /// How many of the nuisances are free here.
    pub nuisances: usize,
    /// What happened on the link, if that was decoded.
    pub schedule: Option<Schedule>,
    /// The path of the model without effects on it.
    nominal: Path,
    /// Whitened unit step: the column of the offset.
    ones: Vec<f64>,
}

/// Everything that a fit needs and does not change.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The nominal model.
    pub model: Model,
    /// Noise.
    pub noise: Noise,
    /// Runs.
    pub runs: Vec<Run>,
    /// Declared scatter.
    pub declared: Scatter,
}

/// Time in which the error of a free-running position becomes independent: about one reversal of a drive. Samples closer than
/// that tell the same thing.
const INDEPENDENT_S: f64 = 0.25;

/// The deviation by which position residuals of a drive are divided, so that `samples` of them at `period_s` weigh as much as the
/// independent ones among them, each of root mean square `rms_m`.
pub fn effective_sigma_m(rms_m: f64, period_s: f64) -> f64 {
    rms_m * libm::sqrt((INDEPENDENT_S / period_s).max(1.0))
}

/// What an evaluation keeps for the next one.
#[derive(Debug, Default)]
pub struct Scratch {
    trace: Trace<Axis>,
    /// For each run, the path that was computed last and the effect values behind it.
    paths: Vec<Option<(Vec<f64>, Path)>>,
}

impl Problem {
    /// A docking problem: each recording is one run.
    pub fn docking(model: &Model, cases: Vec<Case>, noise: Noise) -> Self {
        let runs = cases.into_iter().map(|case| Run::docking(model, case, &noise)).collect();
        let repeat = &model.repeatability;
        let declared =
            [repeat.force_offset_n, repeat.stiffness_ratio, repeat.damping_ratio].map(|sd: f64| sd.max(1e-6));
        Problem { model: model.clone(), noise, runs, declared }
    }

    /// The same runs, started from another wire.
    #[must_use]
    pub fn clamped(mut self, clamp: Clamp) -> Self {
        let model = self.model.clone();
        self.runs.iter_mut().for_each(|run| run.nominal = clamp.path(&model, &run.case));
        self
    }

    /// A drive problem: each recording is cut into this many blocks. `noise` carries the size of the residuals that counts as one
    /// (see [`effective_sigma_m`]).
    pub fn drive(model: &Model, cases: &[Case], blocks: usize, noise: Noise) -> Self {
        let mut runs = Vec::new();
        for case in cases {
            let ticks = case.measured_m.value.len();
            for block in 0..blocks {
                let span = ticks * block / blocks..ticks * (block + 1) / blocks;
                let nominal = Path::default();
                runs.push(Run { case: case.clone(), span, nuisances: 2, schedule: None, nominal, ones: Vec::new() });
            }
        }
        Problem { model: model.clone(), noise, runs, declared: [f64::INFINITY; 3] }
    }

    /// Whole recordings of a drive, each from its first sample at rest; nothing of them is fitted.
    pub fn drive_whole(model: &Model, cases: &[Case], noise: Noise) -> Self {
        let mut problem = Problem::drive(model, cases, 1, noise);
        problem.runs.iter_mut().for_each(|run| run.nuisances = 0);
        problem
    }

    /// Where a fit of the base starts: the nominal values.
    pub fn nominal(&self) -> Trial {
        Trial { base: Base::of(&self.model), effects: Vec::new() }
    }

    /// Where the nuisances of a run start.
    pub fn first_nuisance(&self, run: &Run) -> Nuisance {
        if self.model.rig == RigKind::Docking {
            return [0.0; 3];
        }
        if run.nuisances == 0 {
            return [run.case.first.position_m, run.case.first.velocity_m_per_s, 0.0];
        }
        // A straight line through the first 40 ms: a start for the fit, never a result.
        let span = run.span.start..(run.span.start + 40).min(run.span.end);
        let line = crate::case::Channel {
            value: run.case.measured_m.value[span.clone()].to_vec(),
            known: run.case.measured_m.known[span].to_vec(),
        };
        let (_, slope, mean, centre) = crate::diagnose::noise::trend(&line);
        [mean - slope * centre, slope / run.case.rates.loop_period.seconds(), 0.0]
    }

    /// Residuals of one run, in multiples of their noise.
    pub fn residuals(&self, index: usize, trial: &Trial, nuisance: &Nuisance, scratch: &mut Scratch) -> Vec<f64> {
        let run = &self.runs[index];
        match self.model.rig {
            RigKind::Docking => self.docking_residuals(index, trial, nuisance, scratch),
            RigKind::Drive => self.drive_residuals(run, trial, nuisance, scratch),
        }
    }

    /// How many residuals a run has.
    pub fn samples(&self, index: usize) -> usize {
        match self.model.rig {
            RigKind::Docking => self.force_count(index) + self.runs[index].span.len(),
            RigKind::Drive => self.runs[index].span.len(),
        }
    }

    /// How many of the residuals of a run are force; the rest is position.
    pub fn force_count(&self, index: usize) -> usize {
        self.runs[index].case.sensed_n.value.len()
    }

    fn docking_residuals(&self, index: usize, trial: &Trial, nuisance: &Nuisance, scratch: &mut Scratch) -> Vec<f64> {
        let run = &self.runs[index];
        let (predicted_n, measured_m) = self.predicted(index, trial, nuisance, scratch);
        let sensed = &run.case.sensed_n;
        let mut out: Vec<f64> = Vec::with_capacity(predicted_n.len() + measured_m.len());
        out.extend(sensed.value.iter().zip(&predicted_n).map(|(measured, predicted)| measured - predicted));
        self.noise.whiten(&mut out, &sensed.known);
        out.extend(self.position_residuals(&run.case, &measured_m));
        out
    }

    fn position_residuals<'r>(&'r self, case: &'r Case, predicted_m: &'r [f64]) -> impl Iterator<Item = f64> + 'r {
        let pairs = case.measured_m.value.iter().zip(predicted_m).zip(&case.measured_m.known);
        let sigma_m = self.noise.position_floor_m;
        pairs.map(move |((measured, predicted), known)| if *known { (measured - predicted) / sigma_m } else { 0.0 })
    }

    /// Reading (offset included) and reported position that a trial predicts for a run, commands clamped.
    pub fn predicted(
        &self,
        index: usize,
        trial: &Trial,
        nuisance: &Nuisance,
        scratch: &mut Scratch,
    ) -> (Vec<f64>, Vec<f64>) {
        let run = &self.runs[index];
        let base = Base {
            stiffness_n_per_m: trial.base.stiffness_n_per_m * libm::exp(nuisance[1]),
            damping_n_s_per_m: trial.base.damping_n_s_per_m * libm::exp(nuisance[2]),
            ..trial.base
        };
        let on_path: Vec<&Chosen> =
            trial.effects.iter().filter(|chosen| blocks::is_on_path(&chosen.kind.wires)).collect();
        let key: Vec<f64> = on_path.iter().flat_map(|chosen| chosen.values.iter().copied()).collect();
        scratch.paths.resize(self.runs.len().max(scratch.paths.len()), None);
        if !on_path.is_empty() && scratch.paths[index].as_ref().is_none_or(|(of, _)| *of != key) {
            let path = blocks::path(&self.model, &run.case, &trial.effects, run.schedule.as_ref());
            scratch.paths[index] = Some((key, path));
        }
        let path = match &scratch.paths[index] {
            Some((_, path)) if !on_path.is_empty() => path,
            _ => &run.nominal,
        };
        let mut force_n = blocks::force(&self.model, &run.case, path, &base, &trial.effects, &mut scratch.trace);
        force_n.iter_mut().for_each(|force| *force += nuisance[0]);
        (force_n, path.measured_m.clone())
    }

    fn drive_residuals(&self, run: &Run, trial: &Trial, nuisance: &Nuisance, scratch: &mut Scratch) -> Vec<f64> {
        let first = AxisMotion::moving(nuisance[0], nuisance[1]);
        let predicted =
            blocks::drive(&run.case, run.span.clone(), first, &trial.base, &trial.effects, &mut scratch.trace);
        let measured = &run.case.measured_m.value[run.span.clone()];
        measured.iter().zip(&predicted).map(|(m, p)| (m - p) / self.noise.position_floor_m).collect()
    }

    /// The columns of the nuisances of one run; `stiffness` and `damping` are those of the shared knobs, per unit.
    pub fn nuisance_columns(
        &self,
        index: usize,
        trial: &Trial,
        nuisance: &Nuisance,
        shared: &[Vec<f64>],
        scratch: &mut Scratch,
    ) -> Vec<Vec<f64>> {
        let run = &self.runs[index];
        match self.model.rig {
            RigKind::Docking => {
                let mut columns = vec![run.ones.clone()];
                if run.nuisances > 1 {
                    for (column, value) in
                        shared.iter().zip([trial.base.stiffness_n_per_m, trial.base.damping_n_s_per_m])
                    {
                        columns.push(column.iter().map(|slope| slope * value).collect());
                    }
                }
                columns
            }
            RigKind::Drive => {
                let here = self.residuals(index, trial, nuisance, scratch);
                [1e-6, 1e-5]
                    .iter()
                    .enumerate()
                    .take(run.nuisances)
                    .map(|(j, nudge)| {
                        let mut moved = *nuisance;
                        moved[j] += nudge;
                        let there = self.residuals(index, trial, &moved, scratch);
                        there.iter().zip(&here).map(|(there, here)| (there - here) / nudge).collect()
                    })
                    .collect()
            }
        }
    }
}

impl Run {
    fn docking(model: &Model, case: Case, noise: &Noise) -> Self {
        let nominal = blocks::path(model, &case, &[], None);
        let mut ones: Vec<f64> = case.sensed_n.known.iter().map(|known| if *known { -1.0 } else { 0.0 }).collect();
        noise.whiten(&mut ones, &case.sensed_n.known);
        ones.resize(ones.len() + case.measured_m.value.len(), 0.0);
        let nuisances = if case.is_impact() { 3 } else { 1 };
        let span = 0..case.commanded.len();
        Run { case, span, nuisances, schedule: None, nominal, ones }
    }

    /// The same run on a link whose past was decoded.
    #[must_use]
    pub fn decoded(&self, model: &Model, schedule: &Schedule) -> Self {
        let nominal = blocks::path(model, &self.case, &[], Some(schedule));
        Run { nominal, schedule: Some(schedule.clone()), ..self.clone() }
    }

    /// The path of the model without effects on it.
    pub fn nominal_path(&self) -> &Path {
        &self.nominal
    }
}
