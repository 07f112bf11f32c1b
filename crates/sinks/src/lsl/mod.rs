//! Streams of the session on Lab Streaming Layer (LSL).

mod described;
mod encoding;
mod outlet;
mod responder;

use std::collections::BTreeMap;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Clock;
use teampulse_core::data::Data;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Record;
use teampulse_core::session_streams::{descriptions, session_events};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::Stream;
use teampulse_devices::lsl::Format;
use tokio::runtime::{Builder, Runtime};

use self::encoding::Encoder;
use self::outlet::Outlet;
use self::responder::Directory;
use crate::SinkContext;

/// The longest wait for a batch of input.
const PATIENCE: Duration = Duration::from_secs(1);
/// The time allowed for inlets to take the last samples when the session is over.
const FAREWELL: Duration = Duration::from_millis(300);

/// Offers streams of the session on Lab Streaming Layer (LSL), for `LabRecorder`, `OpenViBE`, BCI2000 or your own
/// programs.
///
/// Everyone on the network can read these streams, so only listed streams are offered, including those about people.
/// Stamps are from this computer's monotonic clock, like those of other LSL programs on it; numbers are in the units of
/// their channels. Markers, phases and reports are sent as texts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lsl {
    /// The topics of the streams; a `*` stands for any part of a name, and `**` for the rest of it:
    /// `["/humans/persons/p001/*/ecg", "/session/events"]`.
    pub streams: Vec<String>,
    /// The format of numbers.
    #[serde(default)]
    pub format: NumberFormat,
}

/// The format of numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NumberFormat {
    /// 64 bits, as recorded.
    #[default]
    Double64,
    /// 32 bits, for programs that read nothing else.
    Float32,
}

impl Component<dyn Sink, SinkContext> for Lsl {
    const EXAMPLE: &'static str = r#"streams = ["/humans/persons/p001/*/ecg", "/session/events"]"#;

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        if self.streams.is_empty() {
            let error = SettingsError::new("no stream is listed").at("streams");
            return Err(error.with_hint("list topics, such as [\"/humans/persons/p001/*/ecg\"]"));
        }
        let pattern = |(place, text): (usize, &String)| {
            let pattern = Pattern::parse(text);
            pattern.map_err(|error| SettingsError::new(error).at(format!("streams.{place}")))
        };
        let wanted = self.streams.iter().enumerate().map(pattern).collect::<Result<_, _>>()?;
        let format = match self.format {
            NumberFormat::Double64 => Format::Double64,
            NumberFormat::Float32 => Format::Float32,
        };
        let (clock, session) = (context.clock.clone(), context.session.clone());
        Ok(Box::new(Outlets { wanted, format, clock, session, served: BTreeMap::new() }))
    }
}

/// The running sink, with the streams that it offers.
struct Outlets {
    wanted: Vec<Pattern>,
    format: Format,
    clock: Clock,
    session: String,
    /// The streams by topic; `None` for one that can't be offered.
    served: BTreeMap<String, Option<Served>>,
}

/// A stream that is offered.
struct Served {
    outlet: Outlet,
    encoder: Encoder,
}

impl Outlets {
    fn take(&mut self, record: &Record, network: &Network<'_>) {
        if let Data::Description(stream) = &record.sample.data {
            if self.is_wanted(stream) {
                self.serve(stream, network);
            }
            return;
        }
        let stream = &record.stream;
        if !self.served.contains_key(&stream.name) {
            self.serve(stream, network);
        }
        let served = self.served.get_mut(&stream.name).and_then(Option::as_mut);
        let Some(Served { outlet, encoder }) = served else { return };
        let ahead_nanos = self.clock.ahead_of_monotonic_nanos();
        if let Some(bytes) = encoder.encode(&record.sample, ahead_nanos) {
            outlet.send(bytes);
        }
    }

    fn is_wanted(&self, stream: &Stream) -> bool {
        self.wanted.iter().any(|pattern| pattern.matches(&stream.name))
    }

    /// Offers a stream, or replaces the offer if its channels have changed.
    fn serve(&mut self, stream: &Stream, network: &Network<'_>) {
        let known = self.served.get(&stream.name).and_then(Option::as_ref);
        let Some(info) = described::info(stream, self.format, &self.session) else { return };
        let is_same = |served: &Served| {
            let known = served.outlet.info();
            (known.channel_count, known.rate_hz) == (info.channel_count, info.rate_hz)
                && known.channels == info.channels
        };
        if known.is_some_and(is_same) {
            return;
        }
        // The earlier outlet ends here, and its inlets find the new one by its source id.
        self.served.remove(&stream.name);
        let opened = network.runtime.block_on(Outlet::open(info, &network.directory));
        let served = match (opened, Encoder::new(stream, self.format)) {
            (Ok(outlet), Some(encoder)) => Some(Served { outlet, encoder }),
            (Err(error), _) => {
                network.inbox.report(format!("lsl: {} is not offered: {error}", stream.name));
                None
            }
            (Ok(_), None) => {
                let name = &stream.name;
                network.inbox.report(format!(
                    "lsl: {name} is not offered: its messages have no numbers that can be read"
                ));
                None
            }
        };
        self.served.insert(stream.name.clone(), served);
    }
}

/// What is needed to offer streams.
struct Network<'a> {
    runtime: &'a Runtime,
    directory: Directory,
    inbox: &'a Inbox,
}

impl Sink for Outlets {
    fn name(&self) -> &'static str {
        "lsl"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        let wanted = self.wanted.clone();
        let described = descriptions().name;
        Wants::Only(Box::new(move |stream| {
            stream.name == described || wanted.iter().any(|pattern| pattern.matches(&stream.name))
        }))
    }

    fn run(mut self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let failed = |what: &str, error: std::io::Error| SinkError::Failed {
            message: format!("{what}: {error}"),
            hint: "check that this computer is on a network".into(),
        };
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.map_err(|error| failed("start LSL", error))?;
        let directory = Directory::default();
        let responder = {
            let _context = runtime.enter();
            responder::open()
        };
        let responder = responder.map_err(|error| failed("listen for LSL discovery", error))?;
        runtime.spawn(responder::respond(responder, directory.clone()));
        let network = Network { runtime: &runtime, directory, inbox: &inbox };
        // This stream is only declared with its first event, which a program would miss that looks for the stream
        // before.
        let events = session_events();
        if self.is_wanted(&events) {
            self.serve(&events, &network);
        }
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => {
                    batch.iter().for_each(|record| self.take(record, &network));
                }
                Received::Silence => {}
                Received::Closed => break,
            }
        }
        self.served.clear();
        runtime.shutdown_timeout(FAREWELL);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
