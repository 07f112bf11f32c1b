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

/// A stream of a session, by its index in the session's [`Streams`](crate::streams::Streams).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StreamId(pub u32);

/// A stream: its name, its signal, its subject, and how to read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The ROS topic name, with its leading slash: `/robot1/battery_state`.
    pub name: String,
    /// The measured signal.
    pub signal: Signal,
    /// The kind of its subject.
    pub about: About,
    /// The id of its subject: `robot1`, `p001`; empty for the team and the session.
    pub id: String,
    /// The device that measures: `battery_state`, `polar_h10`; may be empty.
    pub device: String,
    /// Whether it came from outside or was computed here.
    pub origin: Origin,
    /// The shape of its samples.
    pub shape: Shape,
    /// The numbers of a sample, in their order.
    pub channels: Vec<Channel>,
    /// The declared rate [Hz]; 0 where none is declared or it is irregular.
    pub rate_hz: f64,
    /// The streams it was computed from, by name.
    pub inputs: Vec<String>,
    /// How it was computed: the recipe, with its window and its reference.
    pub method: String,
    /// The family of its feature, such as `heart`, `skin` or `deployment`; empty for a raw stream.
    pub family: String,
    /// The span of its values; `None` if they are instantaneous.
    pub window: Option<Window>,
    /// The topic of which this stream holds the samples of a second publisher: it is recorded, and no
    /// feature receives it. Empty for any other stream.
    pub beside: String,
    /// One sentence for readers.
    pub doc: String,
    /// Its first publisher, with the publisher's id on its bus; empty where that is unknown or
    /// ourselves. A bag keeps it with its channel.
    pub publisher: String,
    /// The quality of service that its publishers offer, or that it is published with.
    pub qos: Vec<Qos>,
    /// Which components receive it. No message mentions this.
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

    /// Its heap memory [bytes].
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

    /// A feature's stream of any name and subject.
    pub fn concluded(
        name: impl Into<String>,
        subject: Subject,
        family: &str,
        shape: Shape,
    ) -> Stream {
        let stream = Stream::raw(name, subject, shape);
        Stream { origin: Origin::Derived, family: family.to_owned(), ..stream }
    }

    /// The same stream over windows or phases, named below it: `…/heart/w30`.
    #[must_use]
    pub fn over(mut self, window: Window) -> Stream {
        self.name = format!("{}/{window}", self.name);
        self.window = Some(window);
        self
    }

    /// The same stream under another name below it: `…/deployment/events`.
    #[must_use]
    pub fn below(mut self, leaf: &str) -> Stream {
        self.name = format!("{}/{leaf}", self.name);
        self
    }

    /// The only input that it was derived from and is named after.
    pub fn input(&self) -> Option<&str> {
        match self.inputs.as_slice() {
            [input] if self.name.starts_with(input.as_str()) => Some(input),
            _ => None,
        }
    }

    /// Its name without its window: the same for all windows of a family on one input.
    pub fn windowless_name(&self) -> &str {
        let window = self.window.map(|window| format!("/{window}")).unwrap_or_default();
        self.name.strip_suffix(&window).unwrap_or(&self.name)
    }

    /// The stream of another publisher of the same topic: the second, the third, …
    #[must_use]
    pub fn beside(&self, number: usize) -> Stream {
        let name = format!("{}/publisher_{number}", self.name);
        Stream { name, beside: self.name.clone(), ..self.clone() }
    }

    /// Whether its health is published: that of every raw stream but the session's own events.
    pub fn has_health(&self) -> bool {
        let is_own = self.about == About::Session && self.shape == Shape::Event;
        self.origin == Origin::Raw && !is_own
    }

    /// Whether it is the state of a person's wearable, its link or battery, reported when it changes: a silence means
    /// nothing.
    pub fn is_reported_on_change(&self) -> bool {
        matches!(self.signal, Signal::Link | Signal::Battery)
            && self.about == About::Person
            && self.rate_hz == 0.0
    }

    /// Whether it is irregular by nature, so that a silence means nothing: events, people's input, and the state of
    /// their wearables.
    pub fn is_irregular(&self) -> bool {
        self.shape == Shape::Event || self.signal == Signal::Input || self.is_reported_on_change()
    }

    /// The subject of the stream.
    pub fn subject(&self) -> Subject {
        Subject { about: self.about, id: self.id.clone() }
    }

    /// The same stream with these channels, each a name and a unit.
    #[must_use]
    pub fn with_channels(mut self, channels: &[(&str, &str)]) -> Stream {
        self.channels = channels.iter().map(|(name, unit)| Channel::new(*name, *unit)).collect();
        self
    }

    /// The index of the channel with this name.
    pub fn place_of(&self, channel: &str) -> Option<usize> {
        self.channels.iter().position(|each| each.name == channel)
    }

    /// The same stream with its texts [cut and cleaned](crate::text), and a valid rate. Derived streams may
    /// have longer names than their inputs.
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

/// How many times longer the names of derived streams may be than those from outside.
const DERIVED: usize = 4;

/// One number of each sample of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name. In a [`Shape::Message`] it is the path of the field (`pose.pose.position.x`) whose
    /// number is read from the message.
    pub name: String,
    /// Its unit, in SI (`V`, `m/s`, `1` for a fraction), as [`units`](crate::units) spells it.
    pub unit: String,
    /// Factor from the message's own number to `unit`.
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
    /// Each phase, when it has ended.
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

/// Who receives a stream, besides features and workers. In order: who is let in later is let in by all before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Audience {
    /// Nobody else: what is worked on before anything of it is seen, such as pictures whose faces are still to be
    /// hidden.
    Workers,
    /// What [shows it live](crate::sink::Sink::shows_live), too: it is neither recorded nor published.
    Live,
    /// Every sink.
    #[default]
    Everybody,
}

/// Whether a stream came from outside or was computed here. A replay reads raw streams and computes
/// derived ones again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Origin {
    /// From outside, kept unchanged.
    Raw,
    /// Computed here from raw streams.
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
