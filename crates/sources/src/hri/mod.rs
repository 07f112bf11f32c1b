//! People whose faces and bodies other programs see, on ROS as REP-155 (ROS4HRI) has it.
//!
//! ```text
//! /humans/faces/<id>/landmarks ──┐
//! /humans/faces/<id>/expression ─┤ whose face is it? ──► numbers ──► /humans/persons/p001/hri/landmarks
//! /humans/bodies/<id>/skeleton2d ┘        ▲
//! /humans/persons/<id>/face_id ───────────┘
//! ```
//!
//! Ids of faces and bodies last as long as somebody is in view. Topics come and go with them; the stream of a person goes on.

mod topic;
mod people;
mod listening;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::Stream;
use teampulse_messages::hri::{Frame, is_frame};
use teampulse_ros::BusId;
use teampulse_ros::bus::{Arrival, Asked, Bus, Subscription};
use teampulse_ros::graph::{Endpoint, Graph};

use crate::claims::Rank;
use crate::{SourceContext, join};

use listening::Listening;
use people::People;
use topic::Topic;

/// How many messages a subscription keeps until they are taken.
const DEPTH: u32 = 100;
/// The most topics that are followed at once; a face has a few.
const MOST_TOPICS: usize = 2000;
/// Counted losses are reported at least this often.
const REPORT_LOSSES: Duration = Duration::from_millis(500);
/// Where REP-155 has people.
const NAMESPACE: &str = "/humans";
/// The device of its streams, and the token of their names, in that namespace.
const DEVICE: &str = "hri";

/// People as other programs see them: faces, bodies, expressions and gaze in messages of ROS4HRI (`hri_msgs`, REP-155), of
/// `hri_face_detect`, `hri_body_detect` or nodes around `OpenFace` and py-feat.
///
/// The numbers have the names and units of those that models of our own give, so that the features `face`, `posture` and
/// `expression` run on them: `/humans/persons/p001/hri/landmarks`, `skeleton2d`, `expression`, `facs`, `gaze`,
/// `engagement_status`, `position`. Ids of faces change when somebody was out of view; the person's streams go on.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hri {
    /// The person of the study, by pseudonym. Without it everyone that a person manager publishes is a person, under the id
    /// that it gives.
    #[serde(default)]
    pub person: Option<String>,
    /// The ids of faces that are the person's; a `*` stands for any part: `"*"` where only one person is in view. Of several
    /// at once, the one that was there first.
    #[serde(default)]
    pub face: Option<String>,
    /// The ids of bodies that are the person's, likewise.
    #[serde(default)]
    pub body: Option<String>,
    /// The person's id on ROS (`/humans/persons/<id>`), whose `face_id` and `body_id` say which face and body are the person's.
    #[serde(default)]
    pub id: Option<String>,
    /// A topic with the person's position, such as that of a motion capture system: `PoseStamped`,
    /// `PoseWithCovarianceStamped`, `PointStamped` or `Odometry`.
    #[serde(default)]
    pub position: Option<String>,
    /// Width and height of the camera's frame [px], where messages don't state them: skeletons never do, and without it
    /// there is no `posture`.
    #[serde(default)]
    pub frame: Option<Frame>,
    /// The namespace of all of these topics.
    #[serde(default = "namespace")]
    pub namespace: String,
    /// The ROS domain; without it that of `ROS_DOMAIN_ID`, else 0.
    #[serde(default)]
    pub domain: Option<BusId>,
}

fn namespace() -> String {
    NAMESPACE.to_owned()
}

impl Component<dyn Source, SourceContext> for Hri {
    const EXAMPLE: &'static str = r#"
person = "p001"
face   = "*"
body   = "*"
frame  = [640, 480]
"#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        self.check()?;
        let bus = join(context, self.domain.as_ref())?;
        // It leaves these topics to nobody else, and shares them with others of its kind: each has people of its own.
        let (namespace, position) = (self.namespace.clone(), self.position.clone());
        context.claims.lay(&bus, Rank::People, move |each| {
            topic(&namespace, position.as_deref(), each).is_some()
        });
        Ok(Box::new(HriSource { bus, settings: Arc::new(self) }))
    }
}

impl Hri {
    fn check(&self) -> Result<(), SettingsError> {
        let wrong = |message: String, at: &str, hint: &str| {
            Err(SettingsError::new(message).at(at).with_hint(hint))
        };
        if let Some(person) = &self.person {
            crate::wearables::check_person(person)?;
        }
        let of_person = [
            ("face", self.face.is_some()),
            ("body", self.body.is_some()),
            ("id", self.id.is_some()),
            ("position", self.position.is_some()),
        ];
        let is_whose = of_person.iter().find(|(_, is_given)| *is_given);
        if let (Some((setting, _)), None) = (is_whose, &self.person) {
            let message = format!("`{setting}` is given, but not whose it is");
            return wrong(message, setting, "give the person, such as `person = \"p001\"`");
        }
        if let (Some(_), Some((setting, _))) = (&self.id, of_person[..2].iter().find(|(_, is)| *is))
        {
            let message = format!("`{setting}` and `id` both say which one is the person's");
            return wrong(message, setting, "leave one of them out");
        }
        for (setting, topic) in
            [("namespace", Some(&self.namespace)), ("position", self.position.as_ref())]
        {
            if topic.is_some_and(|topic| Pattern::parse(topic).is_err() || topic.contains('*')) {
                let message = format!("`{}` is not a ROS name", topic.map_or("", |it| it));
                return wrong(message, setting, "give one such as \"/humans\"");
            }
        }
        if self.frame.is_some_and(|frame| !is_frame(&frame)) {
            let hint = "give width and height, such as [640, 480]";
            return wrong("a camera's frame has 1 to 65536 pixels a side".into(), "frame", hint);
        }
        Ok(())
    }

    /// The device of its streams.
    fn device(&self) -> String {
        let tokens = self.namespace.split('/').filter(|token| !token.is_empty());
        let other: Vec<&str> = tokens.filter(|token| *token != "humans").collect();
        if other.is_empty() { DEVICE.to_owned() } else { format!("{DEVICE}_{}", other.join("_")) }
    }
}

/// What a publisher's topic is.
fn topic(namespace: &str, position: Option<&str>, endpoint: &Endpoint) -> Option<Topic> {
    let (name, type_name) = (endpoint.topic.as_str(), endpoint.type_name.as_str());
    Topic::of(namespace, name, type_name)
        .or_else(|| Topic::of_position(name, type_name).filter(|_| position == Some(name)))
}

/// Whether a topic says something of people as REP-155 has it.
pub fn hears(topic: &str, type_name: &str) -> bool {
    Topic::of(NAMESPACE, topic, type_name).is_some()
}

/// Whether a topic shows a face or a body as REP-155 has it.
pub fn sees(topic: &str, type_name: &str) -> bool {
    let known = Topic::of(NAMESPACE, topic, type_name);
    known.is_some_and(|known| matches!(known, Topic::Face { .. } | Topic::Body { .. }))
}

/// Whether a stream is of somebody whom other programs see.
pub fn is_seen(stream: &Stream) -> bool {
    let device = stream.device.strip_prefix(DEVICE);
    device.is_some_and(|rest| rest.is_empty() || rest.starts_with('_')) && !stream.qos.is_empty()
}

/// People being seen.
struct HriSource {
    bus: Arc<dyn Bus>,
    settings: Arc<Hri>,
}

#[async_trait]
impl Source for HriSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let people = People::new(&self.settings);
        let device = self.settings.device();
        let (graph, frame) = (self.bus.graph(), self.settings.frame);
        let listening = Listening::new(outlet.clone(), graph, (people, device, frame));
        let mut following = Following {
            bus: &*self.bus,
            outlet,
            settings: &self.settings,
            listening: Arc::new(Mutex::new(listening)),
            subscriptions: BTreeMap::new(),
            is_full: false,
        };
        following.run().await
    }
}

/// The topics that are followed, as long as somebody publishes them.
struct Following<'a> {
    bus: &'a dyn Bus,
    outlet: &'a Outlet,
    settings: &'a Hri,
    listening: Arc<Mutex<Listening>>,
    /// By topic and type; `None` where the bus rejected it.
    subscriptions: BTreeMap<(String, String), Option<Subscription>>,
    is_full: bool,
}

impl Following<'_> {
    async fn run(&mut self) -> Result<(), SourceError> {
        let mut graph = self.bus.graph();
        let mut report_losses = tokio::time::interval(REPORT_LOSSES);
        let mut seen = Arc::<Graph>::default();
        loop {
            let before = std::mem::replace(&mut seen, Arc::clone(&graph.borrow_and_update()));
            if !Arc::ptr_eq(&before, &seen) {
                for topic in seen.changed_topics(&before) {
                    self.look(&topic, &seen);
                }
            }
            tokio::select! {
                changed = graph.changed() => if changed.is_err() {
                    let message = "follow the bus: it was closed".to_owned();
                    return Err(SourceError::Gone { message, hint: String::new() });
                },
                _ = report_losses.tick() => lock(&self.listening).report_losses(),
                () = self.outlet.closed() => {
                    lock(&self.listening).report_losses();
                    return Ok(());
                }
            }
        }
    }

    /// Follows the topic if it is wanted, and no longer if nobody publishes it.
    fn look(&mut self, topic: &str, graph: &Graph) {
        let published: Vec<&Endpoint> = graph.publishers(topic).filter(|each| !each.own).collect();
        let is_published = |type_name: &str| published.iter().any(|it| it.type_name == type_name);
        self.subscriptions.retain(|(name, type_name), _| name != topic || is_published(type_name));
        for endpoint in published {
            let key = (endpoint.topic.clone(), endpoint.type_name.clone());
            if self.subscriptions.contains_key(&key) {
                continue;
            }
            let position = self.settings.position.as_deref();
            let Some(known) = self::topic(&self.settings.namespace, position, endpoint) else {
                continue;
            };
            if self.subscriptions.len() >= MOST_TOPICS {
                if !std::mem::replace(&mut self.is_full, true) {
                    let namespace = &self.settings.namespace;
                    self.outlet.happen(passing(format!(
                        "{namespace}: more than {MOST_TOPICS} topics of people; the others are left out"
                    )));
                }
                return;
            }
            let subscription = self.subscribe(&key, known);
            self.subscriptions.insert(key, subscription);
        }
    }

    fn subscribe(
        &self,
        (name, type_name): &(String, String),
        known: Topic,
    ) -> Option<Subscription> {
        let (listening, key) = (Arc::clone(&self.listening), (name.clone(), type_name.clone()));
        let deliver =
            Arc::new(move |arrival: Arrival| lock(&listening).hear(&known, &key, &arrival));
        let asked = Asked::Adaptive { depth: DEPTH };
        let subscribed = self.bus.subscribe(name, type_name, asked, deliver);
        subscribed.map_err(|error| self.outlet.happen(passing(format!("failed to {error}")))).ok()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(settings: &str) -> String {
        let hri: Hri = toml::from_str(settings).expect("settings");
        hri.check().err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn settings_that_contradict_each_other_are_refused() {
        for settings in ["", "person = \"p001\"", "person = \"p001\"\nid = \"gvbec\""] {
            assert_eq!(wrong(settings), "", "{settings}");
        }
        assert!(wrong("face = \"*\"").contains("`face` is given, but not whose it is"));
        let both = wrong("person = \"p001\"\nbody = \"*\"\nid = \"gvbec\"");
        assert!(both.contains("`body` and `id` both say"), "{both}");
        assert!(wrong("person = \"p001\"\nframe = [0, 480]").contains("1 to 65536 pixels"));
        assert!(wrong("namespace = \"humans\"").contains("not a ROS name"));
    }

    #[test]
    fn streams_of_another_namespace_have_a_name_of_their_own() {
        let device = |namespace: &str| {
            let settings = format!("namespace = \"{namespace}\"");
            toml::from_str::<Hri>(&settings).expect("settings").device()
        };
        assert_eq!(["/humans", "/r1/humans"].map(device), ["hri", "hri_r1"]);
    }
}
