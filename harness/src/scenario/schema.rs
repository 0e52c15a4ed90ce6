//! The JSON schema of the scenario file, generated from the types and the catalogue.

use super::Scenario;
use crate::model;
use serde_json::{Value, json};
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// The schema; editors complete and check a scenario with it.
pub fn schema(catalog: &Catalog<Axis>) -> Value {
    let mut schema = serde_json::to_value(schemars::schema_for!(Scenario)).unwrap_or(Value::Null);
    let mut effects = model::effect_schemas(catalog);
    for effect in &mut effects {
        for (key, about) in [("from_s", "when it begins to act, in s"), ("until_s", "when it ceases to act, in s")] {
            effect["properties"][key] = json!({ "type": "number", "minimum": 0.0, "description": about });
        }
    }
    if let Some(definitions) = schema.get_mut("$defs").and_then(Value::as_object_mut) {
        definitions.insert("FaultModel".into(), json!({ "oneOf": effects }));
        definitions.remove("EffectModel");
    }
    schema
}
