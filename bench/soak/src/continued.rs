//! A recording that repeats: each time it is handed over, all its stamps follow those of the previous time, as in one
//! long session.

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_bag::{Bag, Message};
use teampulse_core::clock::Stopwatch;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Origin, Shape, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::convert::{Decoded, decode, type_name};
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{header_stamp, starts_with_header};

/// The pause between the end of a recording and its next start.
const PAUSE: Duration = Duration::from_millis(10);

/// The number of readings after which other tasks run.
const TURN: usize = 256;

/// Hands over the raw data of a bag repeatedly, until this much time has passed in it.
pub struct Continued {
    pub bag: Arc<Bag>,
    pub secs: f64,
    /// How many times as fast as recorded to hand it over; `None` for as fast as it can be taken.
    pub speed: Option<f64>,
}

#[async_trait]
impl Source for Continued {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let (first, last) = self.bag.bounds().ok_or_else(|| fatal(&"the bag is empty"))?;
        let known: Vec<Option<Known>> = self
            .bag
            .streams()
            .iter()
            .map(|of| &of.stream)
            .map(|stream| is_wanted(stream).then(|| Known::of(stream, outlet, first)))
            .collect();
        let (mut shift, began) = (Duration::ZERO, Stopwatch::start());
        while shift.as_secs_f64() < self.secs {
            for (count, message) in self.bag.messages(None).enumerate() {
                let message = message.map_err(|error| fatal(&error))?;
                let at = message.log_time + shift;
                let Some(known) = &known[message.stream] else { continue };
                let Some(reading) = known.reading(&message, shift)? else { continue };
                outlet.clock().set(at);
                if outlet.send(reading, at).await.is_err() {
                    return Ok(());
                }
                if count % TURN == 0 {
                    tokio::task::yield_now().await;
                    let due = self.speed.map(|speed| at.secs_since(first) / speed);
                    let ahead = due.unwrap_or(0.0) - began.elapsed().as_secs_f64();
                    if ahead > 0.0 {
                        tokio::time::sleep(Duration::from_secs_f64(ahead)).await;
                    }
                }
            }
            shift += Duration::from_nanos(last.nanos_since(first) as u64) + PAUSE;
        }
        Ok(())
    }
}

/// Whether a stream came from outside, and is not about streams themselves.
fn is_wanted(stream: &Stream) -> bool {
    stream.origin == Origin::Raw && !matches!(stream.shape, Shape::Status | Shape::Description)
}

/// A stream of the bag.
struct Known {
    id: StreamId,
    stream: Arc<Stream>,
    /// Whether its messages begin with their stamp.
    is_stamped: bool,
}

impl Known {
    fn of(stream: &Arc<Stream>, outlet: &Outlet, at: Time) -> Known {
        let is_stamped = match &stream.shape {
            Shape::Message(schema) => {
                Definition::of(schema).is_ok_and(|it| starts_with_header(&it))
            }
            _ => false,
        };
        let id = outlet.declare_at(Stream::clone(stream), at);
        Known { id, stream: Arc::clone(stream), is_stamped }
    }

    /// Returns the reading of a message, shifted in time; `None` for a message that ends a session.
    fn reading(&self, message: &Message, shift: Duration) -> Result<Option<Reading>, SourceError> {
        let later = |time: Time| time + shift;
        let (device_time, source_time, data) = if let Shape::Message(_) = self.stream.shape {
            let cdr =
                if self.is_stamped { restamped(&message.cdr, shift) } else { message.cdr.clone() };
            (None, later(message.publish_time), Data::Message(cdr))
        } else {
            let decoded = decode(type_name(&self.stream.shape), &message.cdr)
                .map_err(|error| fatal(&error))?;
            let Decoded { stamp, device_time, data, .. } = decoded;
            if matches!(&data, Data::Event(event) if event.kind == EventKind::Clock) {
                return Ok(None);
            }
            (device_time.map(|ticks| ticks + shift.as_nanos() as i64), later(stamp), data)
        };
        let source_time = Some(source_time);
        Ok(Some(Reading { index: None, stream: self.id, device_time, source_time, data }))
    }
}

/// Returns a message with a later stamp, if it has one.
fn restamped(cdr: &Bytes, shift: Duration) -> Bytes {
    let Some(stamp) = header_stamp(cdr) else { return cdr.clone() };
    let nanos = (stamp + shift).nanos();
    let (secs, nanos) = (nanos.div_euclid(1_000_000_000) as i32, nanos.rem_euclid(1_000_000_000));
    let mut bytes = cdr.to_vec();
    // The second byte states whether the message is little-endian.
    let (secs, nanos) = match bytes[1] & 1 {
        1 => (secs.to_le_bytes(), (nanos as u32).to_le_bytes()),
        _ => (secs.to_be_bytes(), (nanos as u32).to_be_bytes()),
    };
    bytes[4..8].copy_from_slice(&secs);
    bytes[8..12].copy_from_slice(&nanos);
    bytes.into()
}

fn fatal(error: &impl ToString) -> SourceError {
    SourceError::Fatal { message: error.to_string(), hint: String::new() }
}
