//! The state shared by the participants of an in-memory bus.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use teampulse_core::qos::{Durability, History, Qos};
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;
use tokio::sync::{broadcast, watch};

use crate::bus::{Answer, Arrival, Asked, Deliver, Incident};
use crate::graph::{Computer, Endpoint, EndpointKind, Gid, Graph, Participant, Service};
use crate::offer;

/// The most incidents queued for a slow listener.
const INCIDENTS: usize = 256;

/// The shared state of a bus. One lock is held while a message is delivered, so that all participants see the same
/// order.
#[derive(Default)]
pub(super) struct Network(Mutex<State>);

#[derive(Default)]
struct State {
    last_number: u32,
    members: Vec<Arc<Member>>,
    writers: BTreeMap<Gid, Writer>,
    readers: BTreeMap<Gid, Reader>,
    servers: BTreeMap<Gid, Server>,
    /// The ids of the writers and readers of each topic.
    topics: BTreeMap<String, Ends>,
}

/// The ends of a topic.
#[derive(Default)]
struct Ends {
    writers: BTreeSet<Gid>,
    readers: BTreeSet<Gid>,
}

/// A participant.
pub(super) struct Member {
    number: u32,
    pub(super) node: String,
    graph: watch::Sender<Arc<Graph>>,
    /// Whether the participant's graph was ever requested; until then it is not kept.
    is_watched: AtomicBool,
    pub(super) incidents: broadcast::Sender<Incident>,
}

/// A publisher with its history for late joiners.
pub(super) struct Writer {
    member: Arc<Member>,
    topic: String,
    schema: Schema,
    qos: Qos,
    sequence: u64,
    kept: VecDeque<Arrival>,
}

/// A subscription.
pub(super) struct Reader {
    pub(super) member: Arc<Member>,
    pub(super) topic: String,
    pub(super) type_name: String,
    pub(super) asked: Asked,
    pub(super) deliver: Deliver,
}

/// A service.
pub(super) struct Server {
    pub(super) member: Arc<Member>,
    pub(super) service: String,
    pub(super) type_name: String,
    pub(super) answer: Answer,
}

impl Network {
    pub(super) fn join(&self, node: &str) -> Arc<Member> {
        let mut state = self.lock();
        let member = Arc::new(Member {
            number: state.next_number(),
            node: node.to_owned(),
            graph: watch::Sender::default(),
            is_watched: AtomicBool::new(false),
            incidents: broadcast::Sender::new(INCIDENTS),
        });
        state.members.push(Arc::clone(&member));
        state.report(|graph, _| member.appear_in(graph));
        member
    }

    pub(super) fn leave(&self, member: &Arc<Member>) {
        let mut state = self.lock();
        state.members.retain(|each| !Arc::ptr_eq(each, member));
        state.report(|graph, _| {
            graph.remove_node(&member.node);
            graph.name_computer(member.participant(), None);
        });
    }

    /// The graph as seen by a participant.
    pub(super) fn graph(&self, member: &Arc<Member>) -> watch::Receiver<Arc<Graph>> {
        let state = self.lock();
        if !member.is_watched.swap(true, Ordering::Relaxed) {
            member.graph.send_replace(Arc::new(state.seen_by(member)));
        }
        member.graph.subscribe()
    }

    pub(super) fn read(&self, reader: Reader) -> Gid {
        let mut state = self.lock();
        state.readers_differ(&reader);
        let requested = state.requested(&reader);
        for writer in state.writers_of(&reader.topic).filter(|writer| writer.reaches(&reader)) {
            let late = requested.durability == Durability::TransientLocal;
            if late && offer::incompatible(&writer.qos, &requested).is_none() {
                writer.kept.iter().cloned().for_each(|arrival| (reader.deliver)(arrival));
            }
        }
        let gid = state.next_gid(&reader.member);
        let topic = reader.topic.clone();
        state.topics.entry(topic.clone()).or_default().readers.insert(gid);
        state.readers.insert(gid, reader);
        state.report_topic(&topic);
        gid
    }

    pub(super) fn serve(&self, server: Server) -> Gid {
        let mut state = self.lock();
        let gid = state.next_gid(&server.member);
        state.report(|graph, seen_by| graph.put_service(server.service(gid, seen_by)));
        state.servers.insert(gid, server);
        gid
    }

    /// The servers of a service that belong to other participants.
    pub(super) fn servers(&self, asker: &Arc<Member>, service: &str) -> Vec<(Gid, Answer)> {
        let state = self.lock();
        let offers = |(_, server): &(&Gid, &Server)| {
            server.service == service && !Arc::ptr_eq(&server.member, asker)
        };
        let servers = state.servers.iter().filter(offers);
        servers.map(|(gid, server)| (*gid, Arc::clone(&server.answer))).collect()
    }

    pub(super) fn write(&self, writer: Writer) -> Gid {
        let mut state = self.lock();
        state.writer_differs(&writer);
        let gid = state.next_gid(&writer.member);
        let topic = writer.topic.clone();
        state.topics.entry(topic.clone()).or_default().writers.insert(gid);
        state.writers.insert(gid, writer);
        state.report_topic(&topic);
        gid
    }

    pub(super) fn remove(&self, gid: Gid) {
        let mut state = self.lock();
        let reader = state.readers.remove(&gid);
        let writer = state.writers.remove(&gid);
        let server = state.servers.remove(&gid);
        let of_reader = reader.as_ref().map(|reader| &reader.topic);
        if let Some(topic) = of_reader.or(writer.as_ref().map(|writer| &writer.topic)) {
            state.forget(topic, gid);
        }
        if let Some(server) = &server {
            state.report(|graph, _| graph.remove_service(&server.type_name, gid));
        }
        drop(state);
        // The callbacks of a subscription may own an endpoint, so they are dropped without the lock.
        drop((reader, writer, server));
    }

    pub(super) fn publish(&self, gid: Gid, cdr: &[u8], stamp: Time) {
        let mut state = self.lock();
        let Some(writer) = state.writers.get_mut(&gid) else { return };
        let arrival = writer.number(gid, cdr, stamp);
        for reader in state.matched(gid) {
            (reader.deliver)(arrival.clone());
        }
    }

    pub(super) fn subscribers(&self, gid: Gid) -> usize {
        self.lock().matched(gid).count()
    }

    pub(super) fn definition(&self, type_name: &str, hash: &str) -> Option<Schema> {
        let state = self.lock();
        let mut schemas = state.writers.values().map(|writer| &writer.schema);
        let is_it = |schema: &&Schema| {
            schema.name == type_name
                && !schema.text.is_empty()
                && (hash.is_empty() || schema.hash == hash)
        };
        schemas.find(is_it).cloned()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn next_number(&mut self) -> u32 {
        self.last_number += 1;
        self.last_number
    }

    /// The next GID, which starts with the participant's id.
    fn next_gid(&mut self, member: &Member) -> Gid {
        let number = u128::from(self.next_number());
        Gid::prefixed((u128::from(member.number) << 64 | number).to_be_bytes())
    }

    fn writers_of(&self, topic: &str) -> impl Iterator<Item = &Writer> {
        let gids = self.topics.get(topic).into_iter().flat_map(|ends| &ends.writers);
        gids.filter_map(|gid| self.writers.get(gid))
    }

    fn readers_of(&self, topic: &str) -> impl Iterator<Item = &Reader> {
        let gids = self.topics.get(topic).into_iter().flat_map(|ends| &ends.readers);
        gids.filter_map(|gid| self.readers.get(gid))
    }

    /// The QoS that a subscription requests from the current publishers.
    fn requested(&self, reader: &Reader) -> Qos {
        match &reader.asked {
            Asked::Exactly(qos) => qos.clone(),
            Asked::Adaptive { depth } => {
                let writers = self.writers_of(&reader.topic);
                let reaching = writers.filter(|writer| writer.reaches(reader));
                offer::suiting_all(reaching.map(|writer| &writer.qos), *depth)
            }
        }
    }

    /// The subscriptions that match a publisher.
    fn matched(&self, gid: Gid) -> impl Iterator<Item = &Reader> {
        let writer = self.writers.get(&gid);
        let readers = writer.into_iter().flat_map(|writer| self.readers_of(&writer.topic));
        readers.filter(move |reader| {
            writer.is_some_and(|writer| {
                let requested = self.requested(reader);
                writer.reaches(reader) && offer::incompatible(&writer.qos, &requested).is_none()
            })
        })
    }

    /// Notifies both sides if a new subscription does not match a publisher.
    fn readers_differ(&self, reader: &Reader) {
        for writer in self.writers_of(&reader.topic).filter(|writer| writer.reaches(reader)) {
            report_difference(writer, reader);
        }
    }

    /// Notifies both sides if a new publisher does not match a subscription, and everyone if it adds a
    /// second type to its topic.
    fn writer_differs(&self, writer: &Writer) {
        for reader in self.readers_of(&writer.topic).filter(|reader| writer.reaches(reader)) {
            report_difference(writer, reader);
        }
        let others = self.writers_of(&writer.topic);
        let mut types: BTreeSet<_> = others.map(|other| other.schema.name.clone()).collect();
        if !types.is_empty() && types.insert(writer.schema.name.clone()) {
            let types: Vec<String> = types.into_iter().collect();
            for member in &self.members {
                let topic = writer.topic.clone();
                member.report(Incident::TwoTypes { topic, types: types.clone() });
            }
        }
    }

    /// Changes the graph of each watched participant.
    fn report(&self, change: impl Fn(&mut Graph, &Arc<Member>)) {
        let watched = |member: &&Arc<Member>| member.is_watched.load(Ordering::Relaxed);
        for member in self.members.iter().filter(watched) {
            member.graph.send_modify(|graph| change(Arc::make_mut(graph), member));
        }
    }

    /// Reports all endpoints of a topic after one was added, as others may then request a different QoS.
    fn report_topic(&self, topic: &str) {
        self.report(|graph, seen_by| {
            self.endpoints(topic, seen_by).for_each(|endpoint| graph.put(endpoint));
        });
    }

    /// Removes an endpoint of a topic from the graphs.
    fn forget(&mut self, topic: &str, gid: Gid) {
        if let Some(ends) = self.topics.get_mut(topic) {
            ends.writers.remove(&gid);
            ends.readers.remove(&gid);
            if ends.writers.is_empty() && ends.readers.is_empty() {
                self.topics.remove(topic);
            }
        }
        self.report(|graph, seen_by| {
            graph.remove(topic, gid);
            self.endpoints(topic, seen_by).for_each(|endpoint| graph.put(endpoint));
        });
    }

    /// The whole graph as a participant sees it.
    fn seen_by(&self, member: &Arc<Member>) -> Graph {
        let mut graph = Graph::default();
        self.members.iter().for_each(|each| each.appear_in(&mut graph));
        for topic in self.topics.keys() {
            self.endpoints(topic, member).for_each(|endpoint| graph.put(endpoint));
        }
        for (gid, server) in &self.servers {
            graph.put_service(server.service(*gid, member));
        }
        graph
    }

    fn endpoints(&self, topic: &str, seen_by: &Arc<Member>) -> impl Iterator<Item = Endpoint> {
        let ends = self.topics.get(topic);
        let writer = |gid: &Gid| {
            let each = self.writers.get(gid)?;
            Some(Endpoint {
                kind: EndpointKind::Publisher,
                topic: each.topic.clone(),
                type_name: each.schema.name.clone(),
                type_hash: each.schema.hash.clone(),
                qos: each.qos.clone(),
                gid: *gid,
                node: Some(each.member.node.clone()),
                own: Arc::ptr_eq(&each.member, seen_by),
            })
        };
        let reader = |gid: &Gid| {
            let each = self.readers.get(gid)?;
            Some(Endpoint {
                kind: EndpointKind::Subscription,
                topic: each.topic.clone(),
                type_name: each.type_name.clone(),
                type_hash: String::new(),
                qos: self.requested(each),
                gid: *gid,
                node: Some(each.member.node.clone()),
                own: Arc::ptr_eq(&each.member, seen_by),
            })
        };
        let writers = ends.into_iter().flat_map(|ends| &ends.writers).filter_map(writer);
        let readers = ends.into_iter().flat_map(|ends| &ends.readers).filter_map(reader);
        writers.chain(readers)
    }
}

impl Member {
    fn participant(&self) -> Participant {
        Gid::prefixed((u128::from(self.number) << 64).to_be_bytes()).participant()
    }

    fn appear_in(&self, graph: &mut Graph) {
        let participant = self.participant();
        graph.put_node(&self.node);
        graph.name_computer(
            participant,
            Some(Computer { name: format!("{} ({participant})", self.node), host: None }),
        );
    }

    fn report(&self, incident: Incident) {
        // Without a listener the event is dropped.
        self.incidents.send(incident).ok();
    }
}

impl Server {
    fn service(&self, gid: Gid, seen_by: &Arc<Member>) -> Service {
        Service {
            name: self.service.clone(),
            type_name: self.type_name.clone(),
            gid,
            own: Arc::ptr_eq(&self.member, seen_by),
        }
    }
}

impl Writer {
    pub(super) fn new(member: Arc<Member>, topic: &str, schema: &Schema, qos: &Qos) -> Writer {
        let (topic, schema, qos) = (topic.to_owned(), schema.clone(), qos.clone());
        Writer { member, topic, schema, qos, sequence: 0, kept: VecDeque::new() }
    }

    /// Whether a subscription has the same topic and type, and belongs to another participant.
    fn reaches(&self, reader: &Reader) -> bool {
        self.topic == reader.topic
            && self.schema.name == reader.type_name
            && !Arc::ptr_eq(&self.member, &reader.member)
    }

    /// Numbers a message, and stores it if late joiners should receive it.
    fn number(&mut self, gid: Gid, cdr: &[u8], stamp: Time) -> Arrival {
        self.sequence += 1;
        let arrival = Arrival {
            bytes: Bytes::copy_from_slice(cdr),
            source_time: Some(stamp),
            publisher: gid,
            sequence: Some(self.sequence),
        };
        if self.qos.durability == Durability::TransientLocal {
            self.kept.push_back(arrival.clone());
        }
        if matches!(self.qos.history, History::KeepLast(depth) if self.kept.len() > depth as usize)
        {
            self.kept.pop_front();
        }
        arrival
    }
}

fn report_difference(writer: &Writer, reader: &Reader) {
    let Asked::Exactly(requested) = &reader.asked else { return };
    let Some(policy) = offer::incompatible(&writer.qos, requested) else { return };
    let incident = |ours| Incident::IncompatibleQos {
        topic: writer.topic.clone(),
        policy: policy.to_owned(),
        ours,
    };
    reader.member.report(incident(true));
    writer.member.report(incident(false));
}
