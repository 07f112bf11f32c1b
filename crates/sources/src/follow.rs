//! Following topics on a bus: subscribe to what is wanted as it appears, and count what is lost.

mod origins;
mod places;
mod stamped;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::qos::{Qos, Reliability};
use teampulse_core::session_streams::session_events;
use teampulse_core::source::{Reading, SourceError};
use teampulse_core::stream::{Schema, Shape, Stream, StreamId};
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{self, Fields};
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Deliver, Incident, Subscription};
use teampulse_ros::graph::{Endpoint, EndpointKind, Gid, Graph};
use tokio::sync::Notify;
use tokio::sync::broadcast::error::RecvError;
use tokio::task::JoinSet;

use crate::loss_counter::LossCounter;
use crate::publisher_split::PublisherSplit;
use crate::publishing::{Key, gids, offered, who};

use places::Places;
use stamped::{Stamped, known_schema};

/// How many messages a subscription keeps until they are taken. They are taken at once, so this
/// bounds a burst, not a delay.
const DEPTH: u32 = 2000;
/// How often it is looked who publishes what after each change: what is said is said at the second look.
const LOOKS: u32 = 3;
/// Counted losses are reported at least this often.
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

struct Following<'a> {
    bus: Arc<dyn Bus>,
    outlet: &'a Outlet,
    kept: Kept,
    followed: BTreeMap<Key, Followed>,
    /// Problems that were reported: each once.
    told: BTreeSet<String>,
    /// The topics that are published from several places, and whether that was reported.
    several: BTreeMap<Key, bool>,
    places: Places,
    definitions: JoinSet<(Key, Result<Schema, BusError>)>,
}

struct Followed {
    id: StreamId,
    stream: Stream,
    stamped: Stamped,
    receivers: Receivers,
    /// Its publishers at the last look, and those that were reported.
    publishers: Vec<Gid>,
    published_by: Vec<String>,
    /// `None` when the bus would not have it; not tried again.
    _subscription: Option<Subscription>,
}

/// What takes the messages of a topic.
enum Receivers {
    /// All as they came, in one stream.
    Unsplit(Arc<Mutex<LossCounter>>),
    /// Decoded, and each publisher's apart.
    Split(Arc<Mutex<PublisherSplit>>),
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
            places: Places::default(),
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
        let mut report_losses = tokio::time::interval(TELL_LOSSES);
        // There may be thousands of topics: all are gone through only when the graph, or what is
        // wanted of it, has changed.
        let (mut seen, mut anew, mut looks) = (Arc::<Graph>::default(), true, 0);
        loop {
            let before = std::mem::replace(&mut seen, Arc::clone(&graph.borrow_and_update()));
            if std::mem::take(&mut anew) || !Arc::ptr_eq(&before, &seen) {
                self.look_at(&seen, &choose);
                self.look_at_publishers(&seen);
                looks = LOOKS;
            }
            self.describe_anew(&seen, &choose);
            tokio::select! {
                changed = graph.changed() => if changed.is_err() {
                    return Err(gone("follow the bus: it was closed"));
                },
                incident = incidents.recv() => match incident {
                    Ok(incident) => self.report(&incident),
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Err(gone("follow the bus: it was closed")),
                },
                Some(Ok((key, found))) = self.definitions.join_next() => self.learn(&key, found),
                () = news.notified() => anew = true,
                _ = report_losses.tick() => {
                    self.report_losses();
                    self.look_at_publishers(&seen);
                    if looks > 0 {
                        looks -= 1;
                        self.report_several(&seen);
                        self.report_publishers(&seen);
                    }
                }
                () = self.outlet.closed() => {
                    self.close();
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
        let of_topic = self.followed.range((endpoint.topic.clone(), String::new())..);
        let other =
            of_topic.map(|(key, _)| key).next().filter(|(topic, _)| *topic == endpoint.topic);
        if let Some((topic, other)) = other {
            let mut types = [other.as_str(), endpoint.type_name.as_str()];
            types.sort_unstable();
            self.fault(format!("{topic}: published with two types: {}", types.join(", ")));
        }
        let (mut missing, mut stamped) = (false, Stamped::default());
        if self.kept == Kept::AsTheyCame {
            let (schema, by) = known_schema(endpoint);
            (missing, stamped) = (schema.text.is_empty(), by);
            stream.shape = Shape::Message(Arc::new(schema));
            self.leave_out_wrong_fields(&mut stream);
        }
        // Which publisher of a person's topic is heard first is not known yet.
        if self.kept == Kept::AsTheyCame {
            stream.publisher = who(graph, endpoint.gid);
        }
        let id = self.outlet.declare(stream.clone());
        let (receivers, deliver) = match self.kept {
            Kept::AsTheyCame => {
                let losses = Arc::new(Mutex::new(LossCounter::new(id, self.bus.graph())));
                let deliver = self.keeping(id, &stamped, &losses);
                (Receivers::Unsplit(losses), deliver)
            }
            Kept::Decoded => {
                let split = PublisherSplit::new(self.outlet, self.bus.graph(), (id, &stream));
                let split = Arc::new(Mutex::new(split));
                (Receivers::Split(Arc::clone(&split)), taking(split))
            }
        };
        let subscription = self.subscribe(endpoint, deliver);
        if missing {
            self.ask_for_definition(key.clone(), endpoint.type_hash.clone());
        }
        let (publishers, published_by) = (Vec::new(), Vec::new());
        let followed = Followed {
            id,
            stream,
            stamped,
            receivers,
            publishers,
            published_by,
            _subscription: subscription,
        };
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
            let Receivers::Split(split) = &followed.receivers else { continue };
            let mut split = lock(split);
            lock(&split.primary().observed).describe(&mut stream);
            stream.qos = offered(key, graph);
            stream.publisher.clone_from(&followed.stream.publisher);
            if stream != followed.stream {
                self.outlet.declare(stream.clone());
                split.describe(&stream);
                followed.stream = stream;
            }
        }
    }

    /// What hands messages over as they came.
    fn keeping(
        &self,
        id: StreamId,
        stamped: &Stamped,
        losses: &Arc<Mutex<LossCounter>>,
    ) -> Deliver {
        let (outlet, losses, stamped) = (self.outlet.clone(), Arc::clone(losses), stamped.clone());
        let by_host = !outlet.clock().is_settable();
        Arc::new(move |arrival: Arrival| {
            lock(&losses).count(&arrival, &outlet);
            let source_time = if stamped.is_by_header() {
                let stamp = fields::header_stamp(&arrival.bytes);
                stamp.map(|stamp| outlet.clock().session_from_stamp(stamp))
            } else {
                arrival.source_time.filter(|_| by_host)
            };
            let data = Data::Message(arrival.bytes);
            outlet.offer(Reading { index: None, stream: id, device_time: None, source_time, data });
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
                followed.stamped.learn(&schema);
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
        let name = &stream.name;
        stream.channels.retain(|channel| {
            let found = Fields::compile(&definition, &[&channel.name]);
            found.map_err(|error| self.fault(format!("{name}: failed to {error}"))).is_ok()
        });
    }

    /// Hands over what still waits, and reports the last losses.
    fn close(&mut self) {
        let graph = Arc::clone(&self.bus.graph().borrow());
        for (key, followed) in &self.followed {
            if let Receivers::Split(split) = &followed.receivers {
                lock(split).close(&gids(key, &graph).collect());
            }
        }
        self.report_losses();
        if let Some(trouble) = self.places.report() {
            self.fault(trouble);
        }
    }

    fn report_losses(&mut self) {
        let mut of_reliable = BTreeMap::new();
        for ((topic, _), followed) in &self.followed {
            let lost = match &followed.receivers {
                Receivers::Unsplit(losses) => lock(losses).report(self.outlet),
                Receivers::Split(split) => lock(split).report_losses(),
            };
            let reliable = |qos: &Qos| qos.reliability == Reliability::Reliable;
            if lost > 0 && followed.stream.qos.iter().all(reliable) {
                *of_reliable.entry(topic.clone()).or_default() += lost;
            }
        }
        // Elsewhere no kernel says what its receive buffers dropped.
        if cfg!(target_os = "linux")
            && let Some(trouble) = self.places.look(of_reliable)
        {
            self.fault(trouble);
        }
    }

    /// Reports an incident on a followed topic, once.
    fn report(&mut self, incident: &Incident) {
        let (topic, trouble) = match incident {
            Incident::IncompatibleQos { topic, policy, ours: true } => {
                (topic, format!("{topic}: a publisher offers less {policy} than is asked for"))
            }
            Incident::IncompatibleQos { .. } | Incident::TwoTypes { .. } => return,
            Incident::Overflow { .. } => return self.places.overflow(),
            Incident::DeadlineMissed { topic, .. } => {
                (topic, format!("{topic}: its publisher misses the deadline that it promised"))
            }
        };
        let mut of_topic = self.followed.range((topic.clone(), String::new())..);
        let followed = of_topic.next().is_some_and(|((known, _), _)| known == topic);
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
    outlet.offer(Reading { index: None, stream, device_time: None, source_time: None, data });
}

/// What hands over to the streams of one person's topic.
fn taking(split: Arc<Mutex<PublisherSplit>>) -> Deliver {
    Arc::new(move |arrival: Arrival| lock(&split).take(arrival))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
