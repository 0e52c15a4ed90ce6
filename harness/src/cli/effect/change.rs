//! Changes of the effects of a model file: all of a command, or nothing of it.

use super::{Add, Fit, Remove, fit_into};
use crate::cli::console::Console;
use crate::cli::inputs;
use crate::error::Error;
use crate::model::{Editor, EffectText};
use sim_core::effect::{Catalog, Kind};
use sim_core::space::Axis;
use std::path::Path;

/// Adds effects, or changes the values of those that are there.
pub fn add(add: &Add, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<(), Error> {
    let mut editor = Editor::open(&add.model, catalog)?;
    let model = inputs::model(&add.model, catalog)?;
    let texts: Vec<EffectText> =
        add.effects.iter().map(|text| EffectText::parse(text, catalog)).collect::<Result<_, _>>()?;
    let mut said = String::new();
    for text in &texts {
        let Some(kind) = catalog.get(&text.id) else { continue };
        let old = model.effects.iter().find(|effect| effect.id == text.id);
        // A value that is neither typed nor in the file is one at which a fit would start.
        let held = |name: &str| old.is_some_and(|effect| effect.values.contains_key(name));
        if old.is_some() && text.values.is_empty() && add.source.is_none() && add.fit.is_empty() {
            return Err(nothing_to_change(&text.id, &add.model));
        }
        let guessed: Vec<(String, f64)> = starts(kind).filter(|(name, _)| !typed(text, name) && !held(name)).collect();
        let source = source(add.source.as_deref(), text, &guessed);
        let values: Vec<(String, f64)> = text.values.iter().chain(&guessed).cloned().collect();
        editor.set(&text.id, &values, &source);
        let numbers: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let verb = if old.is_some() { "changed" } else { "added" };
        said += &format!("{}: {verb} {}; {} ({source})\n", add.model.display(), text.id, numbers.join(", "));
    }
    let ids: Vec<String> = texts.into_iter().map(|text| text.id).collect();
    must_hold(&editor, &ids, &add.model)?;
    valid(&editor, &add.model, catalog)?;
    if !add.fit.is_empty() {
        let sessions = add.reading.sessions_along(&add.fit, console)?;
        let progress = console.progress();
        said = fit_into(&mut editor, &ids, &sessions, catalog, &progress)?;
    }
    editor.save(catalog)?;
    console.print(&said);
    Ok(())
}

/// Takes an effect out.
pub fn remove(remove: &Remove, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<(), Error> {
    let mut editor = Editor::open(&remove.model, catalog)?;
    must_hold(&editor, std::slice::from_ref(&remove.id), &remove.model)?;
    editor.remove(&remove.id);
    editor.save(catalog)?;
    console.print(&format!("{}: removed {}\n", remove.model.display(), remove.id));
    Ok(())
}

/// Fits effects that are there.
pub fn fit(fit: &Fit, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<(), Error> {
    let mut editor = Editor::open(&fit.model, catalog)?;
    must_hold(&editor, &fit.effects, &fit.model)?;
    let sessions = fit.reading.sessions_along(&fit.learn, console)?;
    let progress = console.progress();
    let said = fit_into(&mut editor, &fit.effects, &sessions, catalog, &progress)?;
    editor.save(catalog)?;
    console.print(&said);
    Ok(())
}

fn typed(text: &EffectText, name: &str) -> bool {
    text.values.iter().any(|(other, _)| other == name)
}

fn starts(kind: &Kind<Axis>) -> impl Iterator<Item = (String, f64)> {
    kind.params.iter().map(|param| (param.name.to_string(), param.starts[0]))
}

/// Where the values come from: what the user says, and aloud what nobody said.
fn source(given: Option<&str>, text: &EffectText, guessed: &[(String, f64)]) -> String {
    let names: Vec<&str> = guessed.iter().map(|(name, _)| name.as_str()).collect();
    let guess = format!("{} only where a fit would start, neither measured nor fitted", names.join(", "));
    let stated = given.or((!text.values.is_empty()).then_some("given on the command line"));
    match (stated, names.is_empty()) {
        (Some(stated), true) => stated.to_owned(),
        (Some(stated), false) => format!("{stated}; {guess}"),
        (None, true) => "unchanged".to_owned(),
        (None, false) => guess,
    }
}

/// The effect is there, and nothing was said that would change it.
fn nothing_to_change(id: &str, path: &Path) -> Error {
    Error::new(format!("effect {id} is in the model already, and no value was given")).file(path).help(format!(
        "give values, as {id}:param=value, or fit it: dockhil effect fit {id} --model {} --learn RECORDING…",
        path.display()
    ))
}

/// Every one of these effects stands in the file as a table.
fn must_hold(editor: &Editor, ids: &[String], path: &Path) -> Result<(), Error> {
    let held = editor.effects();
    let Some(missing) = ids.iter().find(|id| !held.contains(id)) else { return Ok(()) };
    let list = if held.is_empty() { "it has none".to_owned() } else { format!("it has {}", held.join(", ")) };
    Err(Error::new(format!("effect {missing} is not in the model; {list}"))
        .file(path)
        .help(format!("add it with: dockhil effect add {missing} --model {}", path.display())))
}

/// The text would be a valid model; the error speaks of the change, since its lines are not in the file.
fn valid(editor: &Editor, path: &Path, catalog: &Catalog<Axis>) -> Result<(), Error> {
    let model = crate::model::Model::parse(&path.display().to_string(), &editor.text(), catalog);
    model.map(drop).map_err(|error| Error { place: Some("after this change".into()), source_text: None, ..error })
}
