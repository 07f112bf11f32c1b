//! The health of every stream, published on `/diagnostics`.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::Sink;
use teampulse_ros::BusId;
use teampulse_ros::diagnostics::DiagnosticsSink;

use crate::SinkContext;

/// Publishes the health of every stream, clock included, as one `diagnostic_msgs/DiagnosticArray` a second on
/// `/diagnostics`; that of people's streams only if these are published, too. Every session has it.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Diagnostics {
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default that of the session.
    pub domain: Option<BusId>,
}

impl Component<dyn Sink, SinkContext> for Diagnostics {
    const EXAMPLE: &'static str = "domain = 5";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let bus = context.ros.bus(self.domain.as_ref())?;
        Ok(Box::new(DiagnosticsSink::new(bus, context.ros.publish.clone())))
    }
}
