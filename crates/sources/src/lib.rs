#![doc = include_str!("../README.md")]

pub mod robots;
pub mod ros_people;
pub mod topics;
pub mod wearables;
pub mod simulated;
pub mod session;
pub mod claims;
mod follow;

use std::sync::Arc;

use teampulse_core::clock::Clock;
use teampulse_core::registry::{Entry, SettingsError};
use teampulse_core::source::Source;
use teampulse_ros::bus::Bus;
use teampulse_ros::buses::Buses;
use teampulse_ros::environment::HIGHEST_DOMAIN;

use crate::claims::Claims;

/// The table of all sources.
pub const SOURCES: &[Entry<dyn Source, SourceContext>] = &[
    Entry::new::<robots::Robots>("robots"),
    Entry::new::<ros_people::RosPeople>("people"),
    Entry::new::<topics::Topics>("topics"),
    Entry::new::<wearables::empatica_e4::EmpaticaE4>("empatica_e4"),
];

/// What sources are built with.
#[derive(Clone)]
pub struct SourceContext {
    /// The session's clock.
    pub clock: Clock,
    /// The buses that the session has joined.
    pub buses: Arc<Buses>,
    /// Which source takes which topic.
    pub claims: Claims,
}

/// The bus of a domain; without one that of `ROS_DOMAIN_ID`, else 0.
fn join(context: &SourceContext, domain: Option<u32>) -> Result<Arc<dyn Bus>, SettingsError> {
    if let Some(domain) = domain.filter(|domain| *domain > HIGHEST_DOMAIN) {
        let message = format!("{domain} is not a ROS domain: expected 0 to {HIGHEST_DOMAIN}");
        return Err(SettingsError::new(message));
    }
    let domain = domain.map_or_else(|| context.buses.default_domain(), Ok);
    let joined = domain.and_then(|domain| context.buses.get(domain));
    joined.map_err(|error| SettingsError::new(format!("failed to {error}")).with_hint(error.hint()))
}
