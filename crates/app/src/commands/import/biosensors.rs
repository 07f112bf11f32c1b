//! Converts topics in recordings of the package `ros2-foxy-wearable-biosensors` to streams of a person.
//!
//! All messages are also kept in the bag unchanged.

use std::collections::BTreeMap;

use teampulse_bag::{Adapter, Bag, Message};
use teampulse_core::data::Data;
use teampulse_core::stream::Stream;
use teampulse_messages::convert::type_name;
use teampulse_sources::biosensors::{LowBytes, Topic};

/// Reads the topics of wearables from the messages of a bag.
#[derive(Debug)]
pub struct Biosensors {
    /// The person for topics whose namespace names nobody.
    person: String,
    /// What each topic contains; `None` for a topic that is not from a wearable.
    known: BTreeMap<String, Option<Topic>>,
    low_bytes: LowBytes,
}

impl Biosensors {
    /// Creates a reader that assigns topics without a namespace to this person.
    pub fn of(person: &str) -> Biosensors {
        let (known, low_bytes) = (BTreeMap::new(), LowBytes::default());
        Biosensors { person: person.to_owned(), known, low_bytes }
    }

    /// Describes, for the user, the streams that topics of a bag become.
    pub fn report(&self, bag: &Bag) -> Vec<String> {
        let known = bag.streams().iter().filter_map(|each| {
            let topic = &each.stream.name;
            let known = Topic::of(topic, type_name(&each.stream.shape), &self.person)?;
            let name = &known.stream.name;
            (!known.is_low_byte()).then(|| format!("  {name:<52} from {topic}"))
        });
        known.collect()
    }
}

impl Adapter for Biosensors {
    fn adapt(&mut self, stream: &Stream, message: &Message) -> Option<(Stream, Data)> {
        let topic = stream.name.as_str();
        if !self.known.contains_key(topic) {
            let known = Topic::of(topic, type_name(&stream.shape), &self.person);
            self.known.insert(topic.to_owned(), known);
        }
        let topic = self.known.get(topic)?.as_ref()?;
        let data = topic.read(&message.cdr, message.log_time, &mut self.low_bytes)?;
        Some((topic.stream.clone(), data))
    }
}
