//! The description of a stream for a browser.

use serde::Serialize;
use teampulse_core::stream::{Audience, Origin, Shape, Stream as Declared, StreamId, Window};

/// A stream of the session, as programs receive it, and as a page knows it once it is [declared](super::Declared) and
/// described.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Stream {
    /// The number of the stream in this session, by which all other messages refer to it.
    pub id: u32,
    /// The ROS topic of the stream.
    pub name: String,
    /// What the stream measures: `ecg`, `eda`, `battery`, `event`, … (a closed list).
    pub signal: &'static str,
    /// The kind of subject: `person`, `robot`, `team` or `session`.
    pub about: &'static str,
    /// The id of that person or robot; empty for the team and the session.
    pub subject: String,
    /// The measuring device; may be empty.
    pub device: String,
    /// Whether the stream was computed here; otherwise it is raw.
    pub derived: bool,
    /// The shape of the data: `sample`, `wave`, `feature`, `event`, or `message` for a ROS message from elsewhere.
    pub shape: &'static str,
    /// The type of the messages, such as `nav_msgs/msg/Odometry`; empty for our own shapes.
    pub message_type: String,
    /// The values of each sample, in order.
    pub channels: Vec<Channel>,
    /// The declared rate [Hz]; 0 if none is declared or the rate is irregular.
    pub rate_hz: f64,
    /// How the stream was computed, as a recipe; empty for a raw stream.
    pub method: String,
    /// The family of the feature: `heart`, `skin`; empty for a raw stream.
    pub family: String,
    /// The time span that each value covers; `null` if the values are instantaneous.
    pub window: Option<Span>,
    /// The topics of the streams from which this one was computed.
    pub inputs: Vec<String>,
    /// The topic, if this stream holds the samples of a second publisher on it; empty for any other stream.
    pub beside: String,
    /// A sentence that describes the stream to people.
    pub doc: String,
    /// Whether this viewer receives no data of the stream because it would unblind them; see `show_estimates`.
    pub hidden: bool,
    /// Whether the data goes to workers only and is never shown, such as pictures of a camera in which faces must first
    /// be hidden.
    pub private: bool,
}

/// A channel of a stream: one value of each sample.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Channel {
    /// The name of the channel; for a ROS message, the path of the field.
    pub name: String,
    /// The unit of the channel in ASCII: `uS`, `degC`, `1/min`, `1` for a fraction.
    pub unit: String,
}

/// The time span that each value of a feature covers.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Span {
    /// Windows of this length [s].
    Secs(f64),
    /// Each phase, once it is over.
    Phases,
}

impl Stream {
    /// A declared stream, as a viewer gets it from whom it is `hidden` or not.
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
