//! What a stream is, for a browser.

use serde::Serialize;
use teampulse_core::stream::{Audience, Origin, Shape, Stream as Declared, StreamId, Window};

/// A stream of the session, as programs get it, and as a page has it once it is [declared](super::Declared) and
/// described.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Stream {
    /// Its number in this session, by which all other messages name it.
    pub id: u32,
    /// Its ROS topic.
    pub name: String,
    /// What it measures: `ecg`, `eda`, `battery`, `event`, … (a closed list).
    pub signal: &'static str,
    /// What it is about: `person`, `robot`, `team` or `session`.
    pub about: &'static str,
    /// The id of that person or robot; empty for the team and the session.
    pub subject: String,
    /// The device that measures; may be empty.
    pub device: String,
    /// Whether it was computed here; otherwise it is raw.
    pub derived: bool,
    /// `sample`, `wave`, `feature`, `event`, or `message` for a ROS message from elsewhere.
    pub shape: &'static str,
    /// The type of its messages, `nav_msgs/msg/Odometry`; empty for our own shapes.
    pub message_type: String,
    /// The numbers of each sample, in their order.
    pub channels: Vec<Channel>,
    /// The declared rate [Hz]; 0 where none is declared or it is irregular.
    pub rate_hz: f64,
    /// How it was computed: the recipe; empty for a raw stream.
    pub method: String,
    /// The family of its feature, `heart`, `skin`; empty for a raw stream.
    pub family: String,
    /// The span of its values; `null` where they are instantaneous.
    pub window: Option<Span>,
    /// The streams it was computed from, by topic.
    pub inputs: Vec<String>,
    /// The topic whose second publisher's samples this holds; empty for any other stream.
    pub beside: String,
    /// One sentence for people.
    pub doc: String,
    /// Whether this viewer gets no data of it because it would unblind them; see `show_estimates`.
    pub hidden: bool,
    /// Whether its data goes to workers only and is never shown: the pictures of a camera whose faces are hidden first.
    pub private: bool,
}

/// One number of each sample of a stream.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Channel {
    /// Its name; for a ROS message the path of the field.
    pub name: String,
    /// Its unit in ASCII: `uS`, `degC`, `1/min`, `1` for a fraction.
    pub unit: String,
}

/// The span of a feature's values.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Span {
    /// Windows of this length [s].
    Secs(f64),
    /// Each phase, when it is over.
    Phases,
}

impl Stream {
    /// A declared stream, for a viewer from whom it is hidden or not.
    pub fn of(id: StreamId, stream: &Declared, hidden: bool) -> Stream {
        let channel = |channel: &teampulse_core::stream::Channel| Channel {
            name: channel.name.clone(),
            unit: channel.unit.clone(),
        };
        let (shape, message_type) = shape(&stream.shape);
        Stream {
            id: id.0,
            name: stream.name.clone(),
            signal: stream.signal.word(),
            about: stream.about.word(),
            subject: stream.id.clone(),
            device: stream.device.clone(),
            derived: stream.origin == Origin::Derived,
            shape,
            message_type,
            channels: stream.channels.iter().map(channel).collect(),
            rate_hz: stream.rate_hz,
            method: stream.method.clone(),
            family: stream.family.clone(),
            window: stream.window.map(|window| match window {
                Window::Of(length) => Span::Secs(length.as_secs_f64()),
                Window::Phases => Span::Phases,
            }),
            inputs: stream.inputs.clone(),
            beside: stream.beside.clone(),
            doc: stream.doc.clone(),
            hidden,
            private: stream.audience == Audience::Workers,
        }
    }
}

fn shape(shape: &Shape) -> (&'static str, String) {
    match shape {
        Shape::Sample => ("sample", String::new()),
        Shape::Wave => ("wave", String::new()),
        Shape::Feature => ("feature", String::new()),
        Shape::Event => ("event", String::new()),
        Shape::Status => ("status", String::new()),
        Shape::Description => ("description", String::new()),
        Shape::Message(schema) => ("message", schema.name.clone()),
    }
}
