//! Streams of Lab Streaming Layer (LSL): EEG amplifiers, eye trackers, and markers of stimulus programs.

mod resolver;
mod probing;
mod connection;
mod inlet;
mod described;
mod grouping;
mod senders;
mod source;
mod multicast;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::Stream;
use teampulse_devices::lsl::{OWN, StreamInfo};

pub use described::{leaf, slug};
pub use multicast::{MulticastError, comes_back};
pub use resolver::{FoundStream, resolve};

use self::source::Inlets;
use crate::SourceContext;

/// Streams of Lab Streaming Layer (LSL), such as those of an EEG amplifier or an eye tracker, and markers of
/// `PsychoPy`, E-Prime or any other program.
///
/// Streams that teampulse itself offers, in this session or another one, are read only by `name` or `source_id`.
///
/// All matching streams are read, including those that appear later; a lost stream is read again when its sender is
/// back. Regular samples become waves and irregular ones samples, about a person or the session; texts, and numbers of
/// the type `Markers`, become markers. Samples have the sender's stamps; the sender's clock is probed as in LSL.
///
/// Only IPv4 is supported: a sender that LSL's configuration limits to IPv6 (`IPv6 = force`) is not found.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Lsl {
    /// The person that the streams are about, by pseudonym: `p001`. By default they are about the session.
    pub person: Option<String>,
    /// The name of the stream.
    pub name: Option<String>,
    /// The type of the stream: `EEG`, `Markers`, `Gaze`.
    pub stream_type: Option<String>,
    /// The id of the stream's source.
    pub source_id: Option<String>,
    /// The addresses of computers that multicast does not reach, which are queried directly: `["192.168.1.20"]`. This
    /// computer is always queried.
    pub peers: Vec<String>,
}

impl Component<dyn Source, SourceContext> for Lsl {
    const EXAMPLE: &'static str = "person = \"p001\"\nstream_type = \"EEG\"";

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        if let Some(person) = &self.person {
            crate::wearables::check_person(person)?;
        }
        let query = self.query()?;
        Ok(Box::new(Streams { inlets: Inlets::new(self, query) }))
    }
}

impl Lsl {
    /// Whether a stream that matches the query is read: streams of teampulse itself must be named, so that no session
    /// reads its own streams by their type.
    pub fn reads(&self, info: &StreamInfo) -> bool {
        let is_named = self.name.is_some() || self.source_id.is_some();
        is_named || !info.source_id.starts_with(OWN)
    }

    /// Whether a stream of a session is one that these settings read.
    pub fn is_read(&self, stream: &Stream) -> bool {
        described::is_read(self, stream)
    }

    /// Returns the query that finds the streams.
    pub fn query(&self) -> Result<String, SettingsError> {
        let conditions = [
            ("name", "name", &self.name),
            ("stream_type", "type", &self.stream_type),
            ("source_id", "source_id", &self.source_id),
        ];
        let mut query = Vec::new();
        for (setting, field, value) in conditions {
            let Some(value) = value else { continue };
            let quote = if value.contains('\'') { '"' } else { '\'' };
            if value.contains(quote) || value.chars().any(char::is_control) {
                let error = SettingsError::new(format!("`{value}` can't be queried"));
                return Err(error
                    .at(setting)
                    .with_hint("it contains both kinds of quotes, or a control character"));
            }
            query.push(format!("{field}={quote}{value}{quote}"));
        }
        if query.is_empty() {
            let error = SettingsError::new("the streams to read are not specified");
            let hint =
                "set name, stream_type or source_id; `teampulse scan` lists the streams in range";
            return Err(error.with_hint(hint));
        }
        Ok(query.join(" and "))
    }
}

/// A running source of LSL streams.
struct Streams {
    inlets: Inlets,
}

#[async_trait]
impl Source for Streams {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        self.inlets.run(outlet).await
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}
