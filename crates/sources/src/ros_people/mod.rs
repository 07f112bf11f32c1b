//! People whose signals other computers publish on ROS.

mod choice;
mod descriptions;

use std::sync::Arc;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::{About, Stream};
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;

use crate::claims::{Claimed, Rank};
use crate::follow::follow_ours;
use crate::{SourceContext, join};
use teampulse_core::pattern::Pattern;

use choice::Choice;
use descriptions::Descriptions;

/// People's signals on ROS, from the computers that measure them, found by namespace and type.
///
/// Each topic `<namespace>/<device>/<signal>` of type `teampulse_msgs/Wave`, `Sample` or `Event` is subscribed to; a
/// `teampulse_msgs/StreamDescription` on `/teampulse/streams`, as published by teampulse, describes its numbers.
/// Without a description, the topic's last token is the signal, and the numbers have no unit. Stamps are by the clock
/// of the measuring computer and are corrected by a model of that clock; a stamp more than a second from the arrival is
/// not trusted, unless messages continue in order after a network outage.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "People")]
pub struct RosPeople {
    /// The namespaces of the people. A `*` stands for any part of a token; the token that contains it is the person's
    /// id, a pseudonym: `p001` for `/humans/persons/*`.
    #[schemars(with = "String")]
    pub namespace: Pattern,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the domain of `ROS_DOMAIN_ID`, else 0.
    pub domain: Option<BusId>,
}

/// The default namespace of people.
pub const NAMESPACE: &str = "/humans/persons/*";

impl Default for RosPeople {
    fn default() -> RosPeople {
        let namespace = Pattern::parse(NAMESPACE).expect("it begins with a slash");
        RosPeople { namespace, domain: None }
    }
}

impl RosPeople {
    /// Whether a topic is a signal of a person in the namespace, by name and type.
    pub fn hears(&self, topic: &str, type_name: &str) -> bool {
        let choice = Choice::new(self.namespace.clone());
        choice.is_ok_and(|choice| choice.stream(topic, type_name).is_some())
    }

    /// Whether a stream belongs to a person that these settings describe.
    pub fn describe(&self, stream: &Stream) -> bool {
        stream.about == About::Person && self.namespace.split(&stream.name).is_some()
    }
}

/// Returns a line for each topic of a person that has a second publisher, such as a driver that was started twice; it
/// keeps the topic from being recorded well.
pub fn second_publishers<'a>(streams: impl Iterator<Item = &'a Stream>) -> Vec<String> {
    let doubles = streams.filter(|stream| !stream.beside.is_empty()).map(|stream| {
        format!("a single publisher of {}: {} publishes it, too", stream.beside, stream.publisher)
    });
    doubles.collect()
}

impl Component<dyn Source, SourceContext> for RosPeople {
    const EXAMPLE: &'static str = r#"namespace = "/humans/persons/*""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let choice = Choice::new(self.namespace)?;
        let bus = join(context, self.domain.as_ref())?;
        let wanted = choice.clone();
        let claimed = context.claims.lay(&bus, Rank::People, move |each| {
            wanted.stream(&each.topic, &each.type_name).is_some()
        });
        Ok(Box::new(RosPeopleSource { bus, choice, claimed }))
    }
}

/// A running source of people's signals.
struct RosPeopleSource {
    bus: Arc<dyn Bus>,
    choice: Choice,
    claimed: Claimed,
}

#[async_trait]
impl Source for RosPeopleSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let descriptions = Arc::new(Descriptions::default());
        let _listening = Arc::clone(&descriptions).listen(&*self.bus).map_err(|error| {
            SourceError::Gone { message: error.to_string(), hint: String::new() }
        })?;
        let choose = |endpoint: &teampulse_ros::graph::Endpoint| {
            let stream = self.choice.stream(&endpoint.topic, &endpoint.type_name)?;
            self.claimed.is_ours(endpoint).then(|| descriptions.complete(stream))
        };
        follow_ours(Arc::clone(&self.bus), outlet, choose, descriptions.updates()).await
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}
