//! Fits the effects that a model already has, together with its base values; nothing is searched.

use super::fit::fit;
use super::noise::Noise;
use super::problem::{Knob, Problem, Scratch, Trial, effective_sigma_m};
use super::random::with_packets;
use super::score;
use super::settle;
use crate::blocks::{Base, RANDOM};
use crate::error::Error;
use crate::model::{Chosen, Model, RigKind};
use crate::recording::Session;
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// A fitted effect: its parameters with their standard deviations.
#[derive(Debug, Clone)]
pub struct Refitted {
    /// The effect with its new values.
    pub chosen: Chosen,
    /// One standard deviation for each parameter; 0 for one that is chosen, not fitted.
    pub deviations: Vec<f64>,
}

/// How many standard deviations a size must be away from none to count as told from it.
const TOLD_SD: f64 = 2.0;
/// A value closer than this share of its range to a limit lies on it.
const AT_LIMIT: f64 = 1e-6;

impl Refitted {
    /// Why the values are not to be trusted, if so: a limit was reached, or the size cannot be told from none.
    pub fn doubt(&self) -> Option<String> {
        let params = &self.chosen.kind.params;
        let fitted =
            || params.iter().zip(&self.chosen.values).zip(&self.deviations).filter(|((param, _), _)| !param.discrete);
        let at_limit = fitted().find(|((param, value), _)| {
            let near = AT_LIMIT * (param.upper - param.lower);
            let on = |limit: f64| limit.is_finite() && (**value - limit).abs() <= near;
            on(param.upper) || (on(param.lower) && (param.lower - param.off).abs() > near)
        });
        if let Some(((param, value), _)) = at_limit {
            return Some(format!("{} = {value} {} lies at the limit of its range", param.name, param.unit));
        }
        let size = self.chosen.kind.size();
        let (value, sd, off) = (self.chosen.values[size], self.deviations[size], params[size].off);
        let untold = !params[size].discrete && (value - off).abs() <= TOLD_SD * sd;
        untold.then(|| format!("{} cannot be told from {off} in these recordings", params[size].name))
    }
}

/// A base value that the fit moved along.
#[derive(Debug, Clone, Copy)]
pub struct Moved {
    /// Its key in the model.
    pub key: &'static str,
    /// Its value before.
    pub before: f64,
    /// Its value now.
    pub after: f64,
    /// One standard deviation.
    pub sd: f64,
}

/// What a refit changed.
#[derive(Debug, Clone)]
pub struct Refit {
    /// All base values, fitted or not.
    pub base: Base,
    /// Those that were fitted.
    pub moved: Vec<Moved>,
    /// The effects.
    pub effects: Vec<Refitted>,
}

/// Fits these effects of a model, and its base values, on recordings. The others keep their values.
pub fn refit(model: &Model, catalog: &Catalog<Axis>, ids: &[String], sessions: &[Session]) -> Result<Refit, Error> {
    // A fit of its parameters alone means nothing.
    if let Some(id) = ids.iter().find(|id| RANDOM.contains(&id.as_str())) {
        let what = format!("{id} is random: it is decoded, not fitted");
        return Err(Error::new(what).help("find its parameters with: dockhil diagnose --write-model"));
    }
    let mut effects = model.chosen(catalog);
    let cases = settle::cases(sessions, model, &effects)?;
    for chosen in effects.iter_mut().filter(|chosen| !ids.contains(&chosen.kind.id.to_string())) {
        chosen.kind.params.iter_mut().for_each(|param| param.discrete = true);
    }
    let start = Trial { base: Base::of(model), effects };
    let mut scratch = Scratch::default();
    let problem = match model.rig {
        RigKind::Docking => with_packets(Problem::docking(model, cases.clone(), Noise::learn(&cases, model)), &start),
        RigKind::Drive => {
            let unit = Problem::drive(model, &cases, super::drive::BLOCKS, super::drive::noise(1.0));
            let runs: Vec<usize> = (0..unit.runs.len()).collect();
            let first = fit(&unit, &start, &runs, None, &mut scratch);
            let left =
                runs.iter().flat_map(|&run| unit.residuals(run, &first.trial, &first.nuisances[run], &mut scratch));
            let rms_m = score::together(left.collect::<Vec<_>>().into_iter());
            let sigma_m = effective_sigma_m(rms_m, model.timing.loop_period_s);
            Problem::drive(model, &cases, super::drive::BLOCKS, super::drive::noise(sigma_m))
        }
    };
    let runs: Vec<usize> = (0..problem.runs.len()).collect();
    let fitted = fit(&problem, &start, &runs, None, &mut scratch);
    let of = |(e, chosen): (usize, &Chosen)| {
        let sd = |p: usize| fitted.estimate(&Knob::Effect(e, p)).map_or(0.0, |(_, sd)| sd);
        Refitted { chosen: chosen.clone(), deviations: (0..chosen.values.len()).map(sd).collect() }
    };
    let listed =
        fitted.trial.effects.iter().enumerate().filter(|(_, chosen)| ids.contains(&chosen.kind.id.to_string()));
    let before = Base::of(model);
    let moved = [
        ("plant.mass_kg", Knob::Mass, before.mass_kg),
        ("contact.stiffness_n_per_m", Knob::Stiffness, before.stiffness_n_per_m),
        ("contact.damping_n_s_per_m", Knob::Damping, before.damping_n_s_per_m),
        ("contact.offset_n", Knob::Offset, before.offset_n),
    ]
    .into_iter()
    .filter_map(|(key, knob, before)| fitted.estimate(&knob).map(|(after, sd)| Moved { key, before, after, sd }));
    Ok(Refit { base: fitted.trial.base, moved: moved.collect(), effects: listed.map(of).collect() })
}
