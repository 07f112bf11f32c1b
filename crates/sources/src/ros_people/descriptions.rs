//! Descriptions of streams that other computers publish.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use teampulse_core::data::Data;
use teampulse_core::stream::{About, Origin, Stream};
use teampulse_messages::convert;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs::StreamDescription;
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Subscription};

use crate::follow::Updates;

/// The topic on which streams are described.
const TOPIC: &str = "/teampulse/streams";
/// The queue size of the subscription to descriptions.
const DEPTH: u32 = 1000;
/// The largest number of people's streams whose descriptions are kept.
const MOST: usize = 10_000;

/// The newest descriptions of people's streams, by name.
#[derive(Debug, Default)]
pub struct Descriptions {
    known: Mutex<BTreeMap<String, Arc<Stream>>>,
    updates: Updates,
}

impl Descriptions {
    /// Listens on a bus until the subscription is dropped.
    pub fn listen(self: Arc<Self>, bus: &dyn Bus) -> Result<Subscription, BusError> {
        let deliver = Arc::new(move |arrival: Arrival| match describe(&arrival.bytes) {
            Ok(Some(stream)) => self.learn(stream),
            Ok(None) => {}
            Err(reason) => {
                tracing::warn!(publisher = %arrival.publisher, "failed to {reason} on {TOPIC}");
            }
        });
        let asked = Asked::Adaptive { depth: DEPTH };
        bus.subscribe(TOPIC, StreamDescription::NAME, asked, deliver)
    }

    /// The streams with a new description.
    pub fn updates(&self) -> &Updates {
        &self.updates
    }

    /// Returns the stream, completed by the description of a stream with its name and shape. It stays raw and keeps the
    /// subject in its name.
    pub fn complete(&self, stream: Stream) -> Stream {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        match known.get(&stream.name) {
            Some(described) if described.shape == stream.shape => Stream {
                name: stream.name,
                about: stream.about,
                id: stream.id,
                origin: Origin::Raw,
                beside: stream.beside,
                qos: stream.qos,
                ..Stream::clone(described)
            },
            _ => stream,
        }
    }

    fn learn(&self, stream: Arc<Stream>) {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() < MOST || known.contains_key(&stream.name) {
            self.updates.add(&stream.name);
            known.insert(stream.name.clone(), stream);
        }
    }
}

/// Reads a description; `None` if it is not about a person's stream.
fn describe(cdr: &[u8]) -> Result<Option<Arc<Stream>>, convert::DecodeError> {
    let decoded = convert::decode(StreamDescription::NAME, cdr)?;
    let Data::Description(stream) = decoded.data else { return Ok(None) };
    let is_scaled = stream.channels.iter().all(|channel| channel.scale.is_finite());
    let is_sound = is_scaled && stream.rate_hz.is_finite();
    Ok(Some(stream).filter(|stream| stream.about == About::Person && is_sound))
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Channel, Shape, Subject};
    use teampulse_core::time::Time;
    use teampulse_messages::standard::std_msgs::Header;

    use super::*;

    fn described(scale: f64) -> Option<f64> {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let mut raw = Stream::raw("/humans/persons/p001/own/ecg", subject, Shape::Wave);
        raw.channels = vec![Channel { scale, ..Channel::new("ecg", "mV") }];
        let description = StreamDescription::of(&raw, Header::at(Time::EPOCH));
        describe(&description.encode())
            .expect("a description")
            .map(|stream| stream.channels[0].scale)
    }

    #[test]
    fn a_scale_that_was_not_set_changes_no_number() {
        assert_eq!([0.0, -0.0, 0.5].map(described), [Some(1.0), Some(1.0), Some(0.5)]);
        assert_eq!(described(f64::NAN), None);
    }
}
