//! A run and its criteria.

use crate::blocks::GRAVITY_M_PER_S2;
use crate::error::Error;
use crate::model::{Model, place};
use sim_core::criterion::{AnyCriterion, Criterion, Known, Observation, Outcome, Verdict};
use sim_core::space::Axis;
use sim_core::trace::Trace;

/// Refuses criteria whose limits have no meaning.
pub(super) fn check(criteria: &[AnyCriterion], name: &str, text: &str) -> Result<(), Error> {
    for (nth, criterion) in criteria.iter().enumerate() {
        if let Err(refusal) = criterion.check() {
            return Err(Error::new(format!("criterion {}: {refusal}", criterion.id()))
                .file(name)
                .span(text, place::in_list(text, "criterion", nth, Some(refusal.name)))
                .help("correct the limit; see the keys of each criterion with: dockhil run --schema"));
        }
    }
    Ok(())
}

/// What is known of a run of this model besides its columns.
pub fn known(model: &Model, mass_kg: f64) -> Known {
    let sensor = &model.sensor;
    Known {
        mass_kg: Some(mass_kg),
        bias: [0.0, 0.0, sensor.bias_n, 0.0, 0.0, 0.0],
        tool_weight_n: sensor.tool_mass_kg * GRAVITY_M_PER_S2,
        force_sd_n: Some(libm::hypot(sensor.white_sigma_n, sensor.slow_sigma_n)),
        torque_sd_n_m: None,
        position_sd_m: Some(model.readout.position_sigma_m),
    }
}

/// Judges a run along one axis.
pub fn judged(criteria: &[AnyCriterion], trace: &Trace<Axis>, known: &Known) -> Vec<Verdict> {
    let run = Observation::of_axis(trace, known);
    criteria.iter().map(|criterion| criterion.judge(&run)).collect()
}

/// The worst of all: failed, else undecided, else passed.
pub fn outcome(verdicts: &[Verdict]) -> Outcome {
    verdicts.iter().map(|verdict| verdict.outcome).max().unwrap_or(Outcome::Pass)
}
