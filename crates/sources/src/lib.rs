#![doc = include_str!("../README.md")]

pub mod robots;
pub mod ros_people;
pub mod biosensors;
pub mod ros_audio;
pub mod hri;
pub mod topics;
pub mod wearables;
pub mod lsl;
pub mod markers;
pub mod inputs;
pub mod camera;
pub mod microphone;
pub mod serial;
pub mod simulated;
pub mod emulated;
pub mod session;
pub mod claims;
mod core_files;
mod expected;
mod faces;
mod lock;
mod hearing;
mod follow;

use std::sync::Arc;

use teampulse_core::clock::Clock;
use teampulse_core::registry::{Entry, SettingsError};
use teampulse_core::source::Source;
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;
use teampulse_ros::buses::Buses;

use crate::claims::Claims;
use crate::wearables::bluetooth::Bluetooth;

/// The table of all sources.
pub const SOURCES: &[Entry<dyn Source, SourceContext>] = &[
    Entry::new::<robots::Robots>("robots"),
    Entry::new::<ros_people::RosPeople>("people"),
    Entry::new::<biosensors::Biosensors>("biosensors"),
    Entry::new::<ros_audio::RosAudio>("ros_audio"),
    Entry::new::<hri::Hri>("hri"),
    Entry::new::<topics::Topics>("topics"),
    Entry::new::<wearables::empatica_e4::EmpaticaE4>("empatica_e4"),
    Entry::new::<wearables::heart_rate::HeartRate>("heart_rate"),
    Entry::new::<wearables::polar::Polar>("polar"),
    Entry::new::<wearables::myo::Myo>("myo"),
    Entry::new::<wearables::shimmer3::Shimmer3>("shimmer3"),
    Entry::new::<lsl::Lsl>("lsl"),
    Entry::new::<markers::lines::MarkerLines>("marker_lines"),
    Entry::new::<markers::ttl::Ttl>("ttl"),
    Entry::new::<inputs::Inputs>("inputs"),
    Entry::new::<camera::Camera>("camera"),
    Entry::new::<microphone::Microphone>("microphone"),
];

/// The context that sources are built with.
#[derive(Clone)]
pub struct SourceContext {
    /// The session's clock.
    pub clock: Clock,
    /// The buses that the session has joined.
    pub buses: Arc<Buses>,
    /// The claims that decide which source takes which topic.
    pub claims: Claims,
    /// This computer's Bluetooth.
    pub bluetooth: Bluetooth,
}

/// Returns the bus that a source names as `domain`; by default the bus of `ROS_DOMAIN_ID`, else domain 0.
fn join(context: &SourceContext, bus: Option<&BusId>) -> Result<Arc<dyn Bus>, SettingsError> {
    let id = bus.map_or_else(|| context.buses.default_id(), |id| Ok(id.clone()));
    let joined = id.and_then(|id| context.buses.get(id));
    joined.map_err(|error| SettingsError::new(format!("failed to {error}")).with_hint(error.hint()))
}
