//! A model as the text of its file: every key with its meaning, taken from the same sentences as the schema.

use super::Model;
use crate::error::Error;
use serde_json::Value;
use toml_edit::{DocumentMut, Item, Table};

impl Model {
    /// The text of a new model file; `origin` says where the numbers come from. Parsed again it is the same model.
    pub fn text(&self, origin: &str) -> Result<String, Error> {
        let refused = |error: &dyn std::fmt::Display| Error::new(format!("the model cannot be written: {error}"));
        let plain = toml::to_string(self).map_err(|error| refused(&error))?;
        let mut document: DocumentMut = plain.parse().map_err(|error| refused(&error))?;
        let schema = serde_json::to_value(schemars::schema_for!(Model)).map_err(|error| refused(&error))?;
        explain(document.as_table_mut(), &schema, &schema);
        let head = format!(
            "# A model for dockhil. SI units, which stand in the keys; unknown keys are refused.\n\
             # Keys and limits: dockhil model schema. Effects: dockhil effect list, dockhil effect add.\n\
             # Numbers from {origin}.\n\n"
        );
        Ok(head + document.to_string().trim_start())
    }
}

/// Puts the schema's sentences beside the keys of a table and above its tables.
fn explain(table: &mut Table, schema: &Value, root: &Value) {
    for (mut key, item) in table.iter_mut() {
        let property = &schema["properties"][key.get()];
        match item {
            Item::Table(inner) => {
                if let Some(about) = sentence(property, root) {
                    inner.decor_mut().set_prefix(format!("\n# {about}\n"));
                }
                explain(inner, resolved(property, root), root);
            }
            Item::Value(value) => {
                key.leaf_decor_mut().set_suffix(" ");
                if let Some(about) = sentence(property, root) {
                    value.decor_mut().set_suffix(format!("  # {about}"));
                }
            }
            _ => {}
        }
    }
}

/// The first sentence of a property, or of its type.
fn sentence(property: &Value, root: &Value) -> Option<String> {
    let about = property["description"].as_str().or_else(|| resolved(property, root)["description"].as_str())?;
    let joined = about.replace('\n', " ");
    Some(joined.split_once(". ").map_or(joined.clone(), |(first, _)| format!("{first}.")))
}

/// What a property's reference points at.
fn resolved<'a>(property: &'a Value, root: &'a Value) -> &'a Value {
    let reference = property["$ref"].as_str().or_else(|| property["allOf"][0]["$ref"].as_str());
    let target = reference.and_then(|path| path.strip_prefix('#')).and_then(|path| root.pointer(path));
    target.unwrap_or(property)
}
