//! The topics of the package: a table of the streams they become and how their numbers are read.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::stream::{Channel, Shape, Signal, Stream, Subject};
use teampulse_core::time::Time;
use teampulse_messages::catalogue::shipped;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::Fields;

use crate::ros_people::NAMESPACE;

/// Whether a device is one of the package's sensors.
pub(super) fn is_sensor(device: &str) -> bool {
    ROWS.iter().any(|row| row.topic.0 == device)
}

/// The longest time between the two bytes of an interval [s].
const BYTES_APART_SECS: f64 = 0.25;
/// The actual rate of a Shimmer3 set to 50 Hz [Hz].
const SHIMMER_HZ: f64 = 32768.0 / 655.0;

/// A topic and the stream that it becomes.
struct Row {
    /// The names of the sensor and of its quantity.
    topic: (&'static str, &'static str),
    kind: &'static str,
    /// The last token of the stream's name.
    leaf: &'static str,
    signal: Signal,
    channels: &'static [&'static str],
    /// The index of the first channel in an array.
    first: usize,
    unit: &'static str,
    rate_hz: f64,
    read: Read,
}

/// How a topic's numbers are read.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Read {
    Times(f64),
    /// A conductance [uS] from a resistance [kOhm].
    Inverted,
    /// The low byte of an interval, which yields nothing by itself.
    LowByte,
    /// The high byte, which completes an interval.
    HighByte,
    /// A marker.
    Marker,
}

const FLOAT: &str = "std_msgs/msg/Float32";
const ARRAY: &str = "std_msgs/msg/Float32MultiArray";
const INT: &str = "std_msgs/msg/Int32";
const EMPTY: &str = "std_msgs/msg/Empty";
const E4: &str = "empatica_e4";
const H10: &str = "polar_h10";
const SHIMMER: &str = "shimmer3_gsr";
const BELT: &str = "vernier_respiration_belt";

impl Row {
    const fn new(
        topic: (&'static str, &'static str),
        leaf: &'static str,
        signal: Signal,
        unit: &'static str,
        rate_hz: f64,
    ) -> Row {
        let (kind, read) = (FLOAT, Read::Times(1.0));
        Row { topic, kind, leaf, signal, channels: &[], first: 0, unit, rate_hz, read }
    }

    const fn reading(self, kind: &'static str, read: Read) -> Row {
        Row { kind, read, ..self }
    }

    const fn array(self, channels: &'static [&'static str], first: usize, scale: f64) -> Row {
        Row { kind: ARRAY, channels, first, read: Read::Times(scale), ..self }
    }
}

/// The table of all topics.
static ROWS: [Row; 16] = [
    Row::new((E4, "bvp"), "bvp", Signal::Ppg, "1", 64.0),
    Row::new((E4, "gsr"), "eda", Signal::Eda, "uS", 4.0),
    Row::new((E4, "st"), "temperature", Signal::Temperature, "degC", 0.5),
    Row::new((E4, "hr"), "heart_rate", Signal::Other, "1/min", 0.0),
    Row::new((E4, "ibi"), "ibi", Signal::Interval, "ms", 0.0).reading(FLOAT, Read::Times(1e3)),
    Row::new((E4, "acc"), "acceleration", Signal::Acceleration, "g", 32.0).array(
        &["x", "y", "z"],
        0,
        1.0 / 64.0,
    ),
    Row::new((E4, "bat"), "battery", Signal::Battery, "1", 0.0),
    Row::new((E4, "tag"), "events", Signal::Event, "", 0.0).reading(EMPTY, Read::Marker),
    Row::new((H10, "hr"), "heart_rate", Signal::Other, "1/min", 0.0).reading(INT, Read::Times(1.0)),
    Row::new((H10, "ibi"), "", Signal::Other, "", 0.0).reading(INT, Read::LowByte),
    Row::new((H10, "dev"), "rr_interval", Signal::Interval, "ms", 0.0).reading(INT, Read::HighByte),
    Row::new((SHIMMER, "gsr"), "eda", Signal::Eda, "uS", SHIMMER_HZ).reading(FLOAT, Read::Inverted),
    Row::new((SHIMMER, "ppg"), "ppg", Signal::Ppg, "mV", SHIMMER_HZ),
    Row::new((BELT, "force"), "respiration", Signal::Respiration, "N", 10.0),
    Row::new((BELT, "bpm"), "breathing_rate", Signal::Other, "1/min", 0.0),
    Row::new(("emotiv_insight", "eeg"), "eeg", Signal::Eeg, "uV", 128.0).array(
        &["AF3", "T7", "Pz", "T8", "AF4"],
        2,
        1.0,
    ),
];

/// The last low byte of an interval and its time, by the namespace of its topic.
#[derive(Debug, Default)]
pub struct LowBytes(BTreeMap<String, (f64, Time)>);

/// A topic of the package.
#[derive(Debug)]
pub struct Topic {
    /// The stream that the topic becomes.
    pub stream: Stream,
    read: Read,
    fields: Option<Fields>,
    /// The part of the name before `/biosensors`.
    namespace: String,
}

impl Topic {
    /// Returns the known topic with this name and type; `own_person` is the person if the namespace names none.
    pub fn of(topic: &str, type_name: &str, own_person: &str) -> Option<Topic> {
        let (before, below) = topic.rsplit_once("/biosensors/")?;
        let is_it = |row: &&Row| below.split_once('/') == Some(row.topic) && row.kind == type_name;
        let row = ROWS.iter().find(is_it)?;
        let person = before.rsplit('/').next().filter(|token| !token.is_empty());
        let person = person.unwrap_or(own_person);
        let persons = NAMESPACE.trim_end_matches('*');
        let is_marker = row.read == Read::Marker;
        let shape = if is_marker { Shape::Event } else { Shape::Sample };
        let (device, leaf) = (row.topic.0, row.leaf);
        let names: &[&str] = if row.channels.is_empty() { &[row.leaf] } else { row.channels };
        let fields = if row.channels.is_empty() {
            vec!["data".to_owned()]
        } else {
            (0..names.len()).map(|place| format!("data[{}]", row.first + place)).collect()
        };
        let channels = if is_marker { &[] } else { names };
        let name = format!("{persons}{person}/{device}/{leaf}");
        let stream = Stream {
            signal: row.signal,
            device: device.to_owned(),
            channels: channels.iter().map(|name| Channel::new(*name, row.unit)).collect(),
            rate_hz: row.rate_hz,
            doc: format!("from {topic}, whose samples have no stamps"),
            ..Stream::raw(name, Subject::person(person), shape)
        };
        let definition = shipped(type_name).and_then(|schema| Definition::of(&schema).ok());
        let compiled = |definition| Fields::compile(&definition, &fields).ok();
        let fields = definition.filter(|_| !is_marker).and_then(compiled);
        Some(Topic { stream, read: row.read, fields, namespace: before.to_owned() })
    }

    /// Whether the topic carries the low bytes of intervals, which are not a stream by themselves.
    pub fn is_low_byte(&self) -> bool {
        self.read == Read::LowByte
    }

    /// Returns the topic and type of the low bytes that this topic's messages need.
    pub fn low_byte_topic(&self) -> Option<(String, &'static str)> {
        let (sensor, data) = ROWS.iter().find(|row| row.read == Read::LowByte)?.topic;
        let topic = || (format!("{}/biosensors/{sensor}/{data}", self.namespace), INT);
        (self.read == Read::HighByte).then(topic)
    }

    /// Returns the data of a message that arrived at `at`; `None` if it yields nothing by itself or can't be read.
    pub fn read(&self, cdr: &[u8], at: Time, low_bytes: &mut LowBytes) -> Option<Data> {
        if self.read == Read::Marker {
            let (kind, label) = (EventKind::Marker, "tag".to_owned());
            let event = Event { kind, label, value: f64::NAN, duration_secs: 0.0 };
            return Some(Data::Event(Arc::new(event)));
        }
        let mut numbers = Vec::new();
        self.fields.as_ref()?.read(cdr, &mut numbers).ok()?;
        let values: Arc<[f64]> = match self.read {
            Read::Times(scale) => numbers.iter().map(|number| number * scale).collect(),
            Read::Inverted => {
                // A resistance of zero or beyond the range has no conductance.
                let conductance = |kilo_ohm: &f64| 1e3 / kilo_ohm;
                let us = numbers.iter().map(conductance);
                us.map(|us| if us > 0.0 { us } else { f64::NAN }).collect()
            }
            Read::HighByte => {
                let low = low_bytes.0.remove(&self.namespace);
                [interval_ms(low, *numbers.first()?, at)?].into()
            }
            Read::LowByte => {
                low_bytes.0.insert(self.namespace.clone(), (*numbers.first()?, at));
                return None;
            }
            Read::Marker => return None,
        };
        Some(Data::Sample(values))
    }
}

/// Returns the interval [ms] from its high byte, if its low byte arrived just before.
fn interval_ms(low: Option<(f64, Time)>, high: f64, at: Time) -> Option<f64> {
    let (low, low_at) = low?;
    let is_byte = |value: f64| (0.0..=255.0).contains(&value);
    let is_near = (0.0..=BYTES_APART_SECS).contains(&at.secs_since(low_at));
    (is_near && is_byte(low) && is_byte(high))
        .then(|| (256.0 * high + low) * 1000.0 / 1024.0)
        .filter(|ms| *ms > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_has_its_fields() {
        for row in &ROWS {
            let (sensor, data) = row.topic;
            let topic = format!("/biosensors/{sensor}/{data}");
            let known = Topic::of(&topic, row.kind, "p001").unwrap();
            assert_eq!(known.fields.is_some(), row.read != Read::Marker, "{sensor}/{data}");
        }
    }

    #[test]
    fn a_namespace_names_the_person_and_other_topics_are_left_alone() {
        let stream = Topic::of("/p007/biosensors/empatica_e4/gsr", FLOAT, "p001").unwrap().stream;
        assert_eq!(stream.name, "/humans/persons/p007/empatica_e4/eda");
        for topic in ["/biosensors/empatica_e4/bvp_chunk", "/biosensors/gsr", "/empatica_e4/gsr"] {
            assert!(Topic::of(topic, FLOAT, "p001").is_none(), "{topic}");
        }
    }

    #[test]
    fn the_high_byte_of_an_interval_names_the_topic_of_its_low_byte() {
        let high = Topic::of("/p007/biosensors/polar_h10/dev", INT, "p001").unwrap();
        let low = ("/p007/biosensors/polar_h10/ibi".to_owned(), INT);
        assert_eq!(high.low_byte_topic(), Some(low));
        let other = Topic::of("/biosensors/polar_h10/hr", INT, "p001").unwrap();
        assert_eq!(other.low_byte_topic(), None);
    }

    #[test]
    fn two_bytes_are_an_interval_and_one_is_none() {
        let at = |secs: f64| Time::from_nanos((secs * 1e9) as i64);
        let interval = |low, secs| interval_ms(low, 3.0, at(secs));
        // 830.1 ms are 850 / 1024 s: bytes 82 and 3.
        let ms = interval(Some((82.0, at(5.0))), 5.001).unwrap();
        assert!((ms - 830.078).abs() < 0.001, "{ms}");
        assert_eq!(interval(None, 5.0), None);
        assert_eq!(interval(Some((82.0, at(5.0))), 6.0), None);
    }
}
