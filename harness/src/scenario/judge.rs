//! A run and its criteria.

use crate::blocks::GRAVITY_M_PER_S2;
use crate::error::Error;
use crate::model::{Model, parsed, place};
use sim_core::criterion::{AnyCriterion, Criterion, Known, Observation, Outcome, Verdict};
use sim_core::space::Axis;
use sim_core::trace::Trace;

/// Refuses criteria whose limits have no meaning.
pub(super) fn check(criteria: &[AnyCriterion], name: &str, text: &str) -> Result<(), Error> {
    for (nth, criterion) in criteria.iter().enumerate() {
        if let Err(refusal) = criterion.check() {
            return Err(Error::new(format!("criterion {} ({}): {refusal}", nth + 1, criterion.id()))
                .file(name)
                .span(text, place::in_list(text, "criterion", nth, Some(refusal.name)))
                .help("correct the limit; see the keys of each criterion with: dockhil run --schema"));
        }
    }
    Ok(())
}

/// A mistake in one of the criteria, with its place. The parser knows only where the list begins, since the id decides what the
/// other keys are. Any other mistake stays as it is.
pub(super) fn placed(error: Error, name: &str, text: &str) -> Error {
    let tables = toml::from_str::<toml::Table>(text).ok();
    let list = tables.as_ref().and_then(|table| table.get("criterion")).and_then(toml::Value::as_array);
    let wrong = list.into_iter().flatten().enumerate().find_map(|(nth, one)| {
        let alone = toml::to_string(one).ok()?;
        let found = parsed::<AnyCriterion>(name, &alone, super::SCHEMA).err()?;
        Some((nth, one, found.what))
    });
    let Some((nth, one, what)) = wrong.filter(|(.., what)| error.what.contains(what.as_str())) else { return error };
    // The key that the parser names, if it is written at all.
    let key = what.split('`').nth(1).filter(|key| one.get(*key).is_some());
    let value = one.as_table().into_iter().flatten().find(|(_, value)| {
        value.as_str().is_some_and(|word| what.contains(&format!("`{word}`")) || what.contains(&format!("\"{word}\"")))
    });
    let key = key.or(value.map(|(key, _)| key.as_str()));
    let id = one.get("id").and_then(toml::Value::as_str).unwrap_or("without an id");
    let place = place::in_list(text, "criterion", nth, key);
    let place = if place.is_empty() { place::of_key(text, "criterion") } else { place };
    let error = Error::new(format!("criterion {} ({id}): {what}", nth + 1)).file(name).span(text, place);
    error.help(format!("see the keys that are known with: {}", super::SCHEMA))
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
