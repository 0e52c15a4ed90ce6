//! The JSON schema of the scenario file, generated from the types and the catalogue.

use super::Scenario;
use crate::model;
use serde_json::{Value, json};
use sim_core::effect::Catalog;
use sim_core::space::Axis;

/// Keys of each criterion: those that must be there, and those that may.
const CRITERIA: [(&str, &[&str], &[&str]); 9] = [
    ("observed-energy", &[], &["pairing", "axis", "window", "measured_late_s", "expect", "band_j"]),
    ("energy-per-axis", &[], &["axes"]),
    ("damping", &[], &["pairing", "axis", "at_least_n_s_per_m", "at_most_n_s_per_m"]),
    ("restitution", &[], &["release", "axis", "at_least", "at_most"]),
    ("contact-duration", &[], &["axis", "at_least_s", "at_most_s"]),
    ("peak-force", &["at_most_n"], &["axis"]),
    ("peak-depth", &["at_most_m"], &[]),
    ("distortion", &["stiffness_n_per_m", "damping_n_s_per_m"], &["of", "release", "at_least", "at_most"]),
    ("agreement", &["of", "predicted"], &["predicted_sd", "tolerance"]),
];
const AXES: [&str; 6] = ["x", "y", "z", "about-x", "about-y", "about-z"];
const PAIRINGS: [&str; 4] =
    ["feedback-with-satellite-mean", "interface-with-achieved", "sensed-with-measured", "feedback-minus-sensed"];
const PREDICTED: [&str; 5] =
    ["stability", "restitution-at-zero-depth", "restitution-at-zero-force", "damping", "contact-duration"];

/// The schema of one criterion.
fn criterion((id, must, may): &(&str, &[&str], &[&str])) -> Value {
    let mut properties = serde_json::Map::from_iter([("id".to_owned(), json!({ "const": id }))]);
    for key in must.iter().chain(*may) {
        properties.insert((*key).to_owned(), value(id, key));
    }
    let required: Vec<&str> = std::iter::once("id").chain(must.iter().copied()).collect();
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
}

/// What stands behind a key of a criterion.
fn value(id: &str, key: &str) -> Value {
    match (id, key) {
        (_, "axis") => json!({ "enum": AXES }),
        (_, "axes") => json!({ "type": "array", "items": { "enum": AXES } }),
        (_, "pairing") => json!({ "enum": PAIRINGS }),
        (_, "window") => json!({ "enum": ["contact", "run"] }),
        (_, "expect") => json!({ "enum": ["passive", "neutral", "active"] }),
        (_, "release") => json!({ "enum": ["zero-depth", "zero-force"] }),
        ("distortion", "of") => json!({ "enum": ["restitution", "peak-force"] }),
        (_, "of") => json!({ "enum": PREDICTED }),
        _ => json!({ "type": "number" }),
    }
}

/// The schema of each effect as a fault, which may begin and cease.
pub(crate) fn fault_schemas(catalog: &Catalog<Axis>) -> Vec<Value> {
    let mut effects = model::effect_schemas(catalog);
    for effect in &mut effects {
        for (key, about) in [("from_s", "when it begins to act, in s"), ("until_s", "when it ceases to act, in s")] {
            effect["properties"][key] = json!({ "type": "number", "minimum": 0.0, "description": about });
        }
    }
    effects
}

/// The schema; editors complete and check a scenario with it.
pub fn schema(catalog: &Catalog<Axis>) -> Value {
    let mut schema = serde_json::to_value(schemars::schema_for!(Scenario)).unwrap_or(Value::Null);
    let effects = fault_schemas(catalog);
    schema["properties"]["criterion"] = json!({
        "type": "array",
        "description": "What the run is judged by.",
        "items": { "oneOf": CRITERIA.iter().map(criterion).collect::<Vec<_>>() },
    });
    if let Some(definitions) = schema.get_mut("$defs").and_then(Value::as_object_mut) {
        definitions.insert("FaultModel".into(), json!({ "oneOf": effects }));
        definitions.remove("EffectModel");
    }
    schema
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::criterion::AnyCriterion;

    /// Every key of the schema is read, with every word that it allows; a key that it does not know is refused.
    #[test]
    fn the_schema_lists_the_criteria_that_a_scenario_reads() {
        for entry in &CRITERIA {
            let (id, must, may) = entry;
            let words = |key: &str| -> Vec<String> {
                let schema = value(id, key);
                match (&schema["enum"], key) {
                    (Value::Array(words), _) => words.iter().map(Value::to_string).collect(),
                    (_, "axes") => vec!["[\"about-z\"]".to_owned()],
                    _ => vec!["0.5".to_owned()],
                }
            };
            let needed: String = must.iter().map(|key| format!("{key} = {}\n", words(key)[0])).collect();
            let read = |text: String| toml::from_str::<AnyCriterion>(&format!("id = \"{id}\"\n{text}"));
            assert!(read(needed.clone()).is_ok(), "{id}: {:?}", read(needed));
            for key in *may {
                for word in words(key) {
                    let text = format!("{needed}{key} = {word}\n");
                    let answer = read(text.clone());
                    assert!(answer.is_ok(), "{id}: {text} {answer:?}");
                }
            }
            assert!(read(format!("{needed}strange = 1.0\n")).is_err(), "{id}");
        }
    }
}
