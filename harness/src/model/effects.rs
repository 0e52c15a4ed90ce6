//! Lists of effects: in a model what was added to it, in a scenario the faults.

use super::{EffectModel, RigKind, TimingModel, place};
use crate::error::Error;
use sim_core::effect::{Catalog, Where};
use sim_core::refusal::plain;
use sim_core::space::Axis;

/// The tables `[[effect]]` of a file.
pub(crate) struct List<'a> {
    /// Its effects, in the order of the file.
    pub effects: &'a [&'a EffectModel],
    /// The rig that they act on.
    pub rig: RigKind,
    /// The file, for errors.
    pub name: &'a str,
    /// Its text, for errors.
    pub text: &'a str,
    /// Effects that are known.
    pub catalog: &'a Catalog<Axis>,
}

/// Refuses effects that are unknown, twice there, or without meaning.
pub(crate) fn check_effects(list: &List<'_>) -> Result<(), Error> {
    (0..list.effects.len()).try_for_each(|nth| check_effect(list, nth))
}

fn check_effect(list: &List<'_>, nth: usize) -> Result<(), Error> {
    let List { effects, rig, name, text, catalog } = *list;
    let effect = effects[nth];
    let at = |what: String, key: Option<&str>, help: String| {
        Err(Error::new(what).file(name).span(text, place::in_effect(text, nth, key)).help(help))
    };
    let Some(kind) = catalog.get(&effect.id) else {
        return at(unknown_effect(&effect.id, catalog), None, "see all of them with: dockhil effect list".into());
    };
    let fits = match rig {
        RigKind::Docking => kind.rigs != Where::Drive,
        RigKind::Drive => kind.rigs != Where::Docking,
    };
    if !fits {
        let what = format!("effect {} cannot happen on this rig", effect.id);
        return at(what, None, "see the rigs of each effect with: dockhil effect list".into());
    }
    if effects[..nth].iter().any(|other| other.id == effect.id) {
        let what = format!("effect {} stands in the file twice", effect.id);
        return at(what, None, "keep one of the two tables".into());
    }
    let known: Vec<&str> = kind.params.iter().map(|param| param.name.as_ref()).collect();
    if let Some(key) = effect.values.keys().find(|key| !known.contains(&key.as_str())) {
        let what = format!("effect {} has no parameter {key}", effect.id);
        return at(what, Some(key), format!("its parameters are: {}", known.join(", ")));
    }
    for param in &kind.params {
        let Some(value) = effect.values.get(param.name.as_ref()).copied().or(param.default) else {
            let what = format!("effect {} lacks its parameter {}", effect.id, param.name);
            return at(what, None, format!("add {} = a number in {}", param.name, param.unit));
        };
        if !(value >= param.lower && value <= param.upper) {
            let what = format!(
                "{}.{} = {} {} is outside [{}, {}]",
                effect.id,
                param.name,
                plain(value),
                param.unit,
                plain(param.lower),
                plain(param.upper)
            );
            return at(what, Some(&param.name), "give a value inside, or remove the effect".into());
        }
        if param.discrete && !param.starts.contains(&value) {
            let what = format!("{}.{} = {value} is none of {:?}", effect.id, param.name, param.starts);
            return at(what, Some(&param.name), "choose one of them, or remove the effect".into());
        }
    }
    Ok(())
}

/// A total delay may be this much below its limit: time is counted in nanoseconds.
const ROUNDING_S: f64 = 1e-9;

/// Refuses delays that with the effects on them come out shorter than any loop can have: `(effect, what is wrong)`. `late` are ids
/// of effects with their delays in s; other effects count nothing.
pub(crate) fn check_delays<'e>(
    timing: &TimingModel,
    late: impl Iterator<Item = (&'e str, f64)> + Clone,
) -> Result<(), (&'static str, String)> {
    let total_s = |id: &str, declared_s: f64| {
        declared_s + late.clone().filter(|(other, _)| *other == id).map(|(_, delay_s)| delay_s).sum::<f64>()
    };
    let command_s = total_s("command-delay", timing.command_delay_s);
    if command_s < timing.loop_period_s - ROUNDING_S {
        let what = format!(
            "the dead time of the command with command-delay is {command_s:.6} s, below one loop period, {} s",
            timing.loop_period_s
        );
        return Err(("command-delay", what));
    }
    let readout_s = total_s("measurement-delay", timing.measurement_delay_s);
    if readout_s < -ROUNDING_S {
        let what = format!("the delay of the read-back with measurement-delay is {readout_s:.6} s, below 0");
        return Err(("measurement-delay", what));
    }
    Ok(())
}

/// What to do about such a delay.
pub(crate) const DELAY_HELP: &str =
    "no pose comes before its command, nor a report before its pose: take less off, or correct the model's [timing]";

/// The delays of the enabled effects of a file.
pub(crate) fn delays<'e>(
    effects: impl Iterator<Item = &'e EffectModel> + Clone,
) -> impl Iterator<Item = (&'e str, f64)> + Clone {
    let of = |effect: &'e EffectModel| Some((effect.id.as_str(), *effect.values.get("delay_s")?));
    effects.filter(|effect| effect.enabled).filter_map(of)
}

/// 'Unknown effect x; did you mean y?'
pub fn unknown_effect(id: &str, catalog: &Catalog<Axis>) -> String {
    match nearest(id, catalog.kinds().iter().map(|kind| kind.id.as_ref())) {
        Some(other) => format!("unknown effect {id}; did you mean {other}?"),
        None => format!("unknown effect {id}"),
    }
}

/// The name that was probably meant.
pub(crate) fn nearest<'n>(id: &str, names: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let near = names.map(|name| (distance(id, name), name)).min();
    near.filter(|(edits, _)| *edits <= id.len() / 2).map(|(_, name)| name)
}

/// Levenshtein distance: how many letters differ.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let changed = corner + usize::from(letter != *other);
            corner = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}
