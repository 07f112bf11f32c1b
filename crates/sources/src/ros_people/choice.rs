//! Selects the topics that are signals of people.

use teampulse_core::registry::SettingsError;
use teampulse_core::stream::{About, Shape, Signal, Stream, Subject};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs as msgs;

use teampulse_core::pattern::Pattern;

/// Selects people's signals by name and type.
#[derive(Clone, Debug)]
pub struct Choice {
    namespace: Pattern,
}

impl Choice {
    /// Selects the people of a namespace, which needs a `*` to distinguish them.
    pub fn new(namespace: Pattern) -> Result<Choice, SettingsError> {
        if namespace.text().contains('*') && !namespace.text().contains("**") {
            return Ok(Choice { namespace });
        }
        let message = format!("the namespace {} contains no person's id", namespace.text());
        let hint = "put a `*` in place of the id: `/humans/persons/*`";
        Err(SettingsError::new(message).with_hint(hint))
    }

    /// Returns the stream of a topic, as far as name and type determine it; `None` if the topic is not wanted.
    pub fn stream(&self, topic: &str, type_name: &str) -> Option<Stream> {
        let shape = match type_name {
            msgs::Sample::NAME => Shape::Sample,
            msgs::Wave::NAME => Shape::Wave,
            msgs::Event::NAME => Shape::Event,
            _ => return None,
        };
        let (_, below) = self.namespace.split(topic)?;
        let (device, last) = below.split_once('/')?;
        if device.is_empty() || last.is_empty() || last.contains('/') {
            return None;
        }
        let id = self.namespace.starred(topic)?.to_owned();
        let subject = Subject { about: About::Person, id };
        let by_name = Signal::from_word(last).unwrap_or(Signal::Other);
        let signal = if shape == Shape::Event { Signal::Event } else { by_name };
        let device = device.to_owned();
        Some(Stream { signal, device, ..Stream::raw(topic, subject, shape) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice() -> Choice {
        Choice::new(Pattern::parse("/humans/persons/*").unwrap()).unwrap()
    }

    #[test]
    fn a_topic_names_person_device_and_signal() {
        let stream = choice().stream("/humans/persons/p001/strap/ecg", msgs::Wave::NAME).unwrap();
        assert_eq!((stream.id.as_str(), stream.device.as_str()), ("p001", "strap"));
        assert_eq!((stream.about, stream.signal), (About::Person, Signal::Ecg));
        let other = choice().stream("/humans/persons/p001/strap/mood", msgs::Sample::NAME);
        assert_eq!(other.unwrap().signal, Signal::Other);
    }

    #[test]
    fn other_topics_and_other_types_are_left_alone() {
        for topic in ["/robot1/strap/ecg", "/humans/persons/p001/ecg", "/humans/persons/p001/a/b/c"]
        {
            assert!(choice().stream(topic, msgs::Wave::NAME).is_none(), "{topic}");
        }
        let string = choice().stream("/humans/persons/p001/strap/ecg", "std_msgs/msg/String");
        assert!(string.is_none());
    }

    #[test]
    fn a_namespace_that_gives_nobody_apart_is_refused() {
        for text in ["/humans", "/humans/**"] {
            assert!(Choice::new(Pattern::parse(text).unwrap()).is_err(), "{text}");
        }
    }
}
