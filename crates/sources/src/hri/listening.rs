//! Handles the messages of all topics and converts them to streams.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::data::Data;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::Reading;
use teampulse_core::stream::{Channel, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::text::label;
use teampulse_core::time::Time;
use teampulse_messages::catalogue::shipped_or_bare;
use teampulse_messages::fields::header_stamp;
use teampulse_messages::hri::{Frame, Kind};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::std_msgs::Text;
use teampulse_ros::bus::Arrival;
use teampulse_ros::graph::{Gid, Graph};
use tokio::sync::watch;

use super::people::{Owner, People, Seen};
use super::topic::Topic;
use crate::follow::{LossCounter, offered, who};
use crate::ros_people::NAMESPACE;

/// The time without messages after which a topic's publisher counts as gone, so that another is accepted [s].
const SILENT_SECS: f64 = 1.0;
/// The largest number of streams.
const MOST_STREAMS: usize = 512;

/// The messages about people received so far.
pub(super) struct Listening {
    outlet: Outlet,
    graph: watch::Receiver<Arc<Graph>>,
    people: People,
    device: String,
    frame: Option<Frame>,
    /// Open streams, by person, last token of the stream name, and message type.
    streams: BTreeMap<(Arc<str>, &'static str, String), Open>,
    /// The problems that have been reported, each once.
    reported: BTreeSet<String>,
}

/// A stream of a person.
struct Open {
    id: StreamId,
    losses: LossCounter,
    heard: Heard,
}

/// The publisher of the last message.
struct Heard {
    topic: String,
    publisher: Gid,
    at: Time,
}

/// A message converted for its stream.
struct Read {
    stamp: Option<Time>,
    data: Data,
}

impl Listening {
    pub fn new(
        outlet: Outlet,
        graph: watch::Receiver<Arc<Graph>>,
        (people, device, frame): (People, String, Option<Frame>),
    ) -> Listening {
        let (streams, reported) = (BTreeMap::new(), BTreeSet::new());
        Listening { outlet, graph, people, device, frame, streams, reported }
    }

    /// Handles a message of a topic with this name and type.
    pub fn hear(&mut self, topic: &Topic, key: &(String, String), arrival: &Arrival) {
        if let Topic::Match { person, part } = topic {
            match Text::decode(&arrival.bytes) {
                Ok(id) if self.people.learn(person, *part, id.data.trim()) => {}
                Ok(_) => self.report("persons", "too many people, or an ID is too long"),
                Err(error) => self.report("persons", &format!("failed to read an ID: {error}")),
            }
            return;
        }
        let now = self.outlet.clock().now();
        let (sender, read) = self.read(topic, arrival);
        let stamp = read.as_ref().ok().and_then(|read| read.stamp);
        let person = match self.people.owner(topic, &sender, Seen { came: now, stamp }) {
            Owner::Person(person) => person,
            Owner::Nobody => return,
            Owner::Beside => {
                let why = "two at once: the first one is taken as the person's; set `id`, \
                           or IDs of faces and bodies, to distinguish people";
                return self.report(leaf(topic), why);
            }
        };
        let Some(mut open) = self.opened(topic, key, (&person, arrival.publisher, now)) else {
            return;
        };
        if self.is_second(&open, key, arrival, now) {
            self.streams.insert((person, leaf(topic), key.1.clone()), open);
            return self.report(leaf(topic), "a second publisher; its messages are ignored");
        }
        open.heard = Heard { topic: key.0.clone(), publisher: arrival.publisher, at: now };
        open.losses.count(arrival, &self.outlet);
        match read {
            Ok(Read { stamp, data }) => {
                let clock = self.outlet.clock();
                let source_time = stamp.map(|stamp| clock.session_from_stamp(stamp));
                let (stream, index, device_time) = (open.id, None, None);
                self.outlet.offer(Reading { stream, index, device_time, source_time, data });
            }
            Err(why) => {
                open.losses.refuse();
                self.report(leaf(topic), &format!("failed to {why}; counted as lost"));
            }
        }
        self.streams.insert((person, leaf(topic), key.1.clone()), open);
    }

    /// Reports the losses since the previous call.
    pub fn report_losses(&mut self) {
        for open in self.streams.values_mut() {
            open.losses.report(&self.outlet);
        }
    }

    /// Decodes a message; also returns the sender, if the message names one.
    fn read(&self, topic: &Topic, arrival: &Arrival) -> (String, Result<Read, String>) {
        let Some(kind) = kind(topic) else {
            let data = Data::Message(arrival.bytes.clone());
            return (String::new(), Ok(Read { stamp: header_stamp(&arrival.bytes), data }));
        };
        match kind.read(&arrival.bytes, self.frame) {
            Ok(seen) => {
                let data = Data::Sample(seen.numbers.into());
                (seen.sender, Ok(Read { stamp: seen.stamp, data }))
            }
            Err(error) => (String::new(), Err(error.to_string())),
        }
    }

    /// Whether a message comes from a publisher of the topic other than the accepted one.
    fn is_second(&self, open: &Open, key: &(String, String), arrival: &Arrival, now: Time) -> bool {
        let Heard { topic, publisher, at } = &open.heard;
        *topic == key.0
            && *publisher != arrival.publisher
            && now.secs_since(*at) <= SILENT_SECS
            && self.graph.borrow().publishers(topic).any(|each| each.gid == *publisher)
    }

    /// Takes a person's stream out of the open ones, or declares it.
    fn opened(
        &mut self,
        topic: &Topic,
        key: &(String, String),
        (person, publisher, now): (&Arc<str>, Gid, Time),
    ) -> Option<Open> {
        let place = (Arc::clone(person), leaf(topic), key.1.clone());
        if let Some(open) = self.streams.remove(&place) {
            return Some(open);
        }
        if self.streams.len() >= MOST_STREAMS {
            self.report(leaf(topic), "too many people");
            return None;
        }
        let stream = self.stream(topic, key, person, publisher);
        if stream.signal == Signal::Other && kind(topic) == Some(Kind::Skeleton) {
            let why = "a skeleton does not state the size of the camera's frame: its points are fractions of it, without `posture`; \
                       set `frame = [640, 480]`";
            self.report(leaf(topic), why);
        }
        let id = self.outlet.declare(stream);
        let losses = LossCounter::new(id, self.graph.clone());
        let heard = Heard { topic: key.0.clone(), publisher, at: now };
        Some(Open { id, losses, heard })
    }

    fn stream(
        &self,
        topic: &Topic,
        key: &(String, String),
        person: &Arc<str>,
        publisher: Gid,
    ) -> Stream {
        let (persons, device) = (NAMESPACE.trim_end_matches('*'), &self.device);
        let name = format!("{persons}{person}/{device}/{}", leaf(topic));
        let subject = Subject::person(&**person);
        let graph = self.graph.borrow();
        let stream = match (kind(topic), path(topic)) {
            (None, Some(path)) => Stream {
                channels: ["x", "y", "z"]
                    .map(|axis| Channel::new(format!("{path}.{axis}"), "m"))
                    .into(),
                ..Stream::raw(name, subject, Shape::Message(shipped_or_bare(&key.1)))
            },
            (kind, _) => {
                let channels = kind.map_or_else(Vec::new, |kind| kind.channels(self.frame));
                let channel = |(name, unit)| Channel::new(name, unit);
                Stream {
                    signal: kind.map_or(Signal::Other, |kind| signal(kind, self.frame)),
                    channels: channels.into_iter().map(channel).collect(),
                    ..Stream::raw(name, subject, Shape::Sample)
                }
            }
        };
        Stream {
            device: device.clone(),
            doc: doc(topic, &key.0),
            publisher: who(&graph, publisher),
            qos: offered(key, &graph),
            ..stream
        }
    }

    fn report(&mut self, what: &str, why: &str) {
        let said = label(format!("{}/{what}: {why}", self.device), 300);
        // A program may cause many problems; the first ones are enough.
        if self.reported.len() < 100 && self.reported.insert(said.clone()) {
            self.outlet.happen(passing(said));
        }
    }
}

/// The kind of a topic's messages; `None` for positions.
fn kind(topic: &Topic) -> Option<Kind> {
    match topic {
        Topic::Face { kind, .. } | Topic::Body { kind, .. } | Topic::Person { kind, .. } => {
            Some(*kind)
        }
        Topic::Gazing => Some(Kind::Gaze),
        Topic::BodyPosition { .. } | Topic::Position { .. } | Topic::Match { .. } => None,
    }
}

/// Returns the path to the point in a position message.
fn path(topic: &Topic) -> Option<&'static str> {
    match topic {
        Topic::BodyPosition { path, .. } | Topic::Position { path } => Some(path),
        _ => None,
    }
}

/// Returns the last token of the stream's name.
fn leaf(topic: &Topic) -> &'static str {
    kind(topic).map_or("position", Kind::topic)
}

/// Returns the signal type by which features select a stream. Points in fractions of a frame have no angles and no
/// distances.
fn signal(kind: Kind, frame: Option<Frame>) -> Signal {
    match kind {
        Kind::Landmarks => Signal::Face,
        Kind::Skeleton if frame.is_some() => Signal::Body,
        Kind::Expression => Signal::Expression,
        Kind::Skeleton | Kind::ActionUnits | Kind::Gaze | Kind::Engagement => Signal::Other,
    }
}

fn doc(topic: &Topic, name: &str) -> String {
    let what = match (kind(topic), topic) {
        (Some(Kind::Landmarks), _) => "face landmarks",
        (Some(Kind::ActionUnits), _) => "facial action units",
        (Some(Kind::Expression), _) => {
            "facial expression: the stated class with its confidence, the remainder shared among the other classes"
        }
        (Some(Kind::Gaze), _) => "whether the person looks at the robot",
        (Some(Kind::Skeleton), _) => "body keypoints",
        (Some(Kind::Engagement), _) => {
            "engagement with the robot: 1 disengaged, 2 engaging, 3 engaged, 4 disengaging"
        }
        (None, Topic::BodyPosition { .. }) => "position of a body",
        (None, _) => "position of the person",
    };
    format!("{what}, as detected by another program (first on {name})")
}
