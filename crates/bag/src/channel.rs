//! Channels: the topics of one file, each with a type, as stored in a bag.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::stream::{Origin, Schema, Shape, Stream, Subject};

use crate::metadata::qos;
use crate::schema::is_description;
use teampulse_messages::convert::shape_of;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::starts_with_header;

/// The keys of a channel's metadata: those of rosbag2, then ours.
const QOS_KEY: &str = "offered_qos_profiles";
const HASH_KEY: &str = "topic_type_hash";
const ORIGIN_KEY: &str = "teampulse_origin";
const SHAPE_KEY: &str = "teampulse_shape";
const PUBLISHER_KEY: &str = "teampulse_publisher";
const DERIVED: &str = "derived";
const OWN: &str = "own";

/// A channel as recorded in an MCAP file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub topic: String,
    pub schema: Arc<Schema>,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

impl Channel {
    /// Creates the channel of a stream with samples of type `schema`; `qos` is the YAML of its profiles.
    pub(crate) fn of(stream: &Stream, schema: &Arc<Schema>, qos: String) -> Channel {
        let origin = if stream.origin == Origin::Derived { DERIVED } else { "raw" };
        let shape = if matches!(stream.shape, Shape::Message(_)) { "message" } else { OWN };
        let mut metadata = vec![
            (QOS_KEY, qos),
            (HASH_KEY, schema.hash.clone()),
            (ORIGIN_KEY, origin.to_owned()),
            (SHAPE_KEY, shape.to_owned()),
        ];
        if !stream.publisher.is_empty() {
            metadata.push((PUBLISHER_KEY, stream.publisher.clone()));
        }
        let metadata = metadata.into_iter().map(|(key, value)| (key.to_owned(), value));
        Channel {
            topic: stream.name.clone(),
            schema: Arc::clone(schema),
            encoding: "cdr".to_owned(),
            metadata: metadata.collect(),
        }
    }

    /// The stream as far as the channel describes it; the rest is in its description, if the bag has one.
    ///
    /// A topic that teampulse did not record is raw, and about the robot named by its first token; a topic without a
    /// namespace, such as `/tf`, is about the session.
    pub(crate) fn stream(&self) -> Stream {
        let mut tokens = self.topic.split('/').skip(1);
        let subject = match (tokens.next(), tokens.next()) {
            (Some(robot), Some(_)) => Subject::robot(robot),
            _ => Subject::session(),
        };
        let mut stream = Stream::raw(&*self.topic, subject, self.shape());
        if self.is(ORIGIN_KEY, DERIVED) {
            stream.origin = Origin::Derived;
        }
        stream.publisher = self.metadata.get(PUBLISHER_KEY).cloned().unwrap_or_default();
        stream.qos = self.metadata.get(QOS_KEY).map_or_else(Vec::new, |text| qos::read(text));
        stream
    }

    /// The shape of the channel's samples. ROS messages stay messages, whatever their type.
    pub(crate) fn shape(&self) -> Shape {
        let is_ours = self.is(SHAPE_KEY, OWN) || is_description(&self.topic, &self.schema.name);
        if is_ours { shape_of(&self.schema) } else { Shape::Message(Arc::clone(&self.schema)) }
    }

    /// Whether the channel was recorded by software other than teampulse.
    pub(crate) fn is_foreign(&self) -> bool {
        !self.metadata.contains_key(ORIGIN_KEY)
    }

    /// Whether the channel's messages start with a header that has not been parsed yet. In its own bags, teampulse
    /// stores the stamp as the publish time.
    pub(crate) fn has_unread_headers(&self) -> bool {
        self.is_foreign()
            && Definition::of(&self.schema).is_ok_and(|each| starts_with_header(&each))
    }

    fn is(&self, key: &str, word: &str) -> bool {
        self.metadata.get(key).is_some_and(|value| value == word)
    }
}

/// The type hash in a channel's metadata; empty if there is none.
pub(crate) fn type_hash(metadata: &BTreeMap<String, String>) -> String {
    metadata.get(HASH_KEY).cloned().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_without_a_namespace_is_about_no_robot() {
        let of = |topic: &str| {
            let (name, encoding) = ("std_msgs/msg/String".to_owned(), "ros2msg".to_owned());
            let schema = Schema { name, encoding, text: String::new(), hash: String::new() };
            let metadata = BTreeMap::new();
            let (topic, encoding) = (topic.to_owned(), "cdr".to_owned());
            Channel { topic, schema: Arc::new(schema), encoding, metadata }.stream().subject()
        };
        assert_eq!(of("/robot1/odom"), Subject::robot("robot1"));
        for topic in ["/foo", "/tf", "/", "foo"] {
            assert_eq!(of(topic), Subject::session(), "{topic}");
        }
    }
}
