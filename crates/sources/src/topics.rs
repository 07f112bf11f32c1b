//! Any topics, recorded as they are.

use std::sync::Arc;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::{About, Shape, Stream, Subject};
use teampulse_ros::bus::Bus;

use crate::follow::follow;
use crate::pattern::Pattern;
use crate::{SourceContext, join};

/// Any ROS topics by name, recorded as they are; what a robot of the study owns is left to it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Topics {
    /// The names of the topics; a `*` stands for any part of a token, and `/**` for everything.
    pub names: Vec<Pattern>,
    /// The ROS domain; without it that of `ROS_DOMAIN_ID`, else 0.
    pub domain: Option<u32>,
}

impl Component<dyn Source, SourceContext> for Topics {
    const EXAMPLE: &'static str = r#"names = ["/tf", "/tf_static", "/map*"]"#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let bus = join(context, self.domain)?;
        Ok(Box::new(Watch { bus, names: self.names }))
    }
}

/// Topics being recorded.
struct Watch {
    bus: Arc<dyn Bus>,
    names: Vec<Pattern>,
}

#[async_trait]
impl Source for Watch {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        follow(Arc::clone(&self.bus), outlet, |endpoint| {
            let named = self.names.iter().any(|name| name.matches(&endpoint.topic));
            let of_robot = |(_, known): (_, Arc<Stream>)| known.about == About::Robot;
            let wanted = named && !outlet.streams().find(&endpoint.topic).is_some_and(of_robot);
            wanted.then(|| Stream::raw(&endpoint.topic, Subject::session(), Shape::Sample))
        })
        .await
    }
}
