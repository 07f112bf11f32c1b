//! The graph: the publishers and subscriptions of each topic.

mod shared_map;

use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

use teampulse_core::qos::Qos;

use shared_map::SharedMap;

/// The nodes, endpoints and services on a bus at one time, sorted by topic.
///
/// Clones share unchanged entries, so that the cost of a change does not depend on the number of endpoints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// The endpoints, by topic and id.
    endpoints: SharedMap<(Arc<str>, Gid), Arc<Endpoint>>,
    /// The number of nodes with each full name.
    nodes: SharedMap<Arc<str>, u32>,
    /// The services, by type and id.
    services: SharedMap<(Arc<str>, Gid), Arc<Service>>,
    /// The computers of participants, if known.
    computers: SharedMap<Participant, Arc<Computer>>,
}

impl Graph {
    /// All publishers and subscriptions of ROS topics.
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

    /// The services on offer, by type.
    pub fn services(&self) -> impl Iterator<Item = &Service> {
        self.services.iter().map(|(_, service)| &**service)
    }

    /// The services of a type.
    pub fn services_of(&self, type_name: &str) -> impl Iterator<Item = &Service> {
        let from = self.services.starting_where(move |(each, _)| &**each < type_name);
        let of_type = from.take_while(move |((each, _), _)| &**each == type_name);
        of_type.map(|(_, service)| &**service)
    }

    /// The name of the computer behind an endpoint: the host and process if the participant announces them, otherwise
    /// the node. It is different for each participant.
    pub fn computer(&self, of: Gid) -> String {
        self.named_computer(of).map_or_else(|| of.participant().to_string(), str::to_owned)
    }

    /// The name of the computer behind an endpoint, if its participant is present and the name is known.
    pub fn named_computer(&self, of: Gid) -> Option<&str> {
        Some(self.computers.get(&of.participant())?.name.as_str())
    }

    /// The host of an endpoint, if its participant announces it. All processes of a host share one clock.
    pub fn host(&self, of: Gid) -> Option<&str> {
        self.computers.get(&of.participant())?.host.as_deref()
    }

    /// The topics with an endpoint that was added, changed or removed since `before`.
    pub fn changed_topics(&self, before: &Graph) -> BTreeSet<Arc<str>> {
        let changed = self.endpoints.differences(&before.endpoints);
        changed.into_iter().map(|(topic, _)| topic).collect()
    }

    /// Adds or updates an endpoint.
    pub(crate) fn put(&mut self, endpoint: Endpoint) {
        let key = (endpoint.topic.as_str().into(), endpoint.gid);
        if self.endpoints.get(&key).is_none_or(|known| **known != endpoint) {
            self.endpoints.insert(key, Arc::new(endpoint));
        }
    }

    /// Removes an endpoint of a topic.
    pub(crate) fn remove(&mut self, topic: &str, gid: Gid) {
        self.endpoints.remove(&(topic.into(), gid));
    }

    /// Adds a node; several nodes may have the same name.
    pub(crate) fn put_node(&mut self, name: &str) {
        let name = Arc::from(name);
        let others = self.nodes.get(&name).copied().unwrap_or_default();
        self.nodes.insert(name, others.saturating_add(1));
    }

    /// Removes a node.
    pub(crate) fn remove_node(&mut self, name: &str) {
        let name = Arc::from(name);
        match self.nodes.get(&name).copied() {
            Some(several @ 2..) => drop(self.nodes.insert(name, several - 1)),
            _ => drop(self.nodes.remove(&name)),
        }
    }

    /// Adds or updates a service.
    pub(crate) fn put_service(&mut self, service: Service) {
        let key = (service.type_name.as_str().into(), service.gid);
        self.services.insert(key, Arc::new(service));
    }

    /// Removes a service of a type.
    pub(crate) fn remove_service(&mut self, type_name: &str, gid: Gid) {
        self.services.remove(&(type_name.into(), gid));
    }

    /// Sets the computer of a participant, if known.
    pub(crate) fn name_computer(&mut self, of: Participant, computer: Option<Computer>) {
        match computer {
            Some(found) if self.computers.get(&of).is_none_or(|known| **known != found) => {
                self.computers.insert(of, found.into());
            }
            Some(_) => {}
            None => drop(self.computers.remove(&of)),
        }
    }
}

/// The computer of a participant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Computer {
    /// The name of the computer, which is different for each participant.
    pub name: String,
    /// The host, if announced.
    pub host: Option<String>,
}

/// A service on offer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Service {
    /// The name of the service: `/teampulse/probe_clock`.
    pub name: String,
    /// The type of the service: `teampulse_msgs/srv/ProbeClock`.
    pub type_name: String,
    /// The GID of the reader of requests.
    pub gid: Gid,
    /// Whether the service is ours.
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
    /// The announced type hash; empty if there is none.
    pub type_hash: String,
    /// The offered or requested QoS.
    pub qos: Qos,
    /// The GID of the endpoint.
    pub gid: Gid,
    /// The full name of the endpoint's node, once known.
    pub node: Option<String>,
    /// Whether the endpoint is ours.
    pub own: bool,
}

/// Publisher or subscription.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// A publisher.
    Publisher,
    /// A subscription.
    Subscription,
}

/// The id of an endpoint on its bus, together with its participant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Gid {
    participant: Participant,
    id: [u8; 16],
}

impl Gid {
    /// Creates the GID of an endpoint whose id does not contain its participant's id, as on Zenoh.
    pub const fn of(participant: Participant, id: [u8; 16]) -> Gid {
        Gid { participant, id }
    }

    /// Creates a GID from an id that starts with its participant's id, as on DDS: all but the last four bytes.
    pub const fn prefixed(id: [u8; 16]) -> Gid {
        let mut participant = id;
        let (_, entity) = participant.split_at_mut(12);
        entity.copy_from_slice(&[0; 4]);
        Gid { participant: Participant(participant), id }
    }

    /// The id alone, in the format of its bus.
    pub const fn bytes(self) -> [u8; 16] {
        self.id
    }

    /// The participant to which the endpoint belongs.
    pub const fn participant(self) -> Participant {
        self.participant
    }
}

/// The id of a participant: 12 bytes followed by zeros on DDS, and 16 bytes on Zenoh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Participant(pub [u8; 16]);

impl fmt::Display for Participant {
    /// Shows the part that differs between participants, without the leading vendor id and the trailing counter within
    /// a process.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0[2..8].iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.id.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_participant_is_known_by_its_own_id_whether_or_not_its_endpoints_begin_with_it() {
        let called = |name: &str| Computer { name: name.to_owned(), host: None };
        let mut graph = Graph::default();
        let prefixed = Gid::prefixed([7; 16]);
        let (one, other) = (
            Participant([1; 16]),
            Participant([[1; 15].as_slice(), &[2]].concat().try_into().unwrap()),
        );
        graph.name_computer(prefixed.participant(), Some(called("laptop")));
        graph.name_computer(one, Some(called("robot1")));
        graph.name_computer(other, Some(called("robot2")));
        let named = [prefixed, Gid::of(one, [9; 16]), Gid::of(other, [9; 16])];
        assert_eq!(named.map(|gid| graph.computer(gid)), ["laptop", "robot1", "robot2"]);
        assert_eq!(
            Gid::prefixed([7; 16]).participant(),
            Gid::prefixed([&[7; 12][..], &[8; 4]].concat().try_into().unwrap()).participant()
        );
    }
}
