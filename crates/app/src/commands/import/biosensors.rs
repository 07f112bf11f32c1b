//! The topics of the package `ros2-foxy-wearable-biosensors` as streams of a person.
//!
//! Its nodes publish plain numbers without a stamp, each as soon as it came: `/biosensors/<sensor>/<data>`, where the
//! token before `biosensors`, if there is one, is taken for the person. Source: its nodes at f51a8fe (2021).
//!
//! | sensor | quirk |
//! |---|---|
//! | `shimmer3_gsr` | `gsr` is a resistance [kOhm], `ppg` a voltage [mV]; asked for 50 Hz it samples 32768 / 655 times a second |
//! | `polar_h10` | `ibi` is the low byte of an interval of 1/1024 s, and `dev`, meant as the battery, its high byte: together they are the interval. A second interval in a notification was not published |
//! | `empatica_e4` | `ibi` is in seconds, `acc` in 64ths of g, `st` the mean of 8 samples at 4 Hz |
//! | `emotiv_insight` | `eeg` begins with a counter and whether the sample was interpolated |
//!
//! The topics of chunks (`bvp_chunk`) repeat what the others have. All messages stay in the bag as they are.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_bag::{Adapter, Bag, Message};
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::stream::{Channel, Shape, Signal, Stream, Subject};
use teampulse_core::time::Time;
use teampulse_messages::catalogue::shipped;
use teampulse_messages::convert::type_name;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::Fields;
use teampulse_sources::ros_people::NAMESPACE;

/// How far apart the two bytes of an interval may be published [s].
const BYTES_APART_SECS: f64 = 0.25;
/// The rate of a Shimmer3 that is asked for 50 Hz [Hz].
const SHIMMER_HZ: f64 = 32768.0 / 655.0;

/// A topic, and the stream that it becomes.
struct Row {
    /// Its sensor and its data.
    topic: (&'static str, &'static str),
    kind: &'static str,
    /// The name of the stream below its sensor.
    leaf: &'static str,
    signal: Signal,
    channels: &'static [&'static str],
    /// The index of the first channel in an array.
    first: usize,
    unit: &'static str,
    rate_hz: f64,
    read: Read,
}

/// How its numbers are read.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Read {
    Times(f64),
    /// A conductance [uS] from a resistance [kOhm].
    Inverted,
    /// The low byte of an interval, which becomes nothing by itself.
    LowByte,
    /// The high byte, which completes it.
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

/// THE table.
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

/// Reads the topics of wearables in the messages of a bag.
#[derive(Debug)]
pub struct Biosensors {
    /// Whose they are where no namespace names a person.
    person: String,
    /// Of each topic its stream, its row and its fields; `None` for a topic of something else.
    known: BTreeMap<String, Option<Known>>,
    /// The last low byte of an interval, with its time, by the namespace of its topic.
    low_bytes: BTreeMap<String, (f64, Time)>,
    numbers: Vec<f64>,
}

#[derive(Debug)]
struct Known {
    stream: Stream,
    read: Read,
    fields: Option<Fields>,
    /// What is before `/biosensors` in its topic.
    namespace: String,
}

impl Biosensors {
    /// Topics without a namespace are of this person.
    pub fn of(person: &str) -> Biosensors {
        let person = person.to_owned();
        let (known, low_bytes) = (BTreeMap::new(), BTreeMap::new());
        Biosensors { person, known, low_bytes, numbers: Vec::new() }
    }

    /// The streams that become of the topics of a bag, for people.
    pub fn report(&self, bag: &Bag) -> Vec<String> {
        let known = bag.streams().iter().filter_map(|each| {
            let topic = &each.stream.name;
            let known = known(topic, type_name(&each.stream.shape), &self.person)?;
            let name = known.stream.name;
            (known.read != Read::LowByte).then(|| format!("  {name:<52} from {topic}"))
        });
        known.collect()
    }

    /// The interval of a high byte, if its low byte came just before [ms].
    fn interval_ms(low: Option<(f64, Time)>, high: f64, at: Time) -> Option<f64> {
        let (low, low_at) = low?;
        let is_byte = |value: f64| (0.0..=255.0).contains(&value);
        let is_near = (0.0..=BYTES_APART_SECS).contains(&at.secs_since(low_at));
        (is_near && is_byte(low) && is_byte(high))
            .then(|| (256.0 * high + low) * 1000.0 / 1024.0)
            .filter(|ms| *ms > 0.0)
    }
}

impl Adapter for Biosensors {
    fn adapt(&mut self, stream: &Stream, message: &Message) -> Option<(Stream, Data)> {
        let topic = stream.name.as_str();
        if !self.known.contains_key(topic) {
            let known = known(topic, type_name(&stream.shape), &self.person);
            self.known.insert(topic.to_owned(), known);
        }
        let Known { stream, read, fields, namespace } = self.known.get(topic)?.as_ref()?;
        if *read == Read::Marker {
            let (kind, label) = (EventKind::Marker, "tag".to_owned());
            let event = Event { kind, label, value: f64::NAN, duration_secs: 0.0 };
            return Some((stream.clone(), Data::Event(Arc::new(event))));
        }
        fields.as_ref()?.read(&message.cdr, &mut self.numbers).ok()?;
        let numbers = self.numbers.iter();
        let values: Arc<[f64]> = match *read {
            Read::Times(scale) => numbers.map(|number| number * scale).collect(),
            Read::Inverted => {
                // No current, or one beyond the range, is no conductance.
                let conductance = |kilo_ohm: &f64| 1e3 / kilo_ohm;
                numbers.map(conductance).map(|us| if us > 0.0 { us } else { f64::NAN }).collect()
            }
            Read::HighByte => {
                let low = self.low_bytes.remove(namespace);
                [Biosensors::interval_ms(low, *self.numbers.first()?, message.log_time)?].into()
            }
            Read::LowByte => {
                let low = (*self.numbers.first()?, message.log_time);
                self.low_bytes.insert(namespace.clone(), low);
                return None;
            }
            Read::Marker => return None,
        };
        Some((stream.clone(), Data::Sample(values)))
    }
}

/// What a topic is known as; `None` for one of something else.
fn known(topic: &str, kind: &str, own_person: &str) -> Option<Known> {
    let (before, below) = topic.rsplit_once("/biosensors/")?;
    let row =
        ROWS.iter().find(|row| below.split_once('/') == Some(row.topic) && row.kind == kind)?;
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
    let stream = Stream {
        signal: row.signal,
        device: device.to_owned(),
        channels: channels.iter().map(|name| Channel::new(*name, row.unit)).collect(),
        rate_hz: row.rate_hz,
        doc: format!("from {topic}, whose samples have no stamps"),
        ..Stream::raw(format!("{persons}{person}/{device}/{leaf}"), Subject::person(person), shape)
    };
    let definition = shipped(kind).and_then(|schema| Definition::of(&schema).ok());
    let compiled = |definition| Fields::compile(&definition, &fields).ok();
    let fields = definition.filter(|_| !is_marker).and_then(compiled);
    Some(Known { stream, read: row.read, fields, namespace: before.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_has_its_fields() {
        for row in &ROWS {
            let (sensor, data) = row.topic;
            let known = known(&format!("/biosensors/{sensor}/{data}"), row.kind, "p001").unwrap();
            assert_eq!(known.fields.is_some(), row.read != Read::Marker, "{sensor}/{data}");
        }
    }

    #[test]
    fn a_namespace_names_the_person_and_other_topics_are_left_alone() {
        let stream = known("/p007/biosensors/empatica_e4/gsr", FLOAT, "p001").unwrap().stream;
        assert_eq!(stream.name, "/humans/persons/p007/empatica_e4/eda");
        for topic in ["/biosensors/empatica_e4/bvp_chunk", "/biosensors/gsr", "/empatica_e4/gsr"] {
            assert!(known(topic, FLOAT, "p001").is_none(), "{topic}");
        }
    }

    #[test]
    fn two_bytes_are_an_interval_and_one_is_none() {
        let at = |secs: f64| Time::from_nanos((secs * 1e9) as i64);
        let interval = |low, secs| Biosensors::interval_ms(low, 3.0, at(secs));
        // 830.1 ms are 850 / 1024 s: bytes 82 and 3.
        let ms = interval(Some((82.0, at(5.0))), 5.001).unwrap();
        assert!((ms - 830.078).abs() < 0.001, "{ms}");
        assert_eq!(interval(None, 5.0), None);
        assert_eq!(interval(Some((82.0, at(5.0))), 6.0), None);
    }
}
