//! The streams of a session itself: its events, the events of its clocks, and the descriptions of
//! its streams.

use crate::data::{Data, Event, EventKind};
use crate::qos::Qos;
use crate::stream::{About, Origin, Shape, Signal, Stream, Subject};

/// The label of the event with which a session ends.
pub const END: &str = "end";

/// The topic of session events.
pub const SESSION_EVENTS: &str = "/session/events";

/// A stream of events of the session itself, kept for late joiners.
pub(crate) fn own_events(topic: &str, doc: &str) -> Stream {
    let mut stream = Stream::raw(topic, Subject::session(), Shape::Event);
    stream.signal = Signal::Event;
    stream.qos = vec![Qos::latched(1000)];
    stream.doc = doc.into();
    stream
}

/// The stream of session events: phases, markers, faults and the end of the session.
pub fn session_events() -> Stream {
    own_events(SESSION_EVENTS, "phases, markers and faults of the session")
}

/// The event with which a session ends.
pub(crate) fn end_event() -> Event {
    let (kind, label) = (EventKind::Clock, END.to_owned());
    Event { kind, label, value: f64::NAN, duration_secs: 0.0 }
}

/// Whether this event ends a session; the last losses have been reported before it.
pub(crate) fn is_end(stream: &Stream, data: &Data) -> bool {
    stream.about == About::Session
        && stream.name == SESSION_EVENTS
        && matches!(data, Data::Event(event) if event.kind == EventKind::Clock && event.label == END)
}

/// The topic of clock events; a replay recomputes them.
pub const CLOCKS: &str = "/teampulse/clocks";

/// The stream of events about the clocks of devices and computers.
pub(crate) fn clock_events() -> Stream {
    let doc = "clocks that restart, jump, wrap, run fast or are off";
    Stream { origin: Origin::Derived, ..own_events(CLOCKS, doc) }
}

/// The stream of descriptions of all streams.
pub fn descriptions() -> Stream {
    let mut stream = Stream::raw("/teampulse/streams", Subject::session(), Shape::Description);
    stream.origin = Origin::Derived;
    stream.qos = vec![Qos::latched(1000)];
    stream.doc = "the streams of the session".into();
    stream
}

/// The stream with the health of every raw stream.
pub(crate) fn health() -> Stream {
    let mut stream = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
    stream.origin = Origin::Derived;
    stream.rate_hz = 1.0;
    stream.qos = vec![Qos::reliable(1000)];
    stream.doc = "state, rate, age and losses of each raw stream, once a second".into();
    stream.method = "on ticks, from the stream's declared or learned rate".into();
    stream
}
