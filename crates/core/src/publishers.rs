//! The publishers of a topic, reported in band: with two publishers, a stream mixes the numbers of both.

use std::sync::Arc;

use crate::data::{Data, Event, EventKind};
use crate::session_streams::own_events;
use crate::stream::{About, Stream};

/// The topic that states who publishes other topics.
pub(crate) const TOPIC: &str = "/teampulse/published_by";

/// The publishers of a topic, once there are several.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PublishedBy {
    /// The topic.
    pub(crate) stream: String,
    /// The names of the publishers.
    pub(crate) publishers: Vec<String>,
}

/// The separator between two names.
const BETWEEN: &str = "; ";

impl PublishedBy {
    /// The stream of these reports.
    pub(crate) fn stream() -> Stream {
        own_events(
            TOPIC,
            "the publishers of each topic that has, or had, several; the label is the topic, then their names",
        )
    }

    /// The event of this report: the label is the topic and the names, the value their number.
    pub(crate) fn event(&self) -> Data {
        let label = format!("{} {}", self.stream, self.publishers.join(BETWEEN));
        let (kind, value) = (EventKind::Fault, self.publishers.len() as f64);
        Data::Event(Arc::new(Event { kind, label, value, duration_secs: 0.0 }))
    }

    /// Reads the report from a sample of this stream; `None` for any other stream.
    pub(crate) fn read(stream: &Stream, data: &Data) -> Option<PublishedBy> {
        let Data::Event(event) = data else { return None };
        if stream.name != TOPIC || stream.about != About::Session {
            return None;
        }
        let (topic, names) = event.label.split_once(' ')?;
        let publishers = names.split(BETWEEN).filter(|name| !name.is_empty()).map(str::to_owned);
        Some(PublishedBy { stream: topic.to_owned(), publishers: publishers.collect() })
    }

    /// The fault of a stream with several publishers: its numbers are mixed. On a robot's other topics,
    /// such as `/diagnostics`, several publishers are usual.
    pub(crate) fn complaint(&self, stream: &Stream) -> Option<String> {
        let has_numbers = stream.about == About::Person || !stream.channels.is_empty();
        let count = self.publishers.len();
        (has_numbers && count > 1)
            .then(|| format!("{count} publishers: {}", self.publishers.join(" and ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Shape, Subject};

    fn published_by(names: &[&str]) -> PublishedBy {
        let publishers = names.iter().map(|name| (*name).to_owned()).collect();
        PublishedBy { stream: "/r1/odom".into(), publishers }
    }

    #[test]
    fn a_report_survives_its_event() {
        for names in [&["laptop1 (driver, 01)", "laptop2 (driver, 02)"][..], &["one"], &[]] {
            let report = published_by(names);
            assert_eq!(PublishedBy::read(&PublishedBy::stream(), &report.event()), Some(report));
        }
        let other = Stream::raw("/r1/odom", Subject::robot("r1"), Shape::Event);
        assert_eq!(PublishedBy::read(&other, &published_by(&["one"]).event()), None);
    }

    #[test]
    fn two_publishers_are_a_fault_where_numbers_are_read() {
        let two = published_by(&["a", "b"]);
        let plain = Stream::raw("/r1/odom", Subject::robot("r1"), Shape::Sample);
        let read = plain.clone().with_channels(&[("x", "m")]);
        assert_eq!(two.complaint(&read).as_deref(), Some("2 publishers: a and b"));
        assert_eq!(two.complaint(&plain), None);
        assert_eq!(published_by(&["a"]).complaint(&read), None);
    }
}
