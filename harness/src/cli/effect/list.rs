//! The catalogue for people and for programs.

use super::List;
use crate::cli::console::Console;
use crate::cli::inputs;
use crate::error::Error;
use crate::model::{Chosen, Model, RigKind, unknown_effect};
use serde_json::{Value, json};
use sim_core::effect::{Catalog, Kind, Param, Verified, Where};
use sim_core::space::Axis;
use std::fmt::Write;

/// Prints the catalogue, or what of it can happen on the rig of a model.
pub fn list(list: &List, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<(), Error> {
    let model = list.model.as_ref().map(|path| inputs::model(path, catalog)).transpose()?;
    let can_happen = |kind: &&Kind<Axis>| model.as_ref().is_none_or(|model| happens_on(kind, model.rig));
    let kinds: Vec<&Kind<Axis>> = catalog.kinds().iter().filter(can_happen).collect();
    if list.json {
        let all: Vec<Value> = kinds.iter().map(|kind| entry(kind, model.as_ref())).collect();
        console.print(&format!("{:#}\n", json!({ "schema": 1, "effects": all })));
        return Ok(());
    }
    let mut text = String::new();
    for kind in &kinds {
        line(&mut text, kind, model.as_ref());
    }
    let own = kinds.iter().filter(|kind| kind.verified == Verified::OwnOnly).count();
    let _ = writeln!(
        text,
        "{} effects; {} found in recordings that are not ours, {own} only in our own simulations. More: dockhil effect show ID",
        kinds.len(),
        kinds.len() - own
    );
    console.print(&text);
    Ok(())
}

/// The effect with this id, or the error that names the nearest one.
pub fn known<'a>(id: &str, catalog: &'a Catalog<Axis>) -> Result<&'a Kind<Axis>, Error> {
    catalog.get(id).ok_or_else(|| {
        Error::new(unknown_effect(id, catalog))
            .place(format!("argument {id:?}"))
            .help("see all of them with: dockhil effect list")
    })
}

/// Everything about one effect.
pub fn sheet(kind: &Kind<Axis>) -> String {
    let mut text = format!("{}\n  {}\n\n", kind.id, kind.about);
    let rows = [
        ("wire", wires(kind)),
        ("rigs", rigs(kind.rigs).to_owned()),
        ("looks like", kind.fingerprint.to_string()),
        ("isolate it", kind.experiment.to_string()),
        ("verified", verified(kind)),
    ];
    for (name, value) in rows {
        let _ = writeln!(text, "  {name:<11} {value}");
    }
    for param in &kind.params {
        let starts: Vec<String> = param.starts.iter().map(f64::to_string).collect();
        let role = if param.discrete { "chosen among" } else { "a fit starts at" };
        let _ = writeln!(
            text,
            "  {:<11} {}; off at {}; {role} {}",
            "parameter",
            limits(param),
            param.off,
            starts.join(", ")
        );
    }
    let values = Chosen::at_start(kind).values;
    let pairs: Vec<(&Param, f64)> = kind.params.iter().zip(values).collect();
    let typed: Vec<String> = pairs.iter().map(|(param, value)| format!("{}={value}", param.name)).collect();
    let colon = if typed.is_empty() { "" } else { ":" };
    let _ = writeln!(text, "\n  dockhil effect add {}{colon}{} --model MODEL.toml\n", kind.id, typed.join(","));
    let _ = writeln!(text, "  [[effect]]\n  id = \"{}\"", kind.id);
    for (param, value) in pairs {
        let _ = writeln!(text, "  {} = {value:?}", param.name);
    }
    text
}

fn line(text: &mut String, kind: &Kind<Axis>, model: Option<&Model>) {
    let own = model.and_then(|model| model.effects.iter().find(|effect| effect.id == kind.id));
    let mark = match own {
        Some(effect) if effect.enabled => "* ",
        Some(_) => "- ",
        None if model.is_some() => "  ",
        None => "",
    };
    let _ = writeln!(text, "{mark}{:<20} {:<9} {:<14} {}", kind.id, wires(kind), rigs(kind.rigs), kind.about);
    for param in &kind.params {
        let value = own.and_then(|effect| effect.values.get(param.name.as_ref()));
        let value = value.map_or(String::new(), |value| format!(" = {value}"));
        let _ = writeln!(text, "{:indent$} {}{value}", "", limits(param), indent = 20 + mark.len());
    }
    let _ = writeln!(text, "{:indent$} verified: {}", "", verified(kind), indent = 20 + mark.len());
}

/// One effect for programs.
fn entry(kind: &Kind<Axis>, model: Option<&Model>) -> Value {
    let own = model.and_then(|model| model.effects.iter().find(|effect| effect.id == kind.id));
    let params: Vec<Value> = kind
        .params
        .iter()
        .map(|param| {
            json!({
                "name": param.name, "unit": param.unit, "lower": param.lower, "off": param.off, "upper": param.upper,
                "scale": param.scale, "starts": param.starts, "discrete": param.discrete,
            })
        })
        .collect();
    json!({
        "id": kind.id,
        "about": kind.about,
        "wires": kind.wires.iter().map(|wire| wire.name()).collect::<Vec<_>>(),
        "rigs": kind.rigs,
        "family": kind.family,
        "fingerprint": kind.fingerprint,
        "experiment": kind.experiment,
        "params": params,
        "verified_by": match kind.verified {
            Verified::Foreign(by) => Value::from(by),
            Verified::OwnOnly => Value::Null,
        },
        "in_model": own.map(|effect| json!({ "enabled": effect.enabled, "source": effect.source, "values": effect.values })),
    })
}

fn happens_on(kind: &Kind<Axis>, rig: RigKind) -> bool {
    match rig {
        RigKind::Docking => kind.rigs != Where::Drive,
        RigKind::Drive => kind.rigs != Where::Docking,
    }
}

fn wires(kind: &Kind<Axis>) -> String {
    kind.wires.iter().map(|wire| wire.name()).collect::<Vec<_>>().join(", ")
}

fn rigs(rigs: Where) -> &'static str {
    match rigs {
        Where::Docking => "docking",
        Where::Drive => "drive",
        Where::Both => "docking, drive",
    }
}

fn limits(param: &Param) -> String {
    format!("{} [{}, {}] {}", param.name, param.lower, param.upper, param.unit)
}

fn verified(kind: &Kind<Axis>) -> String {
    match kind.verified {
        Verified::Foreign(by) => format!("found in {by}"),
        Verified::OwnOnly => "only in our own simulations".to_owned(),
    }
}
