//! People detected by other programs: faces and bodies in ROS messages as specified by REP-155 (ROS4HRI).
//!
//! ```text
//! /humans/faces/<id>/landmarks ──┐
//! /humans/faces/<id>/expression ─┤ whose face is it? ──► numbers ──► /humans/persons/p001/hri/landmarks
//! /humans/bodies/<id>/skeleton2d ┘        ▲
//! /humans/persons/<id>/face_id ───────────┘
//! ```
//!
//! The ID of a face or body lasts only while the person is in view, and its topics come and go with it; the person's
//! stream continues.

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

/// The queue size of a subscription.
const DEPTH: u32 = 100;
/// The largest number of topics followed at once; a face has several.
const MOST_TOPICS: usize = 2000;
/// Counted losses are reported at least this often.
const REPORT_LOSSES: Duration = Duration::from_millis(500);
/// The namespace of people in REP-155.
const NAMESPACE: &str = "/humans";
/// The device of the streams, which is also a token in their names.
const DEVICE: &str = "hri";

/// People detected by other programs: faces, bodies, expressions and gaze in messages of ROS4HRI (`hri_msgs`,
/// REP-155), published by `hri_face_detect`, `hri_body_detect` or nodes around `OpenFace` and py-feat.
///
/// The values have the same names and units as those of teampulse's own models, so that the features `face`, `posture`
/// and `expression` work with them: `/humans/persons/p001/hri/landmarks`, `skeleton2d`, `expression`, `facs`, `gaze`,
/// `engagement_status`, `position`. The ID of a face changes when the person was out of view; the person's streams
/// continue.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hri {
    /// The person of the study, by pseudonym. Without it, everyone whom a person manager publishes is recorded, under
    /// the ID that it assigns.
    #[serde(default)]
    pub person: Option<String>,
    /// The IDs of faces that belong to the person; a `*` matches any part: use `"*"` if only one person is in view.
    /// If several are in view at once, the first one is used.
    #[serde(default)]
    pub face: Option<String>,
    /// The IDs of bodies that belong to the person, with the same pattern syntax as `face`.
    #[serde(default)]
    pub body: Option<String>,
    /// The person's ID on ROS (`/humans/persons/<id>`), whose `face_id` and `body_id` identify the person's face and
    /// body.
    #[serde(default)]
    pub id: Option<String>,
    /// A topic with the person's position, for example from a motion capture system: `PoseStamped`,
    /// `PoseWithCovarianceStamped`, `PointStamped` or `Odometry`.
    #[serde(default)]
    pub position: Option<String>,
    /// Width and height of the camera's frame [px], if messages do not state them: skeletons never do, and without the
    /// frame there is no `posture`.
    #[serde(default)]
    pub frame: Option<Frame>,
    /// The namespace of all these topics.
    #[serde(default = "namespace")]
    pub namespace: String,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the domain of `ROS_DOMAIN_ID`, else 0.
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
        // No other kind of source reads these topics; sources of this kind share them, each for its own people.
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
            let message = format!("`{setting}` needs a `person`");
            return wrong(message, setting, "set the person, such as `person = \"p001\"`");
        }
        if let (Some(_), Some((setting, _))) = (&self.id, of_person[..2].iter().find(|(_, is)| *is))
        {
            let message =
                format!("`{setting}` and `id` cannot be combined: both identify the person");
            return wrong(message, setting, "remove one of them");
        }
        for (setting, topic) in
            [("namespace", Some(&self.namespace)), ("position", self.position.as_ref())]
        {
            if topic.is_some_and(|topic| Pattern::parse(topic).is_err() || topic.contains('*')) {
                let message = format!("`{}` is not a ROS name", topic.map_or("", |it| it));
                return wrong(message, setting, "use one such as \"/humans\"");
            }
        }
        if self.frame.is_some_and(|frame| !is_frame(&frame)) {
            let hint = "set width and height, such as [640, 480]";
            return wrong(
                "each side of `frame` must be from 1 to 65536 pixels".into(),
                "frame",
                hint,
            );
        }
        Ok(())
    }

    /// The device of the source's streams.
    fn device(&self) -> String {
        let tokens = self.namespace.split('/').filter(|token| !token.is_empty());
        let other: Vec<&str> = tokens.filter(|token| *token != "humans").collect();
        if other.is_empty() { DEVICE.to_owned() } else { format!("{DEVICE}_{}", other.join("_")) }
    }
}

/// Returns what a publisher's topic contains; `None` for a topic that this source does not read.
fn topic(namespace: &str, position: Option<&str>, endpoint: &Endpoint) -> Option<Topic> {
    let (name, type_name) = (endpoint.topic.as_str(), endpoint.type_name.as_str());
    Topic::of(namespace, name, type_name)
        .or_else(|| Topic::of_position(name, type_name).filter(|_| position == Some(name)))
}

/// Whether a topic is about people according to REP-155.
pub fn hears(topic: &str, type_name: &str) -> bool {
    Topic::of(NAMESPACE, topic, type_name).is_some()
}

/// Whether a topic is about a face or a body according to REP-155.
pub fn sees(topic: &str, type_name: &str) -> bool {
    let known = Topic::of(NAMESPACE, topic, type_name);
    known.is_some_and(|known| matches!(known, Topic::Face { .. } | Topic::Body { .. }))
}

/// Whether a stream is about a person as detected by other programs.
pub fn is_seen(stream: &Stream) -> bool {
    let device = stream.device.strip_prefix(DEVICE);
    device.is_some_and(|rest| rest.is_empty() || rest.starts_with('_')) && !stream.qos.is_empty()
}

/// A running source of people.
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

    fn may_be_silent(&self) -> bool {
        true
    }
}

/// The followed topics, as long as they have publishers.
struct Following<'a> {
    bus: &'a dyn Bus,
    outlet: &'a Outlet,
    settings: &'a Hri,
    listening: Arc<Mutex<Listening>>,
    /// The subscriptions, by topic and type; `None` if the bus rejected one.
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

    /// Follows the topic if it is wanted, and stops when it has no publishers.
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
                        "{namespace}: more than {MOST_TOPICS} topics about people; the others are ignored"
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
        assert!(wrong("face = \"*\"").contains("`face` needs a `person`"));
        let both = wrong("person = \"p001\"\nbody = \"*\"\nid = \"gvbec\"");
        assert!(both.contains("`body` and `id` cannot be combined"), "{both}");
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
