//! Streams, each declared before its first sample.

mod subject;
mod signal;
mod schema;

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use crate::qos::Qos;
use crate::text::{self, LONGEST_NAME, LONGEST_PROSE};

pub use schema::Schema;
pub use signal::Signal;
pub use subject::{About, Subject};

/// Identifies a stream of a session, by its index in the session's [`Streams`](crate::streams::Streams).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StreamId(pub u32);

/// A stream: its name, its signal, its subject, and how to read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The ROS topic name, with its leading slash: `/robot1/battery_state`.
    pub name: String,
    /// The measured signal.
    pub signal: Signal,
    /// The kind of subject.
    pub about: About,
    /// The id of the subject: `robot1`, `p001`; empty for the team and the session.
    pub id: String,
    /// The device that measures: `battery_state`, `polar_h10`; may be empty.
    pub device: String,
    /// Whether the stream came from outside or was computed here.
    pub origin: Origin,
    /// The shape of the samples.
    pub shape: Shape,
    /// The channels of a sample, in order.
    pub channels: Vec<Channel>,
    /// The declared rate [Hz]; 0 if none is declared or the stream is irregular.
    pub rate_hz: f64,
    /// The names of the streams that it was computed from.
    pub inputs: Vec<String>,
    /// How the stream was computed: the method, with its window and its reference.
    pub method: String,
    /// The family of the feature that computed it, such as `heart`, `skin` or `deployment`; empty for a raw stream.
    pub family: String,
    /// The time span that each value covers; `None` if values are instantaneous.
    pub window: Option<Window>,
    /// The topic, if this stream holds the samples of another publisher of that topic: it is recorded, but no feature
    /// receives it. Empty for any other stream.
    pub beside: String,
    /// A description in one sentence.
    pub doc: String,
    /// The first publisher, with its id on the bus; empty if it is unknown or if we are the publisher. A bag stores it
    /// with the channel.
    pub publisher: String,
    /// The quality of service that publishers of the stream offer, or with which we publish it.
    pub qos: Vec<Qos>,
    /// Which components receive the stream. Not part of any message.
    pub audience: Audience,
}

impl Stream {
    /// A raw stream of the given name, subject and shape, with everything else empty.
    pub fn raw(name: impl Into<String>, subject: Subject, shape: Shape) -> Stream {
        Stream {
            name: name.into(),
            signal: Signal::Other,
            about: subject.about,
            id: subject.id,
            device: String::new(),
            origin: Origin::Raw,
            shape,
            channels: Vec::new(),
            rate_hz: 0.0,
            inputs: Vec::new(),
            method: String::new(),
            family: String::new(),
            window: None,
            beside: String::new(),
            doc: String::new(),
            publisher: String::new(),
            qos: Vec::new(),
            audience: Audience::Everybody,
        }
    }

    /// The heap memory of the stream [bytes].
    #[must_use]
    pub fn held_bytes(&self) -> usize {
        let Stream { name, id, device, method, family, beside, doc, publisher, .. } = self;
        let texts = [name, id, device, method, family, beside, doc, publisher];
        let channels = self.channels.iter().flat_map(|channel| [&channel.name, &channel.unit]);
        let texts = texts.into_iter().chain(&self.inputs).chain(channels);
        let schema_bytes = match &self.shape {
            Shape::Message(schema) => size_of::<Schema>() + schema.held_bytes(),
            _ => 0,
        };
        schema_bytes
            + texts.map(String::capacity).sum::<usize>()
            + self.channels.capacity() * size_of::<Channel>()
            + self.inputs.capacity() * size_of::<String>()
            + self.qos.capacity() * size_of::<Qos>()
    }

    /// A feature's stream, derived from `input`, named below it (`<input>/<family>`), about the same subject.
    pub fn derived(input: &Stream, family: &str, shape: Shape) -> Stream {
        let inputs = vec![input.name.clone()];
        let name = format!("{}/{family}", input.name);
        Stream { inputs, ..Stream::concluded(name, input.subject(), family, shape) }
    }

    /// A feature's stream with any name and subject.
    pub fn concluded(
        name: impl Into<String>,
        subject: Subject,
        family: &str,
        shape: Shape,
    ) -> Stream {
        let stream = Stream::raw(name, subject, shape);
        Stream { origin: Origin::Derived, family: family.to_owned(), ..stream }
    }

    /// Returns the stream for windows or phases, with a name below this one: `…/heart/w30`.
    #[must_use]
    pub fn over(mut self, window: Window) -> Stream {
        self.name = format!("{}/{window}", self.name);
        self.window = Some(window);
        self
    }

    /// Returns the stream with another name below this one: `…/deployment/events`.
    #[must_use]
    pub fn below(mut self, leaf: &str) -> Stream {
        self.name = format!("{}/{leaf}", self.name);
        self
    }

    /// The stream's only input, if the stream is named after it.
    pub fn input(&self) -> Option<&str> {
        match self.inputs.as_slice() {
            [input] if self.name.starts_with(input.as_str()) => Some(input),
            _ => None,
        }
    }

    /// The stream's name without its window: the same for all windows of a family on one input.
    pub fn windowless_name(&self) -> &str {
        let window = self.window.map(|window| format!("/{window}")).unwrap_or_default();
        self.name.strip_suffix(&window).unwrap_or(&self.name)
    }

    /// The stream of another publisher of the same topic; `number` is 2 for the second publisher.
    #[must_use]
    pub fn beside(&self, number: usize) -> Stream {
        let name = format!("{}/publisher_{number}", self.name);
        Stream { name, beside: self.name.clone(), ..self.clone() }
    }

    /// Whether the stream's health is published: true of every raw stream except the session's own events.
    pub fn has_health(&self) -> bool {
        let is_own = self.about == About::Session && self.shape == Shape::Event;
        self.origin == Origin::Raw && !is_own
    }

    /// Whether the stream is the link or battery state of a person's wearable, which is reported only when it changes,
    /// so that silence means nothing.
    pub fn is_reported_on_change(&self) -> bool {
        matches!(self.signal, Signal::Link | Signal::Battery)
            && self.about == About::Person
            && self.rate_hz == 0.0
    }

    /// Whether the stream is irregular by nature, so that silence means nothing: events, people's input, and the state
    /// of their wearables.
    pub fn is_irregular(&self) -> bool {
        self.shape == Shape::Event || self.signal == Signal::Input || self.is_reported_on_change()
    }

    /// The subject of the stream.
    pub fn subject(&self) -> Subject {
        Subject { about: self.about, id: self.id.clone() }
    }

    /// Returns the stream with these channels, each a name and a unit.
    #[must_use]
    pub fn with_channels(mut self, channels: &[(&str, &str)]) -> Stream {
        self.channels = channels.iter().map(|(name, unit)| Channel::new(*name, *unit)).collect();
        self
    }

    /// The index of the channel with this name.
    pub fn place_of(&self, channel: &str) -> Option<usize> {
        self.channels.iter().position(|each| each.name == channel)
    }

    /// Returns the stream with its texts [cut and cleaned](crate::text), and a valid rate. Derived streams may have
    /// longer names than their inputs.
    #[must_use]
    pub fn cleaned(mut self) -> Stream {
        let longest = match self.origin {
            Origin::Raw => LONGEST_NAME,
            Origin::Derived => DERIVED * LONGEST_NAME,
        };
        for text in
            [&mut self.name, &mut self.id, &mut self.device, &mut self.family, &mut self.beside]
        {
            *text = text::name(std::mem::take(text), longest);
        }
        for Channel { name, unit, .. } in &mut self.channels {
            *name = text::name(std::mem::take(name), longest);
            *unit = text::label(std::mem::take(unit), longest);
        }
        for text in &mut self.inputs {
            *text = text::name(std::mem::take(text), longest);
        }
        let longest_method = text::longest_method(self.channels.len());
        self.method = text::label(std::mem::take(&mut self.method), longest_method);
        for text in [&mut self.doc, &mut self.publisher] {
            *text = text::label(std::mem::take(text), LONGEST_PROSE);
        }
        if let Shape::Message(schema) = &mut self.shape {
            Schema::clean(schema);
        }
        if !(self.rate_hz.is_finite() && self.rate_hz >= 0.0) {
            self.rate_hz = 0.0;
        }
        self
    }
}

/// How many times longer the names of derived streams may be than the names of raw ones.
const DERIVED: usize = 4;

/// One number of each sample of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The channel's name. In a [`Shape::Message`] it is the path of the field (`pose.pose.position.x`) whose number is
    /// read from the message.
    pub name: String,
    /// The channel's unit, in SI (`V`, `m/s`, `1` for a fraction), as [`units`](crate::units) spells it.
    pub unit: String,
    /// The factor that converts the number in the message to `unit`.
    pub scale: f64,
}

impl Channel {
    /// A channel with a scale of 1.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Channel {
        Channel { name: name.into(), unit: unit.into(), scale: 1.0 }
    }
}

/// The span of a feature's values: `w30`, `w2_5` or `phases` in a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Window {
    /// Windows of this length.
    Of(Duration),
    /// Whole phases, each when it has ended.
    Phases,
}

impl Window {
    /// Windows of a length [s].
    pub fn of_secs(secs: f64) -> Window {
        Window::Of(Duration::try_from_secs_f64(secs).unwrap_or_default())
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Window::Of(length) => f.pad(&format!("w{}", length.as_secs_f64()).replace('.', "_")),
            Window::Phases => f.pad("phases"),
        }
    }
}

/// Who receives a stream, besides features and workers. Each audience includes those before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Audience {
    /// No sink: for data that are processed before anyone sees them, such as pictures in which faces must first be
    /// hidden.
    Workers,
    /// Sinks that [show it live](crate::sink::Sink::shows_live): it is neither recorded nor published.
    Live,
    /// Every sink.
    #[default]
    Everybody,
}

/// Whether a stream came from outside or was computed here. A replay reads raw streams and recomputes derived ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Origin {
    /// The stream came from outside, and is kept unchanged.
    Raw,
    /// The stream was computed here from raw streams.
    Derived,
}

/// The shape of a stream's samples; see [`Data`](crate::data::Data).
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// One reading, scalar or vector.
    Sample,
    /// Runs of samples.
    Wave,
    /// The named values of one window.
    Feature,
    /// Events.
    Event,
    /// The health of streams.
    Status,
    /// The streams themselves.
    Description,
    /// ROS messages of other programs, of this type.
    Message(Arc<Schema>),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_in_a_field_and_in_the_name() {
        let ecg = Stream::raw("/humans/persons/p001/strap/ecg", Subject::session(), Shape::Wave);
        let over = |window| Stream::derived(&ecg, "heart", Shape::Feature).over(window);
        for (window, leaf) in [
            (Window::of_secs(30.0), "w30"),
            (Window::of_secs(2.5), "w2_5"),
            (Window::Phases, "phases"),
        ] {
            let heart = over(window);
            assert_eq!(heart.name, format!("{}/heart/{leaf}", ecg.name));
            assert_eq!((heart.window, heart.family.as_str()), (Some(window), "heart"));
            assert_eq!(heart.windowless_name(), format!("{}/heart", ecg.name));
        }
    }

    #[test]
    fn a_topic_is_shown_within_its_subject() {
        let person = Subject { about: About::Person, id: "p001".into() };
        assert_eq!(person.within("/humans/persons/p001/strap/ecg"), "strap/ecg");
        assert_eq!(Subject::robot("r1").within("/r1/wifi"), "wifi");
        assert_eq!(Subject::team().within("/team/state"), "/team/state");
    }
}
