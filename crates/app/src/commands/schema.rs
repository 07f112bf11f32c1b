//! `teampulse schema`: prints the JSON schema of a study.

use schemars::SchemaGenerator;
use serde_json::{Value, json};
use teampulse_core::registry::Entry;
use teampulse_sources::simulated::SimulatedTeam;

use crate::components::Components;
use crate::exit::Exit;
use crate::output;
use crate::study::General;

/// Runs the command.
pub fn run() -> Exit {
    output::json(&study());
    Exit::Fine
}

/// Builds the schema of a whole study.
pub(crate) fn study() -> Value {
    let all = Components::of_this_program();
    let mut schema = SchemaGenerator::default().into_root_schema_for::<General>().to_value();
    schema["title"] = json!("teampulse study");
    for entry in all.features {
        let settings = &mut schema["$defs"]["FeatureSettings"]["properties"][entry.kind];
        *settings = (entry.schema)().to_value();
    }
    let properties = &mut schema["properties"];
    properties["sources"] = json!({ "type": "array", "items": { "oneOf": variants(all.sources) } });
    properties["sinks"] = json!({ "type": "array", "items": { "oneOf": variants(all.sinks) } });
    properties["workers"] = json!({ "type": "array", "items": { "oneOf": variants(all.workers) } });
    properties["simulate"] = schemars::schema_for!(SimulatedTeam).to_value();
    schema
}

/// Builds a schema of each kind of component, with its `type`.
fn variants<T: ?Sized, C>(entries: &[Entry<T, C>]) -> Vec<Value> {
    let variant = |entry: &Entry<T, C>| {
        let mut schema = (entry.schema)().to_value();
        schema["properties"]["type"] = json!({ "const": entry.kind });
        match schema["required"].as_array_mut() {
            Some(required) => required.push(json!("type")),
            None => schema["required"] = json!(["type"]),
        }
        schema
    };
    entries.iter().map(variant).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_knows_the_settings_of_every_feature() {
        let schema = study();
        assert_eq!(schema["properties"]["features"]["$ref"], "#/$defs/FeatureSettings");
        let features = &schema["$defs"]["FeatureSettings"]["properties"];
        assert_eq!(features["windows_secs"]["type"], "array");
        assert_eq!(features["state"]["properties"]["stale_secs"]["type"], "number");
        let entries = Components::default().features;
        assert!(entries.iter().all(|entry| features[entry.kind]["type"] == "object"));
    }
}
