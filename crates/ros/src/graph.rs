//! The graph: who publishes and subscribes to what.

mod shared_map;

use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

use teampulse_core::qos::Qos;

use shared_map::SharedMap;

/// What there is on a bus at one moment, sorted by topic.
///
/// Clones share what they have in common, so that a change of one endpoint costs the same however many
/// there are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// By topic and id.
    endpoints: SharedMap<(Arc<str>, Gid), Arc<Endpoint>>,
    /// By full name, how many nodes have it.
    nodes: SharedMap<Arc<str>, u32>,
    /// By type and id.
    services: SharedMap<(Arc<str>, Gid), Arc<Service>>,
    /// Names of the computers of participants, where announced.
    computers: SharedMap<Participant, Arc<str>>,
}

impl Graph {
    /// Every publisher and subscription of ROS topics.
    pub fn endpoints(&self) -> impl Iterator<Item = &Endpoint> {
        self.endpoints.iter().map(|(_, endpoint)| &**endpoint)
    }

    /// The publishers and subscriptions of a topic.
    pub fn endpoints_of(&self, topic: &str) -> impl Iterator<Item = &Endpoint> {
        let from = self.endpoints.starting_where(move |(each, _)| &**each < topic);
        let of_topic = from.take_while(move |((each, _), _)| &**each == topic);
        of_topic.map(|(_, endpoint)| &**endpoint)
    }

    /// The publishers of a topic.
    pub fn publishers(&self, topic: &str) -> impl Iterator<Item = &Endpoint> {
        self.endpoints_of(topic).filter(|each| each.kind == EndpointKind::Publisher)
    }

    /// The full names of all nodes: `/robot1/driver`; sorted.
    pub fn nodes(&self) -> impl Iterator<Item = &str> {
        self.nodes.iter().map(|(name, _)| &**name)
    }

    /// The services that can be asked, by type.
    pub fn services(&self) -> impl Iterator<Item = &Service> {
        self.services.iter().map(|(_, service)| &**service)
    }

    /// The services of a type.
    pub fn services_of(&self, type_name: &str) -> impl Iterator<Item = &Service> {
        let from = self.services.starting_where(move |(each, _)| &**each < type_name);
        let of_type = from.take_while(move |((each, _), _)| &**each == type_name);
        of_type.map(|(_, service)| &**service)
    }

    /// The name of the computer behind an endpoint: its host and process where its participant announces
    /// them, else its node. Different for each participant.
    pub fn computer(&self, of: Gid) -> String {
        let participant = of.participant();
        let known = self.computers.get(&participant);
        known.map_or_else(|| participant.to_string(), ToString::to_string)
    }

    /// The topics of which an endpoint is not what it was before, or not there.
    pub fn changed_topics(&self, before: &Graph) -> BTreeSet<Arc<str>> {
        let changed = self.endpoints.differences(&before.endpoints);
        changed.into_iter().map(|(topic, _)| topic).collect()
    }

    /// An endpoint is there, or is another now.
    pub(crate) fn put(&mut self, endpoint: Endpoint) {
        let key = (endpoint.topic.as_str().into(), endpoint.gid);
        if self.endpoints.get(&key).is_none_or(|known| **known != endpoint) {
            self.endpoints.insert(key, Arc::new(endpoint));
        }
    }

    /// An endpoint of a topic is there no more.
    pub(crate) fn remove(&mut self, topic: &str, gid: Gid) {
        self.endpoints.remove(&(topic.into(), gid));
    }

    /// A node is there; several may have one name.
    pub(crate) fn put_node(&mut self, name: &str) {
        let name = Arc::from(name);
        let others = self.nodes.get(&name).copied().unwrap_or_default();
        self.nodes.insert(name, others.saturating_add(1));
    }

    /// A node is there no more.
    pub(crate) fn remove_node(&mut self, name: &str) {
        let name = Arc::from(name);
        match self.nodes.get(&name).copied() {
            Some(several @ 2..) => drop(self.nodes.insert(name, several - 1)),
            _ => drop(self.nodes.remove(&name)),
        }
    }

    /// A service can be asked.
    pub(crate) fn put_service(&mut self, service: Service) {
        let key = (service.type_name.as_str().into(), service.gid);
        self.services.insert(key, Arc::new(service));
    }

    /// A service of a type can be asked no more.
    pub(crate) fn remove_service(&mut self, type_name: &str, gid: Gid) {
        self.services.remove(&(type_name.into(), gid));
    }

    /// What the computer of a participant is called, where that is known.
    pub(crate) fn name_computer(&mut self, of: Participant, name: Option<String>) {
        match name {
            Some(name) if self.computers.get(&of).is_none_or(|known| **known != *name) => {
                self.computers.insert(of, name.into());
            }
            Some(_) => {}
            None => drop(self.computers.remove(&of)),
        }
    }
}

/// A service that somebody offers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Service {
    /// Its name: `/teampulse/probe_clock`.
    pub name: String,
    /// Its type: `teampulse_msgs/srv/ProbeClock`.
    pub type_name: String,
    /// The id of what takes its requests.
    pub gid: Gid,
    /// Whether it is ours.
    pub own: bool,
}

/// A publisher or a subscription.
#[derive(Clone, Debug, PartialEq)]
pub struct Endpoint {
    /// Publisher or subscription.
    pub kind: EndpointKind,
    /// The ROS topic: `/robot1/odom`.
    pub topic: String,
    /// The ROS type: `nav_msgs/msg/Odometry`.
    pub type_name: String,
    /// The announced type hash; empty when there is none.
    pub type_hash: String,
    /// What it offers or asks for.
    pub qos: Qos,
    /// Its id on the bus.
    pub gid: Gid,
    /// The full name of its node, once known.
    pub node: Option<String>,
    /// Whether it is ours.
    pub own: bool,
}

/// Publisher or subscription.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// It publishes.
    Publisher,
    /// It subscribes.
    Subscription,
}

/// The id of an endpoint on its bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Gid(pub [u8; 16]);

impl Gid {
    /// The participant that has the endpoint.
    pub fn participant(self) -> Participant {
        let [prefix @ .., _, _, _, _] = self.0;
        Participant(prefix)
    }
}

/// The id of a participant: what the ids of its endpoints begin with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Participant(pub [u8; 12]);

impl fmt::Display for Participant {
    /// The part that differs between participants: without the number of the vendor before it, and
    /// the count within a process behind it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0[2..8].iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}
