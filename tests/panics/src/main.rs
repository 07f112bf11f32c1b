//! `teampulse` with components beside its own that panic or send nothing, for the test of what it does then.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse::Components;
use teampulse_core::data::Data;
use teampulse_core::feature::{Extractor, Feature, Outputs, Scope};
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, Entry, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Shape, Stream, StreamId, Subject};
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_sinks::{SINKS, SinkContext};
use teampulse_sources::{SOURCES, SourceContext};

/// The readings of a source before it panics, and the records of a sink.
const BEFORE: u64 = 50;

fn main() -> ExitCode {
    let sources = [Entry::new::<Numbers>("numbers")];
    let features = [Entry::new::<Clumsy>("clumsy")];
    let sinks = [Entry::new::<Dropping>("dropping")];
    teampulse::main_with(Components {
        sources: Vec::leak([SOURCES, &sources].concat()),
        features: Vec::leak([FEATURES, &features].concat()),
        sinks: Vec::leak([SINKS, &sinks].concat()),
        ..Components::default()
    })
}

/// Where something panics.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
enum At {
    #[default]
    Nowhere,
    /// In the component itself.
    Component,
    /// On a thread that a source has started.
    Thread,
    /// On the pump's thread, outside of any feature.
    Pump,
}

/// A number of a robot each 5 ms.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Numbers {
    /// The robot.
    id: String,
    /// Where it panics.
    #[serde(default)]
    panics: At,
    /// Whether it declares its stream and sends nothing.
    #[serde(default)]
    is_mute: bool,
}

impl Component<dyn Source, SourceContext> for Numbers {
    const EXAMPLE: &'static str = r#"id = "r1""#;

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        Ok(Box::new(self))
    }
}

#[async_trait]
impl Source for Numbers {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = Stream::raw(
            format!("/{}/number", self.id),
            Subject::robot(self.id.as_str()),
            Shape::Sample,
        );
        let stream = outlet.declare(stream.with_channels(&[("number", "1")]));
        if self.is_mute {
            outlet.closed().await;
        }
        let mut count = 0;
        while !outlet.is_closed() {
            let data = Data::Sample(Arc::new([count as f64]));
            outlet.offer(Reading {
                index: None,
                stream,
                device_time: None,
                source_time: None,
                data,
            });
            count += 1;
            if count == BEFORE {
                self.panic();
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        Ok(())
    }
}

impl Numbers {
    fn panic(&self) {
        assert_ne!(self.panics, At::Component, "the source stumbled");
        if self.panics == At::Thread {
            drop(std::thread::spawn(|| panic!("the thread stumbled")));
        }
    }
}

/// Computes nothing of numbers, and may panic at one.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Clumsy {
    /// Where it panics.
    panics: At,
}

impl Component<dyn Feature, FeatureContext> for Clumsy {
    const EXAMPLE: &'static str = r#"panics = "nowhere""#;

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        Ok(Box::new(self))
    }
}

impl Feature for Clumsy {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.name == "/r1/number"
    }

    fn scope(&self) -> Scope {
        Scope::Stream
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(AtWork { panics: self.panics, pushed: 0 })
    }
}

struct AtWork {
    panics: At,
    pushed: u64,
}

impl Extractor for AtWork {
    fn join(&mut self, _: StreamId, _: &Stream, _: &mut Outputs) {}

    fn push(&mut self, _: &Sample, _: &mut Outputs) {
        self.pushed += 1;
        assert!(self.panics != At::Component || self.pushed < BEFORE, "the feature stumbled");
    }
}

/// Keeps nothing, and panics.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Dropping {
    /// Where it panics.
    panics: At,
}

impl Component<dyn Sink, SinkContext> for Dropping {
    const EXAMPLE: &'static str = r#"panics = "component""#;

    fn build(self, _: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        Ok(Box::new(self))
    }
}

impl Sink for Dropping {
    fn name(&self) -> &'static str {
        "dropping"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    /// What a sink wants is asked on the pump's thread.
    fn wants(&self) -> Wants {
        let (panics, asked) = (self.panics, AtomicU64::new(0));
        Wants::Only(Box::new(move |stream| {
            let is_number = stream.name == "/r1/number";
            let asked = asked.fetch_add(u64::from(is_number), Ordering::Relaxed);
            assert!(panics != At::Pump || asked < BEFORE, "the pump stumbled");
            is_number
        }))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let mut received = 0;
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => received += batch.len() as u64,
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
            assert!(self.panics != At::Component || received < BEFORE, "the sink stumbled");
        }
    }
}
