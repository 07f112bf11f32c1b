//! The channels of the session's streams: messages as in the bag, and the values of waves one by one.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::data::{Data, Wave};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::stream::{Shape, Stream, StreamId};
use teampulse_messages::convert::schema_of;

use super::protocol::Channel;
use super::server::Shared;

/// The type of single numbers, and its definition.
const NUMBER: (&str, &str) = ("std_msgs/msg/Float64", "float64 data\n");
/// The maximum number of values sent per second from a channel of a wave.
const MOST_PER_SEC: f64 = 60.0;
/// The maximum number of channels of a wave that have separate topics.
const MOST_CHANNELS: usize = 64;
/// The header of little-endian CDR.
const CDR_HEAD: [u8; 4] = [0, 1, 0, 0];

/// All advertised channels.
pub(super) struct Channels {
    shared: Arc<Shared>,
    served: BTreeMap<StreamId, Served>,
    next: u32,
}

/// A stream with its channels.
struct Served {
    /// The stream as it was when its channels were created.
    stream: Arc<Stream>,
    message: u32,
    /// For a wave, the number of the advertised channel for each of its own channels.
    numbers: Vec<u32>,
    /// The time of the last value that was sent [ns].
    sent_nanos: i64,
}

impl Channels {
    pub(super) fn new(shared: Arc<Shared>) -> Channels {
        Channels { shared, served: BTreeMap::new(), next: 1 }
    }

    /// Passes a record to the clients that want it; a stream that is new, or whose type became known, is advertised
    /// first.
    pub(super) fn take(&mut self, record: &Record) {
        let id = record.sample.stream;
        let known = self.served.get(&id);
        if known.is_none_or(|known| !is_same(&known.stream, &record.stream)) {
            self.advertise(id, &record.stream);
        }
        let Some(served) = self.served.get_mut(&id) else { return };
        if record.sample.turn == Turn::Duplicate {
            return;
        }
        self.shared.send(served.message, record.sample.log_time.nanos(), &record.cdr);
        if let Data::Wave(wave) = &record.sample.data {
            let (begin, period) = (record.sample.measured.nanos(), record.sample.period_ns);
            served.send_numbers(&self.shared, wave, begin, period);
        }
    }

    fn advertise(&mut self, id: StreamId, stream: &Arc<Stream>) {
        if let Some(before) = self.served.remove(&id) {
            self.shared.unadvertise(&[&[before.message][..], &before.numbers].concat());
        }
        let schema = schema_of(&stream.shape);
        let channel = |id, topic: String, name: &str, text: &str, encoding: &str| Channel {
            id,
            topic,
            encoding: "cdr",
            schema_name: name.to_owned(),
            schema: text.to_owned(),
            schema_encoding: encoding.to_owned(),
        };
        let message = self.take_number();
        let mut all = vec![channel(
            message,
            stream.name.clone(),
            &schema.name,
            &schema.text,
            &schema.encoding,
        )];
        let mut numbers = Vec::new();
        if stream.shape == Shape::Wave && stream.channels.len() <= MOST_CHANNELS {
            for each in &stream.channels {
                let number = self.take_number();
                let topic = format!("{}/{}", stream.name, each.name);
                all.push(channel(number, topic, NUMBER.0, NUMBER.1, "ros2msg"));
                numbers.push(number);
            }
        }
        self.shared.advertise(all);
        let stream = Arc::clone(stream);
        self.served.insert(id, Served { stream, message, numbers, sent_nanos: i64::MIN });
    }

    fn take_number(&mut self) -> u32 {
        self.next += 1;
        self.next - 1
    }
}

impl Served {
    /// Sends the values of a wave one by one, often enough for a plot to show its shape.
    fn send_numbers(&mut self, shared: &Shared, wave: &Wave, begin_nanos: i64, period_nanos: f64) {
        if !self.numbers.iter().any(|number| shared.is_wanted(*number)) {
            return;
        }
        let least_nanos = (1e9 / MOST_PER_SEC) as i64;
        for (place, sample) in
            wave.samples.chunks_exact((wave.channels as usize).max(1)).enumerate()
        {
            let at = begin_nanos.saturating_add((place as f64 * period_nanos) as i64);
            if at.saturating_sub(self.sent_nanos) < least_nanos {
                continue;
            }
            self.sent_nanos = at;
            for (number, value) in self.numbers.iter().zip(sample) {
                let mut cdr = [0; 12];
                cdr[..4].copy_from_slice(&CDR_HEAD);
                cdr[4..].copy_from_slice(&value.to_le_bytes());
                shared.send(*number, at, &cdr);
            }
        }
    }
}

/// Whether a stream still has the type and the channels that were advertised.
fn is_same(known: &Stream, stream: &Stream) -> bool {
    known.shape == stream.shape && known.channels == stream.channels
}
