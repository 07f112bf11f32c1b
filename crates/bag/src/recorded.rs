//! The records of a bag as they were recorded, for display: nothing is corrected or recomputed.

use std::sync::Arc;

use teampulse_core::data::Data;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::stream::{Origin, Shape, Stream, StreamId};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::convert::{Decoded, decode, type_name};

use crate::error::BagError;
use crate::read::Bag;
use crate::read::messages::Message;

/// How far the stamp of a message may be from its log time to be used as its time [s]: the clocks of other computers
/// may be hours off.
const STAMPED_SECS: f64 = 1.0;

/// A bag, as records of its streams.
#[derive(Debug)]
pub struct Recorded {
    bag: Arc<Bag>,
    streams: Streams,
    /// The id of each stream of the bag, by its index; `None` for descriptions.
    ids: Vec<Option<StreamId>>,
}

impl Recorded {
    /// Prepares the records of a bag, and declares all its streams.
    pub fn new(bag: Arc<Bag>) -> Recorded {
        let streams = Streams::default();
        let declare = |stream: &Arc<Stream>| {
            let is_shown = stream.shape != Shape::Description;
            is_shown.then(|| streams.declare(Stream::clone(stream)).id)
        };
        let ids = bag.streams().iter().map(|known| declare(&known.stream)).collect();
        Recorded { bag, streams, ids }
    }

    /// The streams of the bag, except descriptions.
    pub fn streams(&self) -> &Streams {
        &self.streams
    }

    /// The records of the wanted streams from a log time on. A part that can't be read yields an error and is skipped.
    pub fn records<'a>(
        &'a self,
        from: Time,
        wants: &dyn Fn(&Stream) -> bool,
    ) -> impl Iterator<Item = Result<Record, BagError>> + use<'a> {
        let known = self.bag.streams().iter();
        let is_wanted: Vec<bool> = known.map(|known| wants(&known.stream)).collect();
        self.bag.messages(Some(from)).filter_map(move |message| match message {
            Ok(message) if !is_wanted[message.stream] => None,
            Ok(message) => self.record(&message).map(Ok),
            Err(error) => Some(Err(error)),
        })
    }

    /// The record of a message; `None` for a description, and for a message that can't be decoded.
    fn record(&self, message: &Message) -> Option<Record> {
        let id = self.ids[message.stream]?;
        let stream = self.streams.get(id);
        let (measured, device_time, index, data) = match &stream.shape {
            Shape::Description => return None,
            Shape::Message(_) => (placed(message), None, None, Data::Message(message.cdr.clone())),
            shape => {
                let decoded = decode(type_name(shape), &message.cdr).ok()?;
                let Decoded { stamp, device_time, index, data } = decoded;
                (stamp, device_time, index, data)
            }
        };
        let period_ns = if let Data::Wave(wave) = &data { wave.period_ns } else { 0.0 };
        let is_raw = stream.origin == Origin::Raw;
        let source_time = Some(message.publish_time).filter(|at| is_raw && *at != message.log_time);
        let sample = Sample {
            stream: id,
            measured,
            log_time: message.log_time,
            device_time,
            source_time,
            period_ns,
            index: index.unwrap_or(message.sequence.into()),
            turn: Turn::OnTime,
            data,
        };
        Some(Record { stream, sample, cdr: message.cdr.clone() })
    }
}

/// When a message of another computer was measured: its stamp if that is plausible, else the log time.
fn placed(message: &Message) -> Time {
    let late_secs = message.log_time.secs_since(message.publish_time);
    if late_secs.abs() <= STAMPED_SECS { message.publish_time } else { message.log_time }
}
