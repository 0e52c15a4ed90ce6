//! The JSON schema of the model file, generated from the types and the catalogue.

use super::{Model, SpaceModel};
use serde_json::{Map, Value, json};
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// The schema; editors complete and check a model file with it.
pub fn schema(catalog: &Catalog<Axis>) -> Value {
    with_effects(serde_json::to_value(schemars::schema_for!(Model)), catalog)
}

/// The schema of models with six axes.
pub fn space_schema(catalog: &Catalog<Axis>) -> Value {
    with_effects(serde_json::to_value(schemars::schema_for!(SpaceModel)), catalog)
}

fn with_effects(schema: serde_json::Result<Value>, catalog: &Catalog<Axis>) -> Value {
    let mut schema = schema.unwrap_or(Value::Null);
    if let Some(definitions) = schema.get_mut("$defs").and_then(Value::as_object_mut) {
        definitions.insert("EffectModel".into(), json!({ "oneOf": effect_schemas(catalog) }));
    }
    schema
}

/// The schema of each effect's table.
pub(crate) fn effect_schemas(catalog: &Catalog<Axis>) -> Vec<Value> {
    catalog
        .kinds()
        .iter()
        .map(|kind| {
            let mut properties = Map::new();
            properties.insert("id".into(), json!({ "const": kind.id }));
            properties.insert("enabled".into(), json!({ "type": "boolean", "default": true }));
            properties.insert("source".into(), json!({ "type": "string", "description": "where the numbers come from" }));
            let mut required = vec![json!("id")];
            for param in &kind.params {
                let limits = json!({ "type": "number", "minimum": param.lower, "maximum": param.upper, "description": param.unit });
                properties.insert(param.name.to_string(), limits);
                if param.default.is_none() {
                    required.push(json!(param.name));
                }
            }
            json!({ "type": "object", "description": kind.about, "properties": properties, "required": required, "additionalProperties": false })
        })
        .collect()
}
