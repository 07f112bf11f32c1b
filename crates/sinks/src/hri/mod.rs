//! Publishes what models see of people, for programs that read ROS4HRI (REP-155).
//!
//! ```text
//! /humans/persons/p001/robot1_front/yunet ──► hri_msgs ──► /humans/faces/p001/landmarks, …/roi
//!                                                └───────► /humans/faces/tracked, /humans/persons/p001/face_id
//! ```

mod view;
mod tracked;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Clock;
use teampulse_core::data::Data;
use teampulse_core::pattern::Pattern;
use teampulse_core::qos::Qos;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{About, Shape, Stream, StreamId};
use teampulse_messages::catalogue::shipped_or_bare;
use teampulse_messages::hri::{Frame, is_frame};
use teampulse_ros::BusId;
use teampulse_ros::bus::{Bus, Publisher};

use self::tracked::Tracked;
use self::view::View;
use crate::SinkContext;

/// The longest wait for input before checking who is out of view.
const PATIENCE: Duration = Duration::from_millis(200);
/// The namespace of people in REP-155.
const NAMESPACE: &str = "/humans";
/// The number of messages that are kept for slow subscribers.
const DEPTH: u32 = 10;

/// Publishes what models see of people as `hri_msgs` under the names of REP-155, for nodes with libhri or pyhri: points
/// and regions of faces, expressions, action units, gaze, skeletons, and the lists of who is in view.
///
/// Everyone on that ROS domain can read these topics, so only listed streams are published. A face or a body has the id
/// of its person, as in `/humans/faces/p001/landmarks`; as seen by a second camera, it has the id `p001_2`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hri {
    /// The topics of the streams, each of which begins with a token without a star: `["/humans/persons/p001/*/yunet"]`.
    /// Streams other than people's faces, bodies, expressions, action units and gaze are left out.
    pub streams: Vec<String>,
    /// The width and height of the frames [px], for streams that do not state them, such as those of your own workers.
    #[serde(default)]
    pub frame: Option<Frame>,
    /// The largest angle between a gaze and the direction to the camera at which a person counts as looking at the
    /// robot that carries the camera [rad].
    #[serde(default = "at_robot_within_rad")]
    pub at_robot_within_rad: f64,
    /// The namespace of the topics.
    #[serde(default = "namespace")]
    pub namespace: String,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the session's bus.
    #[serde(default)]
    pub domain: Option<BusId>,
}

fn namespace() -> String {
    NAMESPACE.to_owned()
}

fn at_robot_within_rad() -> f64 {
    0.26
}

impl Component<dyn Sink, SinkContext> for Hri {
    const EXAMPLE: &'static str = r#"streams = ["/humans/persons/p001/robot1_front/*"]"#;

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let wanted = self.wanted()?;
        if self.frame.is_some_and(|frame| !is_frame(&frame)) {
            let error = SettingsError::new("a camera's frame has 1 to 65536 pixels per side");
            return Err(error.at("frame").with_hint("give width and height, such as [640, 480]"));
        }
        if !(0.0..=std::f64::consts::PI).contains(&self.at_robot_within_rad) {
            let error =
                SettingsError::new("the angle must be from 0 to pi").at("at_robot_within_rad");
            return Err(error.with_hint("0.26 rad are 15 degrees"));
        }
        if Pattern::parse(&self.namespace).is_err() || self.namespace.contains('*') {
            let error = SettingsError::new(format!("`{}` is not a ROS name", self.namespace));
            return Err(error.at("namespace").with_hint("give a name such as \"/humans\""));
        }
        let bus = context.ros.bus(self.domain.as_ref())?;
        let namespace = self.namespace.trim_end_matches('/').to_owned();
        Ok(Box::new(HriSink {
            wanted,
            frame: self.frame,
            at_robot_within_rad: self.at_robot_within_rad,
            clock: context.clock.clone(),
            topics: Topics { bus, namespace, publishers: BTreeMap::new(), has_refused: false },
            views: BTreeMap::new(),
            ids: Ids::default(),
            tracked: Tracked::default(),
        }))
    }
}

impl Hri {
    fn wanted(&self) -> Result<Vec<Pattern>, SettingsError> {
        let hint = "list topics, such as [\"/humans/persons/p001/*/yunet\"]";
        if self.streams.is_empty() {
            let error = SettingsError::new("no stream is listed").at("streams");
            return Err(error.with_hint(hint));
        }
        let pattern = |(place, text): (usize, &String)| {
            let at = format!("streams.{place}");
            let pattern =
                Pattern::parse(text).map_err(|error| SettingsError::new(error).at(at.clone()))?;
            // As for `publish`: streams about people must be named, not matched by chance.
            if pattern.is_rooted() {
                return Ok(pattern);
            }
            let message =
                format!("`{text}` begins with a star, but streams about people must be named");
            Err(SettingsError::new(message).at(at).with_hint(hint))
        };
        self.streams.iter().enumerate().map(pattern).collect()
    }
}

/// The running sink.
struct HriSink {
    wanted: Vec<Pattern>,
    frame: Option<Frame>,
    at_robot_within_rad: f64,
    clock: Clock,
    topics: Topics,
    /// The view of each stream, with its description; `None` if the stream shows nothing of people.
    views: BTreeMap<StreamId, (Arc<Stream>, Option<View>)>,
    ids: Ids,
    tracked: Tracked,
}

/// The published topics, each of which is opened for its first message.
struct Topics {
    bus: Arc<dyn Bus>,
    namespace: String,
    publishers: BTreeMap<String, Option<Box<dyn Publisher>>>,
    has_refused: bool,
}

/// A message on a topic below the namespace.
struct Message {
    topic: String,
    type_name: &'static str,
    is_latched: bool,
    cdr: Bytes,
}

impl Message {
    fn new<M: teampulse_messages::standard::Message>(topic: String, message: &M) -> Message {
        Message { topic, type_name: M::NAME, is_latched: false, cdr: message.encode() }
    }

    fn latched(self) -> Message {
        Message { is_latched: true, ..self }
    }
}

/// The ids of faces and bodies: the id of their person, followed by a number if further cameras see the person.
#[derive(Debug, Default)]
struct Ids(BTreeMap<String, Vec<String>>);

impl Ids {
    /// Returns the id of a person as seen by this camera.
    fn of(&mut self, person: &str, camera: &str) -> String {
        let cameras = self.0.entry(person.to_owned()).or_default();
        let known = cameras.iter().position(|each| each == camera);
        let place = known.unwrap_or_else(|| {
            cameras.push(camera.to_owned());
            cameras.len() - 1
        });
        if place == 0 { person.to_owned() } else { format!("{person}_{}", place + 1) }
    }
}

impl Topics {
    fn publish(&mut self, message: &Message, inbox: &Inbox) {
        let name = format!("{}/{}", self.namespace, message.topic);
        let open = || {
            let qos = if message.is_latched { Qos::latched(1) } else { Qos::reliable(DEPTH) };
            let opened = self.bus.publish(&name, &shipped_or_bare(message.type_name), &qos);
            opened.map_err(|error| inbox.report(format!("hri: failed to {error}"))).ok()
        };
        let publisher = self.publishers.entry(name.clone()).or_insert_with(open);
        let published = publisher.as_ref().map(|publisher| publisher.publish(&message.cdr));
        if let Some(Err(error)) = published
            && !std::mem::replace(&mut self.has_refused, true)
        {
            tracing::error!("failed to {error}; further failures are not reported");
        }
    }
}

impl HriSink {
    fn take(&mut self, record: &Record, inbox: &Inbox) {
        let Data::Sample(numbers) = &record.sample.data else { return };
        if record.sample.turn == Turn::Duplicate {
            return;
        }
        let id = record.sample.stream;
        let is_known = self.views.get(&id).is_some_and(|(of, _)| Arc::ptr_eq(of, &record.stream));
        if !is_known {
            let view = self.view(&record.stream, inbox);
            self.views.insert(id, (Arc::clone(&record.stream), view));
        }
        let Some((_, Some(view))) = self.views.get_mut(&id) else { return };
        let messages = match view.messages(record.sample.measured, numbers) {
            Ok(messages) => messages,
            Err(why) => return inbox.report(format!("hri: {} {why}", record.stream.name)),
        };
        if messages.is_empty() {
            return;
        }
        self.tracked.see(view.part, &view.id, &record.stream.id, self.clock.now());
        for message in &messages {
            self.topics.publish(message, inbox);
        }
    }

    fn view(&mut self, stream: &Stream, inbox: &Inbox) -> Option<View> {
        let camera = stream.inputs.first().unwrap_or(&stream.device);
        let id = self.ids.of(&stream.id, camera);
        let view = View::of(stream, id, (self.frame, self.at_robot_within_rad));
        if view.is_none() {
            let name = &stream.name;
            inbox.report(format!(
                "hri: {name} is not published: it is not a face, body, expression, action unit or gaze of a person"
            ));
        }
        view
    }

    fn look(&mut self, inbox: &Inbox) {
        for message in self.tracked.look(self.clock.now()) {
            self.topics.publish(&message, inbox);
        }
    }
}

impl Sink for HriSink {
    fn name(&self) -> &'static str {
        "hri"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        let wanted = self.wanted.clone();
        Wants::Only(Box::new(move |stream| {
            stream.about == About::Person
                && stream.shape == Shape::Sample
                && wanted.iter().any(|pattern| pattern.matches(&stream.name))
        }))
    }

    fn run(mut self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => batch.iter().for_each(|record| self.take(record, &inbox)),
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
            self.look(&inbox);
        }
    }
}
