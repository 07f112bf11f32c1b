//! The health of every stream, published on `/diagnostics`.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::Sink;
use teampulse_ros::BusId;
use teampulse_ros::diagnostics::DiagnosticsSink;

use crate::SinkContext;

/// Publishes the health of every stream, including its clock, as one `diagnostic_msgs/DiagnosticArray` per second on
/// `/diagnostics`; people's streams are included only if they are published, too. Every session has this sink.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Diagnostics {
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the session's bus.
    pub domain: Option<BusId>,
}

impl Component<dyn Sink, SinkContext> for Diagnostics {
    const EXAMPLE: &'static str = "domain = 5";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let bus = context.ros.bus(self.domain.as_ref())?;
        Ok(Box::new(DiagnosticsSink::new(bus, context.ros.publish.clone())))
    }
}
