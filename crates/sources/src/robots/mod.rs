//! Robots on a ROS bus, found by namespace and type; a study need not list them.

mod choice;
mod conformity;
mod profile;
mod awaited;

use std::collections::BTreeMap;
use std::sync::Arc;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::{Shape, Stream};
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;

use crate::claims::{Claimed, Rank, is_of_sessions};
use crate::faces::Faces;
use crate::follow::follow;
use crate::{SourceContext, join};
use teampulse_core::pattern::Pattern;

use awaited::Awaited;

pub use awaited::unheard;
pub use choice::Choice;
pub use conformity::{Finding, Robot, conformity};
pub use profile::{Norm, PROFILE, norm, norm_of_type};

/// Robots on ROS, found by their namespace and by the types of their topics.
///
/// Battery, link, odometry, diagnostics and temperature are watched wherever a robot offers them in a standard type;
/// anything else must be named here.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Robots {
    /// The namespaces of the robots. A `*` stands for any part of a token; the token that contains it is the robot's
    /// id: `robot1` for `/robot*`. `/` takes everything on the domain as one robot, which then needs a `prefix`.
    pub namespace: String,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the domain of `ROS_DOMAIN_ID`, else 0.
    pub domain: Option<BusId>,
    /// The namespace given to a robot that has none: the topic `/odom` becomes `<prefix>/odom`.
    pub prefix: Option<Pattern>,
    /// The topic and field with the battery's state, if not a `sensor_msgs/BatteryState`.
    pub battery: Option<Field>,
    /// The topic and field with the quality of the radio link, if not a `wireless_msgs/Connection`.
    pub link: Option<Field>,
    /// The topic and field with the odometry, if not a `nav_msgs/Odometry`.
    pub odometry: Option<Field>,
    /// The topic and field with diagnostics, if not a `diagnostic_msgs/DiagnosticArray`.
    pub diagnostics: Option<Field>,
    /// The topic and field with a temperature, if not a `sensor_msgs/Temperature`.
    pub temperature: Option<Field>,
    /// Any other numbers to watch.
    pub numbers: Vec<Field>,
    /// Topics with images or video to record, relative to the robot. By default none, as they are large.
    pub images: Vec<String>,
    /// `"blur"`: pictures are recorded only with hidden faces, by the worker of type `blur`.
    pub faces: Faces,
    /// Topics on which people command the robot, relative to the robot and by their full names: `goal_pose`, `cmd_vel`.
    /// They are recorded unchanged, and their messages are counted as interventions. Topics with the robot's state
    /// don't count as commands.
    pub commands: Vec<String>,
    /// Any other topics to record unchanged, relative to the robot; `*` as in `namespace`.
    pub topics: Vec<String>,
    /// The parameters that every robot must offer for `check` to say go: `battery`, `link`, `odometry`, `diagnostics`,
    /// `temperature`.
    pub required: Vec<String>,
    /// The ids of the robots that must be present for `check` to say go.
    pub robots: Vec<String>,
}

/// A number inside a topic of a robot.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// The topic, relative to the robot: `battery_sensor/value`.
    pub topic: String,
    /// The field inside the message: `data`, `status[0].values[2].value`. By default the fields of the standard type.
    pub field: Option<String>,
    /// The unit of the number after scaling: `J`, `dBm`, `V`.
    pub unit: Option<String>,
    /// Factor from the message's number to `unit`.
    #[serde(default = "one")]
    pub scale: f64,
    /// The expected rate [Hz]; by default it is learned.
    pub rate_hz: Option<f64>,
}

fn one() -> f64 {
    1.0
}

impl Default for Robots {
    fn default() -> Robots {
        Robots {
            namespace: "/*".into(),
            domain: None,
            prefix: None,
            battery: None,
            link: None,
            odometry: None,
            diagnostics: None,
            temperature: None,
            numbers: Vec::new(),
            images: Vec::new(),
            faces: Faces::Keep,
            commands: Vec::new(),
            topics: Vec::new(),
            required: Vec::new(),
            robots: Vec::new(),
        }
    }
}

impl Robots {
    /// Returns all fields that the study names.
    pub fn fields(&self) -> impl Iterator<Item = &Field> {
        self.mapped().into_values().chain(&self.numbers)
    }

    /// Whether a stream belongs to a robot that these settings describe.
    pub fn describe(&self, stream: &Stream) -> bool {
        let Ok(choice) = Choice::new(self) else { return false };
        let topic = match &self.prefix {
            Some(prefix) => stream.name.strip_prefix(prefix.text()),
            None => Some(stream.name.as_str()),
        };
        topic.and_then(|topic| choice.robot(topic)).is_some_and(|(id, _)| id == stream.id)
    }

    /// Whether these settings take a stream: it belongs to one of their robots, and its name or type is wanted.
    pub fn take(&self, stream: &Stream) -> bool {
        let Shape::Message(schema) = &stream.shape else { return self.describe(stream) };
        let Ok(choice) = Choice::new(self) else { return false };
        let prefix = self.prefix.as_ref().map_or("", Pattern::text);
        let topic = stream.name.strip_prefix(prefix);
        self.describe(stream)
            && topic.is_some_and(|topic| choice.stream(topic, &schema.name).is_some())
    }

    /// Whether these settings, listed first, describe all robots that others describe.
    pub fn cover(&self, others: &Robots) -> bool {
        let namespace = |robots: &Robots| robots.namespace.trim_end_matches('/').to_owned();
        let (ours, theirs) = (namespace(self), namespace(others));
        let matches = |pattern: Pattern| pattern.matches(&theirs);
        let is_wider = ours == theirs || Pattern::parse(&ours).is_ok_and(matches);
        self.domain == others.domain && is_wider
    }

    /// Returns the topics that the study names in full, each with its setting: those that are watched or recorded by
    /// name.
    pub fn named(&self) -> Vec<(&'static str, &str)> {
        let mapped = self.mapped().into_iter().map(|(key, field)| (key, field.topic.as_str()));
        let images = self.images.iter().map(|topic| ("images", topic.as_str()));
        let numbers = self.numbers.iter().map(|field| ("numbers", field.topic.as_str()));
        let in_full = |topic: &&String| !topic.contains('*');
        let topics = self.topics.iter().filter(in_full);
        let topics = topics.map(|topic| ("topics", topic.trim_matches('/')));
        mapped.chain(images).chain(numbers).chain(topics).collect()
    }

    /// Returns the fields that the study names in place of those of the standard types, by parameter (`battery`, `link`, …).
    fn mapped(&self) -> BTreeMap<&'static str, &Field> {
        [
            ("battery", &self.battery),
            ("link", &self.link),
            ("odometry", &self.odometry),
            ("diagnostics", &self.diagnostics),
            ("temperature", &self.temperature),
        ]
        .into_iter()
        .filter_map(|(parameter, field)| Some((parameter, field.as_ref()?)))
        .collect()
    }
}

impl Component<dyn Source, SourceContext> for Robots {
    const EXAMPLE: &'static str = r#"namespace = "/robot*"
domain    = 0
battery   = { topic = "battery_state" }
link      = { topic = "wifi", field = "signal_level", unit = "dBm" }
commands  = ["goal_pose", "cmd_vel"]
required  = ["battery"]"#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        for parameter in &self.required {
            if norm(parameter).is_none() {
                let known: Vec<&str> = PROFILE.iter().map(|norm| norm.parameter).collect();
                let message = format!("`{parameter}` is not a parameter that can be required");
                return Err(SettingsError::new(message)
                    .with_hint(format!("use one of {}", known.join(", "))));
            }
        }
        let choice = Choice::new(&self)?;
        let bus = join(context, self.domain.as_ref())?;
        let wanted = choice.clone();
        let claimed = context.claims.lay(&bus, Rank::Robots, move |each| {
            !is_of_sessions(&each.topic) && wanted.stream(&each.topic, &each.type_name).is_some()
        });
        let awaited = Awaited::new(&self);
        Ok(Box::new(RobotsSource { bus, choice, claimed, awaited }))
    }
}

/// A running source of robots.
struct RobotsSource {
    bus: Arc<dyn Bus>,
    choice: Choice,
    claimed: Claimed,
    awaited: Awaited,
}

#[async_trait]
impl Source for RobotsSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let awaited = &self.awaited;
        let following = follow(Arc::clone(&self.bus), outlet, |endpoint| {
            let is_ours = !is_of_sessions(&endpoint.topic) && self.claimed.is_ours(endpoint);
            let chosen = || self.choice.stream(&endpoint.topic, &endpoint.type_name);
            is_ours.then(chosen).flatten().inspect(|stream| awaited.see(stream))
        });
        tokio::select! {
            ended = following => ended,
            never = awaited.report(outlet) => match never {},
        }
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}
