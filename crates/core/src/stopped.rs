//! Streams that were stopped on purpose, reported in band: their silence is no fault, live and in a replay.

use std::sync::Arc;

use crate::data::{Data, Event, EventKind};
use crate::session_streams::own_events;
use crate::stream::{About, Stream};

/// The topic that states which streams were stopped.
pub(crate) const TOPIC: &str = "/teampulse/stopped";

/// A report that a stream was stopped on purpose, or has resumed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stopped {
    /// The stream's topic.
    pub(crate) stream: String,
    /// Whether the stream was stopped; otherwise it has resumed.
    pub(crate) is_stopped: bool,
}

impl Stopped {
    /// The stream of these reports.
    pub(crate) fn stream() -> Stream {
        let doc =
            "whether a stream was stopped on purpose: its topic; 1 if so, 0 if it has resumed";
        own_events(TOPIC, doc)
    }

    /// The event of this report: the label is the topic.
    pub(crate) fn event(&self) -> Data {
        let (kind, label) = (EventKind::Report, self.stream.clone());
        let value = f64::from(u8::from(self.is_stopped));
        Data::Event(Arc::new(Event { kind, label, value, duration_secs: 0.0 }))
    }

    /// Reads the report from a sample of this stream; `None` for any other stream.
    pub(crate) fn read(stream: &Stream, data: &Data) -> Option<Stopped> {
        let Data::Event(event) = data else { return None };
        let is_its = stream.name == TOPIC && stream.about == About::Session;
        is_its.then(|| Stopped { stream: event.label.clone(), is_stopped: event.value > 0.5 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Shape, Subject};

    #[test]
    fn a_report_survives_its_event() {
        for is_stopped in [true, false] {
            let report = Stopped { stream: "/r1/odom".into(), is_stopped };
            assert_eq!(Stopped::read(&Stopped::stream(), &report.event()), Some(report));
        }
        let other = Stream::raw("/r1/odom", Subject::robot("r1"), Shape::Event);
        let report = Stopped { stream: "/r1/odom".into(), is_stopped: true };
        assert_eq!(Stopped::read(&other, &report.event()), None);
    }
}
