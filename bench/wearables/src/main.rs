//! Runs `teampulse` with an additional sink, which measures the delay from the arrival of a wearable's reading to the
//! queue of a sink. The bag's queue is filled at the same moment.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse::Components;
use teampulse_core::clock::Clock;
use teampulse_core::registry::{Component, Entry, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{About, Origin};
use teampulse_sinks::{SINKS, SinkContext};

/// The largest number of delays kept: an hour of 1000 readings per second.
const MOST: usize = 3_600_000;

fn main() -> ExitCode {
    let sinks = [Entry::new::<Delays>("delays")];
    let sinks = Vec::leak([SINKS, &sinks].concat());
    teampulse::main_with(Components { sinks, ..Components::default() })
}

/// Writes the delays of all readings about people to a file, as JSON.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Delays {
    /// The path of the file.
    file: PathBuf,
    /// The time at the start of the session that does not count [s].
    after_secs: f64,
}

impl Component<dyn Sink, SinkContext> for Delays {
    const EXAMPLE: &'static str = "file = \"delays.json\"\nafter_secs = 20";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let clock = context.clock.clone();
        Ok(Box::new(Stopwatches { settings: self, clock, delays_ms: Vec::new() }))
    }
}

struct Stopwatches {
    settings: Delays,
    clock: Clock,
    delays_ms: Vec<f64>,
}

impl Sink for Stopwatches {
    fn name(&self) -> &'static str {
        "delays"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(|stream| {
            stream.about == About::Person && stream.origin == Origin::Raw
        }))
    }

    fn run(mut self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let began = self.clock.now();
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    let now = self.clock.now();
                    let delay_ms = |record: &Record| now.secs_since(record.sample.log_time) * 1e3;
                    if now.secs_since(began) >= self.settings.after_secs {
                        let room = MOST - self.delays_ms.len();
                        self.delays_ms.extend(batch.iter().map(delay_ms).take(room));
                    }
                }
                Received::Silence => {}
                Received::Closed => return self.write().map_err(|error| failed(&error)),
            }
        }
    }
}

impl Stopwatches {
    fn write(&self) -> io::Result<()> {
        let text = serde_json::to_string(&self.delays_ms)?;
        std::fs::write(&self.settings.file, text)
    }
}

fn failed(error: &io::Error) -> SinkError {
    SinkError::Failed { message: format!("write the delays: {error}"), hint: String::new() }
}
