//! `teampulse list`: lists the components that a study can use.

use clap::{Args, ValueEnum};
use teampulse_core::registry::Entry;

use crate::components::Components;
use crate::exit::Exit;
use crate::output;

/// Lists the components that a study can use, with their settings.
#[derive(Debug, Args)]
pub struct List {
    /// Only this kind
    what: Option<What>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    Sources,
    Features,
    Sinks,
    Workers,
}

impl List {
    /// Runs the command.
    pub fn run(self) -> Exit {
        let all = Components::of_this_program();
        let wanted = |what| self.what.is_none_or(|only| only == what);
        if wanted(What::Sources) {
            show("sources", all.sources);
        }
        if wanted(What::Features) {
            show("features", all.features);
        }
        if wanted(What::Sinks) {
            show("sinks", all.sinks);
        }
        if wanted(What::Workers) {
            show("workers", all.workers);
        }
        Exit::Fine
    }
}

fn show<T: ?Sized, C>(title: &str, entries: &[Entry<T, C>]) {
    output::line(title);
    for entry in entries {
        output::line(format!("  {}: {}", entry.kind, unescaped(&entry.summary())));
        for (name, text) in settings(&(entry.schema)()) {
            output::line(format!("      {name:<16} {text}"));
        }
    }
}

/// Returns the settings of a component, with the first sentence of their documentation and their defaults.
fn settings(schema: &schemars::Schema) -> Vec<(String, String)> {
    let properties = schema.get("properties").and_then(|each| each.as_object());
    let required = schema.get("required").and_then(|each| each.as_array());
    let is_required =
        |name: &str| required.is_some_and(|all| all.iter().any(|each| each.as_str() == Some(name)));
    let described = |(name, schema): (&String, &serde_json::Value)| {
        let text = schema.get("description").and_then(|text| text.as_str()).unwrap_or_default();
        let sentence = text.replace('\n', " ");
        let sentence = sentence.split(". ").next().unwrap_or_default();
        let left_out = if is_required(name) {
            " (required)".to_owned()
        } else {
            default(schema).map_or_else(String::new, |value| format!(" (default {value})"))
        };
        let sentence = if left_out.is_empty() { sentence } else { sentence.trim_end_matches('.') };
        (name.clone(), unescaped(&format!("{sentence}{left_out}")))
    };
    properties.into_iter().flatten().map(described).collect()
}

/// Converts documentation to plain text: rustdoc takes brackets for links unless they are escaped.
fn unescaped(doc: &str) -> String {
    doc.replace("\\[", "[").replace("\\]", "]")
}

/// Formats the default of a setting as TOML; `None` if there is no default, or an empty one.
fn default(schema: &serde_json::Value) -> Option<String> {
    use serde_json::Value;
    match schema.get("default")? {
        Value::Null => None,
        Value::Array(each) if each.is_empty() => None,
        Value::Object(each) if each.is_empty() => None,
        Value::String(text) if text.is_empty() => None,
        // Shows 5.0 as 5.
        Value::Number(number) => {
            Some(number.as_f64().map_or(number.to_string(), |n| n.to_string()))
        }
        value => Some(value.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use teampulse_features::FEATURES;
    use teampulse_sinks::SINKS;
    use teampulse_sources::SOURCES;

    use super::*;

    /// The description of a setting.
    fn reported<T: ?Sized, C>(entries: &[Entry<T, C>], kind: &str, name: &str) -> String {
        let entry = entries.iter().find(|entry| entry.kind == kind).unwrap();
        let settings = settings(&(entry.schema)());
        settings.into_iter().find(|(each, _)| each == name).unwrap().1
    }

    #[test]
    fn units_are_in_plain_brackets() {
        assert!(reported(SOURCES, "ttl", "baud").contains("[bit/s]"));
        assert_eq!(unescaped("speed \\[bit/s\\]"), "speed [bit/s]");
    }

    #[test]
    fn the_default_of_a_setting_is_reported() {
        for (kind, name, end) in [
            ("stuck", "stuck_secs", "[s] (default 30)"),
            ("link_quality", "weak_dbm", "[dBm] (default -75)"),
            ("heart", "windows_secs", "by default those of the study."),
        ] {
            assert!(reported(FEATURES, kind, name).ends_with(end), "{kind}: {name}");
        }
        for (kind, name, end) in [
            ("bag", "compression", "(default \"zstd\")"),
            ("bag", "on_failure", "(default \"retry\")"),
            ("bag", "tidy", "(default true)"),
            ("bag", "keep_free_mib", "(default 64)"),
            ("bag", "fallback", "it can't be started there."),
        ] {
            assert!(reported(SINKS, kind, name).ends_with(end), "{kind}: {name}");
        }
        assert!(reported(SOURCES, "topics", "names").ends_with("everything (required)"));
    }
}
