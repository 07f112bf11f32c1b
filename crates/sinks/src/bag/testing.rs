//! Records for the tests of bags.

use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::session_streams::session_events;
use teampulse_core::sink::Batch;
use teampulse_core::stream::{Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::convert::encode;

/// A batch with a marker of a robot, labelled by its second.
pub fn marker(streams: &Streams, second: i64) -> Batch {
    let stream = Stream::raw("/r1/marks", Subject::robot("r1"), Shape::Event);
    happens(streams, stream, second, (EventKind::Marker, &format!("{second}"), 0.0))
}

/// A batch with the start of a phase of the session.
pub fn phase(streams: &Streams, second: i64, label: &str, duration_secs: f64) -> Batch {
    happens(streams, session_events(), second, (EventKind::Phase, label, duration_secs))
}

/// A batch with an event of a stream, its kind, label and length [s].
pub fn happens(
    streams: &Streams,
    stream: Stream,
    second: i64,
    (kind, label, duration_secs): (EventKind, &str, f64),
) -> Batch {
    let id = streams.declare(stream).id;
    let event = Event { kind, label: label.into(), value: f64::NAN, duration_secs };
    let at = Time::from_nanos(second * 1_000_000_000);
    let sample = Sample {
        stream: id,
        measured: at,
        log_time: at,
        device_time: None,
        source_time: None,
        period_ns: 0.0,
        index: second as u64,
        turn: Turn::OnTime,
        data: Data::Event(Arc::new(event)),
    };
    let cdr: Bytes = encode(&sample);
    Batch::from(vec![Record { stream: streams.get(id), sample, cdr }])
}
