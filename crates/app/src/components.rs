//! The sources, features, sinks and workers that a study can use.

use std::sync::OnceLock;

use teampulse_core::feature::Feature;
use teampulse_core::registry::Entry;
use teampulse_core::sink::Sink;
use teampulse_core::source::Source;
use teampulse_core::worker::Worker;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_sinks::{SINKS, SinkContext};
use teampulse_sources::{SOURCES, SourceContext};
use teampulse_workers::{WORKERS, WorkerContext};

/// The tables of a program's components: those of `teampulse`, or of a program with additional components.
#[derive(Clone, Copy)]
pub struct Components {
    /// The sources, by the names that a study uses.
    pub sources: &'static [Entry<dyn Source, SourceContext>],
    /// The features.
    pub features: &'static [Entry<dyn Feature, FeatureContext>],
    /// The sinks.
    pub sinks: &'static [Entry<dyn Sink, SinkContext>],
    /// The workers.
    pub workers: &'static [Entry<dyn Worker, WorkerContext>],
}

/// The tables of `teampulse`.
impl Default for Components {
    fn default() -> Components {
        Components { sources: SOURCES, features: FEATURES, sinks: SINKS, workers: WORKERS }
    }
}

/// The tables of this process: set once, when it starts.
static OF_THIS_PROGRAM: OnceLock<Components> = OnceLock::new();

impl Components {
    /// The tables of this process.
    pub(crate) fn of_this_program() -> Components {
        *OF_THIS_PROGRAM.get_or_init(Components::default)
    }

    /// The names of all kinds of sources, sinks and workers that a study can use.
    pub(crate) fn kinds(&self) -> Vec<&'static str> {
        let sources = self.sources.iter().map(|entry| entry.kind);
        let sinks = self.sinks.iter().map(|entry| entry.kind);
        sources.chain(sinks).chain(self.workers.iter().map(|entry| entry.kind)).collect()
    }

    /// Uses these tables from now on; only the first call counts.
    pub(crate) fn use_in_this_program(self) {
        OF_THIS_PROGRAM.get_or_init(|| self);
    }
}
