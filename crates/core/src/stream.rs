//! Streams: what there is to watch, declared before its first sample.

use std::fmt;
use std::sync::Arc;

use crate::qos::Qos;
use crate::text::{self, LONGEST_NAME, LONGEST_PROSE};

/// A stream of a session, by its place in the session's [`Streams`](crate::streams::Streams).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StreamId(pub u32);

/// A stream: what it is called, what it measures, about whom, and how to read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The ROS topic name, with its leading slash: `/robot1/battery_state`.
    pub name: String,
    /// What is measured.
    pub signal: Signal,
    /// What kind of subject it is about.
    pub about: About,
    /// The subject: `robot1`, `p001`; empty for the team and the session.
    pub id: String,
    /// The device that measures: `battery_state`, `polar_h10`; may be empty.
    pub device: String,
    /// Whether it came from outside or was computed here.
    pub origin: Origin,
    /// The shape of its samples.
    pub shape: Shape,
    /// The numbers of a sample, in their order.
    pub channels: Vec<Channel>,
    /// The rate that is declared [Hz]; 0 where none is or it is irregular.
    pub rate_hz: f64,
    /// The streams it was computed from, by name.
    pub inputs: Vec<String>,
    /// How it was computed: the recipe, with its window and its reference.
    pub method: String,
    /// One sentence for people.
    pub doc: String,
    /// Who published it first, with the id of the publisher on its bus; empty where that is unknown or
    /// ourselves. A bag keeps it with its channel.
    pub publisher: String,
    /// What its publishers offer, or with what it is to be published.
    pub qos: Vec<Qos>,
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
            doc: String::new(),
            publisher: String::new(),
            qos: Vec::new(),
        }
    }

    /// A stream derived from `input`, named below it (`<input>/<leaf>`), about the same subject.
    pub fn derived(input: &Stream, leaf: &str, shape: Shape) -> Stream {
        let mut stream = Stream::raw(format!("{}/{leaf}", input.name), input.subject(), shape);
        stream.origin = Origin::Derived;
        stream.inputs = vec![input.name.clone()];
        stream
    }

    /// What the stream of another publisher of a person's topic is called: the second, the third, …
    pub fn name_beside(topic: &str, number: usize) -> String {
        format!("{topic}{BESIDE}{number}")
    }

    /// The topic of which this is what another publisher sent than the one that is heard; `None` for any
    /// other stream. It is recorded, and no feature hears it.
    pub fn beside(&self) -> Option<&str> {
        let (topic, number) = self.name.rsplit_once(BESIDE)?;
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        let is_raw = self.about == About::Person && self.origin == Origin::Raw;
        (is_number && is_raw).then_some(topic)
    }

    /// Whom the stream is about.
    pub fn subject(&self) -> Subject {
        Subject { about: self.about, id: self.id.clone() }
    }

    /// The same stream with these channels, each a name and a unit.
    #[must_use]
    pub fn with_channels(mut self, channels: &[(&str, &str)]) -> Stream {
        self.channels = channels.iter().map(|(name, unit)| Channel::new(*name, *unit)).collect();
        self
    }

    /// The place of the channel of a name.
    pub fn place_of(&self, channel: &str) -> Option<usize> {
        self.channels.iter().position(|each| each.name == channel)
    }

    /// The same stream with its texts [cut and cleaned](crate::text), and a rate that is one. What is derived
    /// has longer names than what it was derived from.
    #[must_use]
    pub fn cleaned(mut self) -> Stream {
        let longest = match self.origin {
            Origin::Raw => LONGEST_NAME,
            Origin::Derived => DERIVED * LONGEST_NAME,
        };
        for text in [&mut self.name, &mut self.id, &mut self.device] {
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

/// So many times as long as the names of what comes from outside are those of what is derived, at most.
const DERIVED: usize = 4;

/// What stands between a topic and the number of another publisher.
const BESIDE: &str = "/publisher_";

/// One number of each sample of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// What it is called. In a [`Shape::Message`] it is the path of a field (`pose.pose.position.x`): the
    /// number that is read out of the message.
    pub name: String,
    /// Its unit, in SI (`V`, `m/s`, `1` for a fraction), as [`units`](crate::units) spells it.
    pub unit: String,
    /// Factor from the message's own number to `unit`.
    pub scale: f64,
}

impl Channel {
    /// A channel whose numbers are in its unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Channel {
        Channel { name: name.into(), unit: unit.into(), scale: 1.0 }
    }
}

/// Whom a stream is about.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Subject {
    /// The kind of subject.
    pub about: About,
    /// Its id; empty for the team and the session.
    pub id: String,
}

impl Subject {
    /// The robot of the given id.
    pub fn robot(id: impl Into<String>) -> Subject {
        Subject { about: About::Robot, id: id.into() }
    }

    /// The team as a whole.
    pub fn team() -> Subject {
        Subject { about: About::Team, id: String::new() }
    }

    /// The session itself.
    pub fn session() -> Subject {
        Subject { about: About::Session, id: String::new() }
    }
}

/// What kind of subject a stream is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum About {
    /// A person, by pseudonym.
    Person,
    /// A robot.
    Robot,
    /// The team as a whole.
    Team,
    /// The session: its phases, its losses, its own health.
    Session,
}

/// Whether a stream came from outside or was computed here. Raw streams are what a replay reads;
/// derived ones are what it computes again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Origin {
    /// From outside, kept as it came.
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
    /// Things that happen.
    Event,
    /// The health of streams.
    Status,
    /// The streams themselves.
    Description,
    /// ROS messages from elsewhere, of this type.
    Message(Arc<Schema>),
}

/// The type of a ROS message.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Schema {
    /// The full name: `sensor_msgs/msg/BatteryState`.
    pub name: String,
    /// How `text` is written: `ros2msg` or `ros2idl`.
    pub encoding: String,
    /// The definition with all that it depends on, as rosbag2 stores it in a bag; empty while
    /// unknown.
    pub text: String,
    /// The type hash, `RIHS01_` and 64 hexadecimal digits; empty where unknown.
    pub hash: String,
}

impl Schema {
    /// Cuts and cleans its name and what stands beside it; the definition stays as it came.
    fn clean(this: &mut Arc<Schema>) {
        let Schema { name, encoding, hash, .. } = &**this;
        if [name, encoding, hash].iter().all(|text| text::is_clean(text, LONGEST_NAME)) {
            return;
        }
        let Schema { name, encoding, hash, .. } = Arc::make_mut(this);
        for text in [name, encoding, hash] {
            *text = text::name(std::mem::take(text), LONGEST_NAME);
        }
    }
}

macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$each:meta])* $variant:ident = $word:literal),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $($(#[$each])* $variant),* }

        impl $name {
            /// Every word, in the order of the documentation.
            pub const ALL: &'static [$name] = &[$($name::$variant),*];

            /// The word itself, as it stands on the wire and in a bag.
            pub fn word(self) -> &'static str {
                match self { $($name::$variant => $word),* }
            }

            /// The value of a word; `None` for any other.
            pub fn from_word(word: &str) -> Option<$name> {
                match word { $($word => Some($name::$variant),)* _ => None }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.word())
            }
        }
    };
}
pub(crate) use words;

words! {
    /// What a stream measures: a closed list. A feature runs on every stream whose signal it
    /// accepts.
    Signal {
        /// Electrocardiogram.
        Ecg = "ecg",
        /// Photoplethysmogram (pulse wave).
        Ppg = "ppg",
        /// Electrodermal activity (skin conductance).
        Eda = "eda",
        /// Electromyogram.
        Emg = "emg",
        /// Electroencephalogram.
        Eeg = "eeg",
        /// Breathing.
        Respiration = "respiration",
        /// Temperature of a person or a device.
        Temperature = "temperature",
        /// Acceleration.
        Acceleration = "acceleration",
        /// Intervals between beats.
        Interval = "interval",
        /// Camera images.
        Image = "image",
        /// Sound.
        Audio = "audio",
        /// Keyboard, mouse and other input of a person.
        Input = "input",
        /// State of a battery.
        Battery = "battery",
        /// Quality of a radio link.
        Link = "link",
        /// Pose and speed of a robot.
        Odometry = "odometry",
        /// Diagnostics of a robot.
        Diagnostics = "diagnostics",
        /// Things that happen.
        Event = "event",
        /// Anything else.
        Other = "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_beside_a_person_s_topic_is_known_by_its_name() {
        let person = Subject { about: About::Person, id: "p001".into() };
        let ecg = "/humans/persons/p001/strap/ecg";
        let name = Stream::name_beside(ecg, 2);
        assert_eq!(Stream::raw(name, person.clone(), Shape::Wave).beside(), Some(ecg));
        for other in [ecg.to_owned(), format!("{ecg}/publisher_"), format!("{ecg}/publisher_x")] {
            assert_eq!(Stream::raw(other, person.clone(), Shape::Wave).beside(), None);
        }
        let robot = Stream::raw("/r1/publisher_2", Subject::robot("r1"), Shape::Sample);
        assert_eq!(robot.beside(), None);
    }
}
