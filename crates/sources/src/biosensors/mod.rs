//! People's sensors as published by the package `ros2-foxy-wearable-biosensors`.
//!
//! Its nodes publish plain numbers without a stamp, each as soon as it is received: `/biosensors/<sensor>/<data>`,
//! where the token before `biosensors`, if there is one, is taken as the person. Source: its nodes at f51a8fe (2021).
//!
//! | sensor | quirk |
//! |---|---|
//! | `shimmer3_gsr` | `gsr` is a resistance [kOhm], `ppg` a voltage [mV]; at a requested 50 Hz it samples 32768 / 655 times a second |
//! | `polar_h10` | `ibi` is the low byte of an interval of 1/1024 s, and `dev`, intended as the battery, its high byte: together they are the interval. A second interval in a notification was not published |
//! | `empatica_e4` | `ibi` is in seconds, `acc` in 64ths of g, `st` the mean of 8 samples at 4 Hz |
//! | `emotiv_insight` | `eeg` begins with a counter and whether the sample was interpolated |
//!
//! The topics of chunks (`bvp_chunk`) repeat the data of the others.

mod topic;

use std::sync::{Arc, Mutex, PoisonError};

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Clock;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::Stream;
use teampulse_core::time::Time;
use teampulse_messages::convert::Decoded;
use teampulse_ros::BusId;
use teampulse_ros::bus::{Arrival, Asked, Bus};
use teampulse_ros::graph::Endpoint;

use crate::claims::{Claimed, Rank};
use crate::follow::{Decoder, follow_decoded};
use crate::{SourceContext, join};

pub use topic::{LowBytes, Topic};

/// The queue size of the subscription to low bytes.
const DEPTH: u32 = 100;

/// Sensors of people as published by the nodes of ros2-foxy-wearable-biosensors: `/biosensors/empatica_e4/gsr`.
///
/// They become streams of a person, with units and rates: `/humans/persons/p001/empatica_e4/eda`. Their samples have no
/// stamps: regular signals are timed by sample number and arrival, all others by arrival alone, so run the nodes on
/// this machine or on a separate network. The two bytes of a Polar H10's intervals are combined.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Biosensors {
    /// The pseudonym of the wearer, for topics whose namespace names no person; topics below `/p007/biosensors` belong
    /// to `p007`.
    pub person: String,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the domain of `ROS_DOMAIN_ID`, else 0.
    #[serde(default)]
    pub domain: Option<BusId>,
}

impl Component<dyn Source, SourceContext> for Biosensors {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        crate::wearables::check_person(&self.person)?;
        let bus = join(context, self.domain.as_ref())?;
        let person: Arc<str> = self.person.into();
        let wearer = Arc::clone(&person);
        let claimed = context.claims.lay(&bus, Rank::People, move |each| {
            Topic::of(&each.topic, &each.type_name, &wearer).is_some()
        });
        Ok(Box::new(BiosensorsSource { bus, person, claimed }))
    }
}

/// Whether a stream comes from a sensor that one of these nodes publishes.
pub fn is_published(stream: &Stream) -> bool {
    // Streams that this computer reads from a device itself have no publisher, and so no QoS.
    topic::is_sensor(&stream.device) && !stream.qos.is_empty()
}

/// A running source of published sensors.
struct BiosensorsSource {
    bus: Arc<dyn Bus>,
    person: Arc<str>,
    claimed: Claimed,
}

impl BiosensorsSource {
    /// Returns the stream of a publisher's topic; `None` if it carries only part of a stream or belongs to another
    /// source.
    fn choose(&self, endpoint: &Endpoint) -> Option<Stream> {
        let topic = Topic::of(&endpoint.topic, &endpoint.type_name, &self.person)?;
        let is_ours = !topic.is_low_byte() && self.claimed.is_ours(endpoint);
        is_ours.then_some(topic.stream)
    }
}

#[async_trait]
impl Source for BiosensorsSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let (bus, person, clock) = (&self.bus, &self.person, outlet.clock().clone());
        let decoder = |endpoint: &Endpoint| reader(&**bus, endpoint, person, &clock);
        follow_decoded(Arc::clone(bus), outlet, |endpoint| self.choose(endpoint), &decoder).await
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}

/// Returns the decoder of a topic's messages.
fn reader(
    bus: &dyn Bus,
    endpoint: &Endpoint,
    person: &str,
    clock: &Clock,
) -> Result<Decoder, String> {
    let nothing = || format!("identify the topic {}", endpoint.topic);
    let topic = Topic::of(&endpoint.topic, &endpoint.type_name, person).ok_or_else(nothing)?;
    let low_bytes = Arc::new(Mutex::new(LowBytes::default()));
    let listening = topic.low_byte_topic().map(|(name, type_name)| {
        let low = Topic::of(&name, type_name, person);
        let (low_bytes, clock) = (Arc::clone(&low_bytes), clock.clone());
        let deliver = Arc::new(move |arrival: Arrival| {
            let mut low_bytes = low_bytes.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(low) = &low {
                low.read(&arrival.bytes, written(&arrival, &clock), &mut low_bytes);
            }
        });
        bus.subscribe(&name, type_name, Asked::Adaptive { depth: DEPTH }, deliver)
    });
    let listening = listening.transpose().map_err(|error| error.to_string())?;
    let clock = clock.clone();
    Ok(Arc::new(move |arrival: &Arrival| {
        let _held = &listening;
        let mut low_bytes = low_bytes.lock().unwrap_or_else(PoisonError::into_inner);
        let data = topic.read(&arrival.bytes, written(arrival, &clock), &mut low_bytes);
        let unread = || match topic.low_byte_topic() {
            Some((low, _)) => format!("find the low byte of an interval on {low}"),
            None => "read a number".to_owned(),
        };
        let data = data.ok_or_else(unread)?;
        Ok(Some(Decoded { stamp: Time::EPOCH, device_time: None, index: None, data }))
    }))
}

/// Returns when a message was published, or the current time if the bus does not know that.
fn written(arrival: &Arrival, clock: &Clock) -> Time {
    arrival.source_time.unwrap_or_else(|| clock.now())
}
