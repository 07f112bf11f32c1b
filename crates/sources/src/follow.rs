//! Following topics on a bus: subscribe to what is wanted as it appears, and count what is lost.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use teampulse_core::clocks::SIMULATED_TIME;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::pump::session_events;
use teampulse_core::qos::Qos;
use teampulse_core::source::{Reading, SourceError};
use teampulse_core::stream::{Schema, Shape, Stream, StreamId};
use teampulse_messages::catalogue;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{self, Fields};
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Deliver, Incident, Subscription};
use teampulse_ros::graph::{Endpoint, EndpointKind, Graph};
use tokio::sync::Notify;
use tokio::sync::broadcast::error::RecvError;
use tokio::task::JoinSet;

use crate::hearing::{Hearing, hear};
use crate::tally::Tally;

/// How many messages a subscription keeps until they are taken. They are taken at once, so this
/// bounds a burst, not a delay.
const DEPTH: u32 = 2000;
/// How the name of the computer begins whose clock stamps a topic that several publish: each such
/// topic has one of its own.
const SEVERAL: &str = "several on ";
/// How often counted losses are told, at the latest.
const TELL_LOSSES: Duration = Duration::from_millis(500);

/// Follows the topics of a bus until the session is over, and keeps their messages as they came.
/// `choose` says what a publisher's topic becomes, or `None` when it is not wanted; its shape, offers
/// and losses are filled in here.
pub(crate) async fn follow(
    bus: Arc<dyn Bus>,
    outlet: &Outlet,
    choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
) -> Result<(), SourceError> {
    Following::new(bus, outlet, Kept::AsTheyCame).run(choose, &Notify::new()).await
}

/// The same for topics of our own types, of which the messages are decoded. `choose` gives them
/// their shape; it is asked again after each `news`, as descriptions come when they like. A topic
/// that nobody describes has the channels of its first message.
pub(crate) async fn follow_ours(
    bus: Arc<dyn Bus>,
    outlet: &Outlet,
    choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
    news: &Notify,
) -> Result<(), SourceError> {
    Following::new(bus, outlet, Kept::Decoded).run(choose, news).await
}

/// How messages are kept.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kept {
    /// Byte for byte.
    AsTheyCame,
    /// As samples of our own shapes.
    Decoded,
}

fn gone(message: &str) -> SourceError {
    SourceError::Gone { message: message.into(), hint: String::new() }
}

/// A topic with its type.
type Key = (String, String);

struct Following<'a> {
    bus: Arc<dyn Bus>,
    outlet: &'a Outlet,
    kept: Kept,
    followed: BTreeMap<Key, Followed>,
    /// What was told to be wrong: each thing once.
    told: BTreeSet<String>,
    /// The topics that are published from several places, and whether that was told.
    several: BTreeMap<Key, bool>,
    definitions: JoinSet<(Key, Result<Schema, BusError>)>,
}

struct Followed {
    id: StreamId,
    stream: Stream,
    /// Which computer stamps it, as it was told last.
    computer: Option<String>,
    tally: Arc<Mutex<Tally>>,
    /// What its messages say of themselves, where they are decoded.
    hearing: Arc<Mutex<Hearing>>,
    /// `None` when the bus would not have it; not tried again.
    _subscription: Option<Subscription>,
}

impl<'a> Following<'a> {
    fn new(bus: Arc<dyn Bus>, outlet: &'a Outlet, kept: Kept) -> Following<'a> {
        Following {
            bus,
            outlet,
            kept,
            followed: BTreeMap::new(),
            told: BTreeSet::new(),
            several: BTreeMap::new(),
            definitions: JoinSet::new(),
        }
    }

    async fn run(
        mut self,
        choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
        news: &Notify,
    ) -> Result<(), SourceError> {
        let mut graph = self.bus.graph();
        let mut incidents = self.bus.incidents();
        let mut tell_losses = tokio::time::interval(TELL_LOSSES);
        loop {
            let seen = Arc::clone(&graph.borrow_and_update());
            self.look_at(&seen, &choose);
            self.tell_computers(&seen);
            self.describe_anew(&seen, &choose);
            tokio::select! {
                changed = graph.changed() => if changed.is_err() {
                    return Err(gone("follow the bus: it was closed"));
                },
                incident = incidents.recv() => match incident {
                    Ok(incident) => self.tell(&incident),
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Err(gone("follow the bus: it was closed")),
                },
                Some(Ok((key, found))) = self.definitions.join_next() => self.learn(&key, found),
                () = news.notified() => {}
                _ = tell_losses.tick() => {
                    self.tell_losses();
                    self.tell_several(&seen);
                }
                () = self.outlet.closed() => {
                    self.tell_losses();
                    return Ok(());
                }
            }
        }
    }

    /// Subscribes to what is wanted and not yet followed.
    fn look_at(&mut self, graph: &Graph, choose: &impl Fn(&Endpoint) -> Option<Stream>) {
        for endpoint in &graph.endpoints {
            let key = (endpoint.topic.clone(), endpoint.type_name.clone());
            let foreign = endpoint.kind == EndpointKind::Publisher && !endpoint.own;
            if !foreign || self.followed.contains_key(&key) {
                continue;
            }
            if let Some(mut stream) = choose(endpoint) {
                stream.qos = offered(&key, graph);
                self.begin(key, endpoint, stream, graph);
            }
        }
    }

    fn begin(&mut self, key: Key, endpoint: &Endpoint, mut stream: Stream, graph: &Graph) {
        let other = self.followed.keys().find(|(topic, _)| *topic == endpoint.topic);
        if let Some((topic, other)) = other {
            let mut types = [other.as_str(), endpoint.type_name.as_str()];
            types.sort_unstable();
            self.fault(format!("{topic}: published with two types: {}", types.join(", ")));
        }
        let (mut missing, mut stamped) = (false, Stamped::ByHeader);
        if self.kept == Kept::AsTheyCame {
            let (schema, by) = known_schema(endpoint);
            (missing, stamped) = (schema.text.is_empty(), by);
            stream.shape = Shape::Message(Arc::new(schema));
            self.leave_out_wrong_fields(&mut stream);
        }
        let id = self.outlet.declare(stream.clone());
        let computer = self.stamping(&key, graph);
        if let Some(computer) = &computer {
            self.outlet.stamped_by(id, computer);
        }
        let tally = Arc::new(Mutex::new(Tally::new(id)));
        let hearing = Arc::new(Mutex::new(Hearing::default()));
        let deliver = match self.kept {
            Kept::AsTheyCame => self.keeping(id, stamped, &tally),
            Kept::Decoded => hear(self.outlet, id, &stream, &tally, &hearing),
        };
        let subscription = self.subscribe(endpoint, deliver);
        if missing {
            self.ask_for_definition(key.clone(), endpoint.type_hash.clone());
        }
        let followed =
            Followed { id, stream, computer, tally, hearing, _subscription: subscription };
        self.followed.insert(key, followed);
    }

    /// Declares again what more is known about streams that are decoded.
    fn describe_anew(&mut self, graph: &Graph, choose: &impl Fn(&Endpoint) -> Option<Stream>) {
        if self.kept == Kept::AsTheyCame {
            return;
        }
        for (key, followed) in &mut self.followed {
            let mut publishers = graph.publishers(&key.0);
            let publisher = publishers.find(|each| each.type_name == key.1 && !each.own);
            let Some(mut stream) = publisher.and_then(choose) else { continue };
            let hearing = followed.hearing.lock().unwrap_or_else(PoisonError::into_inner);
            hearing.describe(&mut stream);
            stream.qos = offered(key, graph);
            if stream != followed.stream {
                self.outlet.declare(stream.clone());
                followed.stream = stream;
            }
        }
    }

    /// Tells which computer stamps a topic, where that is another than before.
    fn tell_computers(&mut self, graph: &Graph) {
        let keys: Vec<Key> = self.followed.keys().cloned().collect();
        for key in keys {
            let Some(computer) = self.stamping(&key, graph) else { continue };
            let Some(followed) = self.followed.get_mut(&key) else { continue };
            if followed.computer.as_ref() != Some(&computer) {
                self.outlet.stamped_by(followed.id, &computer);
                followed.computer = Some(computer);
            }
        }
    }

    /// Tells which topics are published from several places, each once: nobody can tell by which
    /// clock a message of theirs is stamped. Told at the second look, as names come with a delay.
    fn tell_several(&mut self, graph: &Graph) {
        let shared = |followed: &Followed| {
            followed.computer.as_ref().is_some_and(|name| name.starts_with(SEVERAL))
        };
        let followed = self.followed.iter().filter(|(_, followed)| shared(followed));
        let keys: Vec<Key> = followed.map(|(key, _)| key.clone()).collect();
        for key in keys {
            let Some(several) = several(&publishing(&key, graph)) else { continue };
            let told = self.several.get(&key).copied();
            if told == Some(false) {
                self.fault(format!("{}: published by {several}", key.0));
            }
            self.several.insert(key, told.is_some());
        }
    }

    /// The computer by whose clock a topic is stamped; `None` while nobody publishes it.
    fn stamping(&self, key: &Key, graph: &Graph) -> Option<String> {
        if self.outlet.clock().is_told() {
            return Some(SIMULATED_TIME.into());
        }
        let computers = publishing(key, graph);
        if computers.len() > 1 {
            Some(format!("{SEVERAL}{}", key.0))
        } else {
            computers.into_iter().next()
        }
    }

    /// What hands messages over as they came.
    fn keeping(&self, id: StreamId, stamped: Stamped, tally: &Arc<Mutex<Tally>>) -> Deliver {
        let (outlet, tally) = (self.outlet.clone(), Arc::clone(tally));
        let by_host = !outlet.clock().is_told();
        Arc::new(move |arrival: Arrival| {
            tally.lock().unwrap_or_else(PoisonError::into_inner).count(&arrival, &outlet);
            let source_time = match stamped {
                Stamped::ByHeader => fields::header_stamp(&arrival.bytes),
                Stamped::ByBus => arrival.source_time.filter(|_| by_host),
            };
            let data = Data::Message(arrival.bytes);
            outlet.offer(Reading { stream: id, device_time: None, source_time, data });
        })
    }

    fn subscribe(&self, endpoint: &Endpoint, deliver: Deliver) -> Option<Subscription> {
        let asked = Asked::Adaptive { depth: DEPTH };
        match self.bus.subscribe(&endpoint.topic, &endpoint.type_name, asked, deliver) {
            Ok(subscription) => Some(subscription),
            Err(error) => {
                self.fault(format!("failed to {error}"));
                None
            }
        }
    }

    fn ask_for_definition(&mut self, key: Key, hash: String) {
        let bus = Arc::clone(&self.bus);
        self.definitions.spawn(async move {
            let found = bus.definition(&key.1, &hash).await;
            (key, found)
        });
    }

    /// A definition was found, or nobody has it.
    fn learn(&mut self, key: &Key, found: Result<Schema, BusError>) {
        let Some(followed) = self.followed.get(key) else { return };
        match found {
            Ok(schema) => {
                let mut stream = followed.stream.clone();
                stream.shape = Shape::Message(Arc::new(schema));
                self.leave_out_wrong_fields(&mut stream);
                self.outlet.declare(stream);
            }
            Err(error) => {
                tracing::warn!("failed to {error}; {} is recorded without it", key.0);
                self.fault(format!("failed to {error}; recorded without it"));
            }
        }
    }

    /// Leaves out the channels that the stream's type does not have, and says so.
    fn leave_out_wrong_fields(&self, stream: &mut Stream) {
        let Shape::Message(schema) = &stream.shape else { return };
        let Ok(definition) = Definition::of(schema) else { return };
        let named = std::mem::take(&mut stream.channels).into_iter();
        for (channel, unit) in named.zip(std::mem::take(&mut stream.units)) {
            match Fields::compile(&definition, &[&channel]) {
                Ok(_) => {
                    stream.channels.push(channel);
                    stream.units.push(unit);
                }
                Err(error) => self.fault(format!("{}: failed to {error}", stream.name)),
            }
        }
    }

    fn tell_losses(&self) {
        for followed in self.followed.values() {
            let mut tally = followed.tally.lock().unwrap_or_else(PoisonError::into_inner);
            tally.tell(self.outlet);
        }
    }

    /// Tells an incident on a followed topic, once.
    fn tell(&mut self, incident: &Incident) {
        let (topic, trouble) = match incident {
            Incident::IncompatibleQos { topic, policy, ours: true } => {
                (topic, format!("{topic}: a publisher offers less {policy} than is asked for"))
            }
            Incident::IncompatibleQos { .. } | Incident::TwoTypes { .. } => return,
            Incident::DeadlineMissed { topic, .. } => {
                (topic, format!("{topic}: its publisher misses the deadline that it promised"))
            }
        };
        let followed = self.followed.keys().any(|(known, _)| known == topic);
        if followed && self.told.insert(trouble.clone()) {
            self.fault(trouble);
        }
    }

    fn fault(&self, label: String) {
        fault(self.outlet, label);
    }
}

/// Records that something is wrong.
pub(crate) fn fault(outlet: &Outlet, label: String) {
    let stream = outlet.declare(session_events());
    let event = Event { kind: EventKind::Fault, label, value: f64::NAN, duration_secs: 0.0 };
    let data = Data::Event(Arc::new(event));
    outlet.offer(Reading { stream, device_time: None, source_time: None, data });
}

/// What the publishers of a topic offer.
fn offered((topic, type_name): &Key, graph: &Graph) -> Vec<Qos> {
    let of_type = graph.publishers(topic).filter(|each| each.type_name == *type_name);
    of_type.map(|each| each.qos.clone()).collect()
}

/// The computers that publish a topic.
fn publishing((topic, type_name): &Key, graph: &Graph) -> BTreeSet<String> {
    let publishers = graph.publishers(topic);
    let theirs = publishers.filter(|each| !each.own && each.type_name == *type_name);
    theirs.map(|each| graph.computer(each.gid)).collect()
}

/// Names several computers; `None` where all are processes of one host, which has one clock. Those
/// that told no host may be one.
fn several(computers: &BTreeSet<String>) -> Option<String> {
    let host = |computer: &String| {
        let (host, _) = computer.split_once(" (")?;
        (!host.starts_with('/')).then(|| host.to_owned())
    };
    let hosts: Option<BTreeSet<String>> = computers.iter().map(host).collect();
    let kind = if hosts.is_some() { "computers" } else { "processes" };
    let several = hosts.map_or(computers.len(), |hosts| hosts.len());
    let count = if several == 2 { "two".into() } else { several.to_string() };
    let names: Vec<&str> = computers.iter().map(String::as_str).collect();
    (several > 1).then(|| format!("{count} {kind}: {}", names.join(", ")))
}

/// Who says when a message was measured.
#[derive(Clone, Copy)]
enum Stamped {
    /// The message, in its header.
    ByHeader,
    /// The bus: when it was published.
    ByBus,
}

/// What is known of a publisher's type without asking anybody, and who stamps its messages.
fn known_schema(endpoint: &Endpoint) -> (Schema, Stamped) {
    let shipped = catalogue::shipped(&endpoint.type_name);
    match shipped {
        Some(schema) if endpoint.type_hash.is_empty() || endpoint.type_hash == schema.hash => {
            let definition = Definition::parse(&schema.name, &schema.text);
            let headed = definition.is_ok_and(|each| fields::starts_with_header(&each));
            ((*schema).clone(), if headed { Stamped::ByHeader } else { Stamped::ByBus })
        }
        _ => {
            let schema = Schema {
                name: endpoint.type_name.clone(),
                encoding: "ros2msg".into(),
                text: String::new(),
                hash: endpoint.type_hash.clone(),
            };
            (schema, Stamped::ByBus)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::several;

    #[test]
    fn processes_of_one_host_are_one_computer() {
        let told = |names: [&str; 2]| several(&names.map(str::to_owned).into());
        let two = "two computers: laptop1 (driver, 01), laptop2 (driver, 02)";
        assert_eq!(told(["laptop1 (driver, 01)", "laptop2 (driver, 02)"]).as_deref(), Some(two));
        assert_eq!(told(["laptop1 (driver, 01)", "laptop1 (driver, 02)"]), None);
        let two = "two processes: /r1/driver (01), /r2/driver (02)";
        assert_eq!(told(["/r1/driver (01)", "/r2/driver (02)"]).as_deref(), Some(two));
    }
}
