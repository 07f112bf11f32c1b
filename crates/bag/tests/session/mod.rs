//! A session's records, made in code.

use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::data::{Data, Wave};
use teampulse_core::qos::Qos;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::stream::{Channel, Origin, Schema, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_messages::convert::encode;

/// When the session begins.
pub const START: Time = Time::from_stamp(1_700_000_000, 0);

/// The time `nanos` [ns] after the start.
pub fn at(nanos: i64) -> Time {
    Time::from_nanos(START.nanos() + nanos)
}

/// A stream of messages from a robot.
pub fn battery() -> Stream {
    let schema = Schema {
        name: "std_msgs/msg/String".into(),
        encoding: "ros2msg".into(),
        text: "string data\n".into(),
        hash: String::new(),
    };
    let mut stream =
        Stream::raw("/r1/note", Subject::robot("r1"), Shape::Message(Arc::new(schema)));
    stream.signal = Signal::Other;
    stream.qos = vec![Qos::best_effort(5)];
    stream
}

/// A stream of our own: the waves of a heart strap.
pub fn ecg() -> Stream {
    let mut stream =
        Stream::raw("/humans/persons/p001/strap/ecg", Subject::robot("p001"), Shape::Wave)
            .with_channels(&[("ecg", "V")]);
    stream.signal = Signal::Ecg;
    stream.rate_hz = 130.0;
    stream
}

/// A stream that was computed here.
pub fn rate() -> Stream {
    let mut stream = Stream::derived(&ecg(), "rate", Shape::Sample);
    stream.channels = vec![Channel::new("HR", "1/min")];
    stream
}

/// The stream of descriptions.
pub fn descriptions() -> Stream {
    let mut stream = Stream::raw("/teampulse/streams", Subject::session(), Shape::Description);
    stream.origin = Origin::Derived;
    stream
}

/// A record of `stream`, which is the `id`-th of the session.
pub fn record(id: u32, stream: &Arc<Stream>, log_time: Time, index: u64, data: Data) -> Record {
    let is_message = matches!(data, Data::Message(_));
    let sample = Sample {
        stream: StreamId(id),
        measured: log_time,
        log_time,
        device_time: (!is_message).then_some(7 * index as i64),
        source_time: is_message.then(|| Time::from_nanos(log_time.nanos() - 1000)),
        period_ns: 0.0,
        index,
        turn: Turn::OnTime,
        data,
    };
    let cdr = encode(&sample);
    Record { stream: Arc::clone(stream), sample, cdr }
}

/// The CDR of a `std_msgs/msg/String`.
pub fn text(words: &str) -> Data {
    let length = words.len() as u32 + 1;
    let parts = [&[0, 1, 0, 0][..], &length.to_le_bytes(), words.as_bytes(), &[0]];
    Data::Message(Bytes::from(parts.concat()))
}

/// A run of three samples.
pub fn wave(first: f64) -> Data {
    let samples = [first, first + 0.5, -first].into();
    Data::Wave(Wave { period_ns: 7_692_307.7, channels: 1, samples })
}

/// A session of all kinds of streams, a millisecond apart, with equal stamps now and then.
pub fn session(count: u64) -> Vec<Record> {
    let streams = [battery(), ecg(), rate()].map(Arc::new);
    let described = Arc::new(descriptions());
    let mut records: Vec<Record> = (0..3)
        .map(|k| {
            record(3, &described, at(k), k as u64, Data::Description(streams[k as usize].clone()))
        })
        .collect();
    for k in 0..count {
        let id = (k % 3) as u32;
        let data = match id {
            0 => text(&format!("message {k} of a robot that has much to report")),
            1 => wave(k as f64),
            _ => Data::Sample([60.0 + k as f64].into()),
        };
        let log_time = at(1_000_000 * (k as i64 - k as i64 % 2) + 10);
        records.push(record(id, &streams[id as usize], log_time, k / 3, data));
    }
    records
}
