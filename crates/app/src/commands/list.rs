//! `teampulse list`: what can stand in a study.

use clap::{Args, ValueEnum};
use teampulse_core::registry::Entry;
use teampulse_features::FEATURES;
use teampulse_sinks::SINKS;
use teampulse_sources::SOURCES;

use crate::exit::Exit;
use crate::output;

/// Lists what can stand in a study, with its settings.
#[derive(Debug, Args)]
pub struct List {
    /// Only these
    what: Option<What>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    Sources,
    Features,
    Sinks,
}

impl List {
    /// Does it.
    pub fn run(self) -> Exit {
        let wanted = |what| self.what.is_none_or(|only| only == what);
        if wanted(What::Sources) {
            show("sources", SOURCES);
        }
        if wanted(What::Features) {
            show("features", FEATURES);
        }
        if wanted(What::Sinks) {
            show("sinks", SINKS);
        }
        Exit::Fine
    }
}

fn show<T: ?Sized, C>(title: &str, entries: &[Entry<T, C>]) {
    output::line(title);
    for entry in entries {
        output::line(format!("  {}: {}", entry.kind, entry.summary()));
        for (name, text) in settings(&(entry.schema)()) {
            output::line(format!("      {name:<16} {text}"));
        }
    }
}

/// The settings of a component with the first sentence of their documentation.
fn settings(schema: &schemars::Schema) -> Vec<(String, String)> {
    let properties = schema.get("properties").and_then(|each| each.as_object());
    let described = |(name, schema): (&String, &serde_json::Value)| {
        let text = schema.get("description").and_then(|text| text.as_str()).unwrap_or_default();
        let sentence = text.split(". ").next().unwrap_or_default().replace('\n', " ");
        (name.clone(), sentence)
    };
    properties.into_iter().flatten().map(described).collect()
}
