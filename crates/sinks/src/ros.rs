//! Publishes streams of the session on ROS.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::Sink;
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;
use teampulse_ros::buses::Buses;
use teampulse_ros::sink::{Publish, RosSink};

use crate::SinkContext;

/// Publishes the results about robots and the team, and the streams that the study lists under `publish`, on ROS. Every
/// session has this sink.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Ros {
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the session's bus.
    pub domain: Option<BusId>,
}

impl Component<dyn Sink, SinkContext> for Ros {
    const EXAMPLE: &'static str = "domain = 5";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let RosContext { publish, .. } = &context.ros;
        Ok(Box::new(RosSink::fresh(context.ros.bus(self.domain.as_ref())?, publish.clone())))
    }
}

/// The streams that a session publishes on ROS, and where.
#[derive(Clone)]
pub struct RosContext {
    /// The buses of the session.
    pub buses: Arc<Buses>,
    /// The bus of the session's own topics.
    pub bus: BusId,
    /// The streams that are published.
    pub publish: Publish,
}

/// Publishes nothing on an empty network.
impl Default for RosContext {
    fn default() -> RosContext {
        let publish = Publish::Named(Vec::<Pattern>::new());
        RosContext { buses: Arc::new(Buses::apart()), bus: BusId::from(0), publish }
    }
}

impl RosContext {
    /// Returns the bus that a sink names as `domain`, or else the session's bus.
    pub(crate) fn bus(&self, named: Option<&BusId>) -> Result<Arc<dyn Bus>, SettingsError> {
        let bus = self.buses.get(named.unwrap_or(&self.bus));
        bus.map_err(|error| {
            let wrong = SettingsError::new(format!("failed to {error}")).with_hint(error.hint());
            if named.is_some() { wrong.at("domain") } else { wrong }
        })
    }
}
