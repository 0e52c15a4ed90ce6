//! The faults of the wire as text, for those who write a `[[fault]]`: what each does, its parameters, its streams, and how it is
//! seen. All of it comes from [`drivers::fault`]; nothing is said twice.

use drivers::fault::{Action, CLASSES, TABLE};
use serde_json::Value;
use std::fmt::Write as _;

const HEAD: &str = "\
Faults of the wire. In CELL.toml:

  [[fault]]
  id = \"drop\"
  on = \"rsi-reply\"       # the stream
  at = 100               # cycle, sample or request, from 0; or \"first-contact\"
  for = 3                # on how many packets; else on one, or on all that follow where what sends is changed
  every = 2              # on every second of them; else on each
  chance = 0.5           # drawn from the seed of the cell; else 1
  robot = \"target\"       # where there are two; else the first

Effects of the catalogue are faults too, with their parameters and without a stream: dockhil effect list

";

const SEEN: &str = "
What the computer says, in reports and recordings:

";

/// All faults: `id`, what happens, parameters with their defaults, and for each stream the classes that the computer reports; then
/// what each class means.
pub fn text() -> String {
    let schema = serde_json::to_value(schemars::schema_for!(Action)).unwrap_or_default();
    let mut out = HEAD.to_owned();
    for action in schema["oneOf"].as_array().into_iter().flatten() {
        let Some(id) = action["properties"]["id"]["const"].as_str() else { continue };
        // Writing to a text cannot fail.
        let _ = writeln!(out, "{id}: {}", said(action));
        for (name, parameter) in
            action["properties"].as_object().into_iter().flatten().filter(|(name, _)| *name != "id")
        {
            let _ = writeln!(out, "  {name}{}: {}", default(action, name, parameter), said(parameter));
        }
        for row in TABLE.iter().filter(|row| row.id == id) {
            let classes =
                if row.classes.is_empty() { "not seen from the computer".to_owned() } else { row.classes.join(", ") };
            let _ = writeln!(out, "  on {}: {classes}", row.on.id());
        }
    }
    out += SEEN;
    for (class, meaning) in CLASSES {
        let _ = writeln!(out, "{class}: {meaning}");
    }
    out
}

fn said(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().replace('\n', " ")
}

fn default(action: &Value, name: &str, parameter: &Value) -> String {
    let required = action["required"].as_array().is_some_and(|all| all.iter().any(|one| one == name));
    match parameter.get("default") {
        Some(value) if !value.is_null() => format!(" = {value}"),
        _ if required => " (needed)".to_owned(),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_listed_with_its_streams_and_parameters() {
        let text = text();
        for row in TABLE {
            assert!(text.contains(&format!("\n{}: ", row.id)), "{} is missing", row.id);
            assert!(text.contains(&format!("  on {}: ", row.on.id())), "{}", row.on.id());
        }
        assert!(text.contains("  copies = 1: How many more"), "{text}");
        assert!(text.contains("  cycles (needed): "), "{text}");
    }
}
