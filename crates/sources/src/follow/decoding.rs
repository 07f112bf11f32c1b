//! Messages that are decoded to samples: those of teampulse's own types, and those that a source parses.

use std::sync::{Arc, Mutex};

use teampulse_core::data::Data;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::pattern::last_token;
use teampulse_core::source;
use teampulse_core::stream::{Channel, Shape, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::convert::{self, Decoded, type_name};
use teampulse_ros::bus::{Arrival, Deliver};

use super::loss_counter::LossCounter;
use super::{Decoder, lock};

/// The number of messages after which a topic without a description gets the observed channels.
const UNDESCRIBED: u64 = 20;

/// The largest number of channels of a stream; one that claims more stays undescribed.
const MOST_CHANNELS: u32 = 1024;

/// The channels observed in a topic's messages.
#[derive(Debug, Default)]
pub(super) struct ObservedChannels {
    heard: u64,
    /// The number of channels, and the rate [Hz] or 0, of the newest message.
    width: u32,
    rate_hz: f64,
    refused: bool,
}

impl ObservedChannels {
    /// Adds the observed channels, without units, to a stream without a description.
    pub(super) fn describe(&self, stream: &mut Stream) {
        let is_known = !stream.channels.is_empty() || stream.shape == Shape::Event;
        if is_known || self.heard < UNDESCRIBED || self.width > MOST_CHANNELS {
            return;
        }
        let name = last_token(&stream.name);
        let name =
            |channel| if self.width == 1 { name.to_owned() } else { format!("{name}{channel}") };
        stream.channels = (1..=self.width).map(|channel| Channel::new(name(channel), "")).collect();
        stream.rate_hz = self.rate_hz;
    }

    fn hear(&mut self, data: &Data) {
        self.heard += 1;
        if self.heard > UNDESCRIBED {
            return;
        }
        match data {
            Data::Wave(wave) if wave.period_ns > 0.0 => {
                (self.width, self.rate_hz) = (wave.channels, 1e9 / wave.period_ns);
            }
            Data::Wave(wave) => self.width = wave.channels,
            Data::Sample(values) => self.width = u32::try_from(values.len()).unwrap_or(u32::MAX),
            _ => {}
        }
    }
}

/// How the messages of a topic are read.
#[derive(Clone)]
pub(super) struct Reading {
    pub(super) decoder: Decoder,
    /// Whether the messages are stamped by a computer's clock.
    pub(super) is_stamped: bool,
}

impl Reading {
    /// Returns how to read a topic of teampulse's own types.
    pub(super) fn of_ours(stream: &Stream) -> Reading {
        let shape = stream.shape.clone();
        let decoder: Decoder =
            Arc::new(move |arrival: &Arrival| decode(&shape, &arrival.bytes).map(Some));
        Reading { decoder, is_stamped: true }
    }
}

/// Returns the callback that decodes a stream's messages and offers them with the stamp in the header and the device
/// time. Undecodable messages are reported once, and counted as lost.
pub(super) fn deliver(
    outlet: &Outlet,
    (id, stream): (StreamId, &Stream),
    reading: &Reading,
    losses: &Arc<Mutex<LossCounter>>,
    observed: &Arc<Mutex<ObservedChannels>>,
) -> Deliver {
    let (outlet, topic) = (outlet.clone(), stream.name.clone());
    let decoder = Arc::clone(&reading.decoder);
    let (losses, observed) = (Arc::clone(losses), Arc::clone(observed));
    Arc::new(move |arrival: Arrival| {
        let (mut losses, mut observed) = (lock(&losses), lock(&observed));
        losses.count(&arrival, &outlet);
        match decoder(&arrival) {
            Ok(None) => {}
            Ok(Some(decoded)) => {
                observed.hear(&decoded.data);
                let stamp = (decoded.stamp != Time::EPOCH).then_some(decoded.stamp);
                let source_time = stamp.map(|stamp| outlet.clock().session_from_stamp(stamp));
                losses.number(&decoded, &arrival, &outlet);
                let Decoded { device_time, index, data, .. } = decoded;
                let stream = id;
                outlet.offer(source::Reading { stream, index, device_time, source_time, data });
            }
            Err(reason) => {
                losses.refuse();
                if !std::mem::replace(&mut observed.refused, true) {
                    outlet.happen(passing(format!("{topic}: failed to {reason}; counted as lost")));
                }
            }
        }
    })
}

fn decode(shape: &Shape, cdr: &[u8]) -> Result<Decoded, String> {
    let decoded = convert::decode(type_name(shape), cdr).map_err(|error| error.to_string())?;
    let is_empty = match &decoded.data {
        Data::Wave(wave) => wave.samples.is_empty(),
        Data::Sample(values) => values.is_empty(),
        _ => false,
    };
    if is_empty { Err("read a message without samples".into()) } else { Ok(decoded) }
}
