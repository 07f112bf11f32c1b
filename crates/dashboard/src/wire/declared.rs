//! The declaration of streams to a page, in which values shared by many streams appear only once.

use std::collections::BTreeMap;

use serde::Serialize;

use super::stream::{Span, Stream};

/// New streams, and streams whose declaration changed.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Declared {
    /// The subjects and devices of the streams, without duplicates.
    pub whose: Vec<Whose>,
    /// The channel lists of the streams, without duplicates.
    pub channels: Vec<ChannelList>,
    /// The streams.
    pub streams: Vec<StreamRow>,
}

/// A subject and the device that measures it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Whose {
    /// The kind of subject: `person`, `robot`, `team` or `session`.
    pub about: &'static str,
    /// The id of that person or robot; empty for the team and the session.
    pub subject: String,
    /// The device; may be empty.
    pub device: String,
}

/// The channels of each sample, in order.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ChannelList {
    /// The names of the channels.
    pub names: Vec<String>,
    /// The units of the channels.
    pub units: Vec<String>,
}

/// A stream without its descriptive text, which `describe` requests. Omitted fields are empty, false or 0.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[cfg_attr(test, ts(optional_fields))]
pub struct StreamRow {
    /// The number of the stream in this session.
    pub id: u32,
    /// The ROS topic of the stream.
    pub name: String,
    /// What the stream measures.
    pub signal: &'static str,
    /// The shape of the data.
    pub shape: &'static str,
    /// The index of the subject and device in `whose`.
    pub whose: u32,
    /// The index of the channel list in `channels`.
    pub channels: u32,
    /// The type of the messages.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message_type: Option<String>,
    /// Whether the stream was computed here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derived: Option<bool>,
    /// The declared rate [Hz].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// The family of the feature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
    /// The time span that each value covers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Span>,
    /// The numbers of the streams from which this one was computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inputs: Option<Vec<u32>>,
    /// The topic, if this stream holds the samples of a second publisher on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beside: Option<String>,
    /// Whether this viewer receives no data of the stream.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hidden: Option<bool>,
    /// Whether the data goes to workers only and is never shown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub private: Option<bool>,
}

/// The descriptive text of a stream: the answer to `describe`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Description {
    /// The stream's number.
    pub stream: u32,
    /// The recipe by which the stream was computed; empty for a raw stream.
    pub method: String,
    /// A sentence that describes the stream to people.
    pub doc: String,
}

impl Declared {
    /// The declaration of these streams; `number` returns the number of an input by its topic.
    pub fn of(streams: Vec<Stream>, number: impl Fn(&str) -> Option<u32>) -> Declared {
        let (mut whose, mut channels) = (Shared::default(), Shared::default());
        let rows = streams.into_iter().map(|stream| {
            let Stream { about, subject, device, .. } = stream;
            let (names, units) = stream.channels.into_iter().map(|it| (it.name, it.unit)).unzip();
            let inputs = stream.inputs.iter().filter_map(|name| number(name)).collect();
            StreamRow {
                id: stream.id,
                name: stream.name,
                signal: stream.signal,
                shape: stream.shape,
                whose: whose.place(Whose { about, subject, device }),
                channels: channels.place(ChannelList { names, units }),
                message_type: Some(stream.message_type).filter(|text| !text.is_empty()),
                derived: stream.derived.then_some(true),
                rate_hz: Some(stream.rate_hz).filter(|rate| *rate != 0.0),
                family: Some(stream.family).filter(|text| !text.is_empty()),
                window: stream.window,
                inputs: Some(inputs).filter(|inputs: &Vec<u32>| !inputs.is_empty()),
                beside: Some(stream.beside).filter(|text| !text.is_empty()),
                hidden: stream.hidden.then_some(true),
                private: stream.private.then_some(true),
            }
        });
        let streams = rows.collect();
        Declared { whose: whose.all, channels: channels.all, streams }
    }
}

/// A list without duplicates.
struct Shared<T> {
    all: Vec<T>,
    places: BTreeMap<T, u32>,
}

impl<T> Default for Shared<T> {
    fn default() -> Shared<T> {
        Shared { all: Vec::new(), places: BTreeMap::new() }
    }
}

impl<T: Clone + Ord> Shared<T> {
    fn place(&mut self, value: T) -> u32 {
        let next = self.all.len() as u32;
        *self.places.entry(value.clone()).or_insert_with(|| {
            self.all.push(value);
            next
        })
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Channel, Shape, Stream as Core, StreamId, Subject};

    use super::*;

    #[test]
    fn what_streams_share_comes_once_and_inputs_by_their_numbers() {
        let stream = |id, name: &str, inputs: &[&str]| {
            let mut stream = Core::raw(name, Subject::robot("robot1"), Shape::Sample);
            stream.channels = vec![Channel::new("voltage", "V")];
            stream.inputs = inputs.iter().map(|name| (*name).into()).collect();
            stream.method = "a long recipe".into();
            Stream::of(StreamId(id), &stream, false)
        };
        let streams = vec![stream(4, "/a", &[]), stream(7, "/b", &["/a", "/unknown"])];
        let declared = Declared::of(streams, |name| (name == "/a").then_some(4));
        assert_eq!((declared.whose.len(), declared.channels.len()), (1, 1));
        assert_eq!(declared.streams[1].inputs, Some(vec![4]));
        let text = serde_json::to_string(&declared).unwrap();
        assert!(!text.contains("recipe") && !text.contains("hidden"), "{text}");
    }
}
