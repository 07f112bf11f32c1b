//! The streams on which a program publishes readings.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::SettingsError;
use teampulse_core::stream::{About, Channel, Shape, Stream, StreamId, Subject};
use teampulse_core::units;
use teampulse_core::worker::WorkerError;

/// A stream of a program's readings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Offer {
    /// The name of the stream, as a ROS topic: `/humans/persons/p001/own/attention`.
    pub name: String,
    /// The person that the stream is about. Nothing about a person is published unless `publish` names it.
    #[serde(default)]
    pub person: Option<String>,
    /// The robot that the stream is about; without a robot or a person, the stream is about the team.
    #[serde(default)]
    pub robot: Option<String>,
    /// The values of a reading, in order. Without channels the readings are events.
    #[serde(default)]
    pub channels: Vec<OfferedChannel>,
    /// A description in one sentence.
    #[serde(default)]
    pub doc: String,
}

/// One value of each reading.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OfferedChannel {
    /// The name of the value.
    pub name: String,
    /// The unit of the value: `uS`, `m/s`; `1` for a number without a unit.
    pub unit: String,
}

impl Offer {
    /// Fails if this is not a valid stream of a session.
    pub(super) fn check(&self) -> Result<(), SettingsError> {
        let fits = |token: &str| {
            let is_plain = |each: char| each.is_ascii_alphanumeric() || each == '_';
            token.chars().all(is_plain)
                && !token.is_empty()
                && !token.starts_with(|each: char| each.is_ascii_digit())
        };
        let tokens = self.name.strip_prefix('/').unwrap_or_default();
        if !tokens.split('/').all(fits) {
            let error = SettingsError::new(format!("`{}` is not a valid topic name", self.name));
            return Err(error
                .at("name")
                .with_hint("use one such as \"/humans/persons/p001/own/attention\""));
        }
        if self.person.is_some() && self.robot.is_some() {
            let error = SettingsError::new("it is about both a person and a robot").at("robot");
            return Err(error.with_hint("remove one of them"));
        }
        Ok(())
    }

    fn subject(&self) -> Subject {
        match (&self.person, &self.robot) {
            (Some(id), _) => Subject { about: About::Person, id: id.clone() },
            (_, Some(id)) => Subject::robot(id.clone()),
            _ => Subject::team(),
        }
    }

    fn stream(&self, inputs: &[Pattern]) -> Stream {
        let shape = if self.channels.is_empty() { Shape::Event } else { Shape::Sample };
        let channels = self
            .channels
            .iter()
            .map(|channel| Channel::new(&channel.name, units::spelt(&channel.unit)));
        Stream {
            channels: channels.collect(),
            inputs: inputs.iter().map(|pattern| pattern.text().to_owned()).collect(),
            doc: self.doc.clone(),
            ..Stream::raw(&self.name, self.subject(), shape)
        }
    }
}

/// The declared streams of a program's readings.
pub(super) struct Declared {
    /// The id of each stream and the number of values of a reading, by name.
    streams: BTreeMap<String, (StreamId, usize)>,
    /// The number of the session's streams that have been compared with these.
    compared: usize,
}

impl Declared {
    pub(super) fn new(offers: &[Offer], inputs: &[Pattern], outlet: &Outlet) -> Declared {
        let declare = |offer: &Offer| {
            let stream = outlet.declare(offer.stream(inputs));
            (offer.name.clone(), (stream, offer.channels.len()))
        };
        Declared { streams: offers.iter().map(declare).collect(), compared: 0 }
    }

    /// Fails if another stream of the session has one of these names.
    pub(super) fn check(&mut self, outlet: &Outlet) -> Result<(), WorkerError> {
        let Some(name) = self.taken(outlet) else { return Ok(()) };
        let message = format!("offer {name}: the session already has a stream with that name");
        let hint = "use a unique name, such as \"/humans/persons/p001/own/attention\"";
        Err(WorkerError { message, hint: hint.into() })
    }

    fn taken(&mut self, outlet: &Outlet) -> Option<String> {
        let new = outlet.streams().after(self.compared);
        self.compared += new.len();
        let is_another =
            |id: StreamId, name: &str| self.get(name).is_some_and(|(own, _)| own != id);
        let mut taken = new.into_iter().filter(|(id, stream)| is_another(*id, &stream.name));
        taken.next().map(|(_, stream)| stream.name.clone())
    }

    /// The id of a stream, and the number of values per reading, which is 0 for events.
    pub(super) fn get(&self, name: &str) -> Option<(StreamId, usize)> {
        self.streams.get(name).copied()
    }

    /// The names of the streams.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.streams.keys().map(String::as_str)
    }
}
