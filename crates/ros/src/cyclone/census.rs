//! The participants of a domain, and their discovered endpoints, which are assigned to the nodes that participants
//! announce.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::qos::Qos;
use teampulse_messages::standard::rmw_dds_common::{NodeEntitiesInfo, ParticipantEntitiesInfo};

use super::names;
use super::service;
use crate::graph::{Computer, Endpoint, EndpointKind, Gid, Graph, Service};

/// The topic on which participants announce their nodes.
pub(super) const DISCOVERY_TOPIC: &str = "ros_discovery_info";

/// A change found by discovery.
#[derive(Debug)]
pub(super) enum Change {
    /// A participant is present, with its process if it is announced.
    Participant(Gid, Option<Process>),
    /// An endpoint was discovered or updated.
    Endpoint(Found),
    /// An endpoint is gone.
    EndpointGone(Gid),
    /// A participant is gone.
    ParticipantGone(Gid),
}

/// The process of a participant, as announced.
#[derive(Clone, Debug)]
pub(super) struct Process {
    /// The name of the host, which is the same for all processes of a computer.
    pub(super) host: String,
    /// The name of the process; may be empty.
    pub(super) name: String,
}

/// An endpoint as discovered by DDS.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) kind: EndpointKind,
    pub(super) gid: Gid,
    pub(super) participant: Gid,
    pub(super) topic: String,
    pub(super) type_name: String,
    pub(super) type_hash: String,
    pub(super) qos: Qos,
}

/// All participants and endpoints of a domain, and the resulting graph. The cost of a change does not depend on their
/// number.
#[derive(Debug)]
pub(super) struct Census {
    own: Gid,
    /// The processes that participants announce, by participant id.
    participants: BTreeMap<Gid, Option<Process>>,
    endpoints: BTreeMap<Gid, Found>,
    /// The endpoints of each participant, as pairs of participant and endpoint id.
    of_participants: BTreeSet<(Gid, Gid)>,
    nodes: BTreeMap<Gid, Vec<NodeEntitiesInfo>>,
    /// The full name of the node that has an endpoint.
    owners: BTreeMap<Gid, Arc<str>>,
    graph: Graph,
    /// Whether our own endpoints have changed since the last call of `take_own_change`.
    is_changed_here: bool,
}

impl Census {
    /// Creates an empty census; `own` is our participant.
    pub(super) fn new(own: Gid) -> Census {
        Census {
            own,
            participants: BTreeMap::from([(own, None)]),
            endpoints: BTreeMap::new(),
            of_participants: BTreeSet::new(),
            nodes: BTreeMap::new(),
            owners: BTreeMap::new(),
            graph: Graph::default(),
            is_changed_here: true,
        }
    }

    pub(super) fn apply(&mut self, change: Change) {
        match change {
            Change::Participant(gid, process) => {
                self.participants.insert(gid, process);
                self.name_computer(gid);
            }
            Change::Endpoint(found) => {
                let gid = found.gid;
                self.remove_endpoint(gid);
                self.of_participants.insert((found.participant, gid));
                self.is_changed_here |= found.participant == self.own;
                self.put_service(&found);
                self.endpoints.insert(gid, found);
                self.show(gid);
            }
            Change::EndpointGone(gid) => self.remove_endpoint(gid),
            Change::ParticipantGone(gid) => {
                self.replace_nodes(gid, Vec::new());
                self.participants.remove(&gid);
                self.name_computer(gid);
                let of_participant = self.of_participants.range((gid, Gid::default())..);
                let of_participant =
                    of_participant.take_while(|(participant, _)| *participant == gid);
                let endpoints: Vec<Gid> = of_participant.map(|(_, endpoint)| *endpoint).collect();
                for endpoint in endpoints {
                    self.remove_endpoint(endpoint);
                }
            }
        }
    }

    /// Takes in a participant's announcement of its nodes; participants that are not present are ignored.
    pub(super) fn hear(&mut self, info: ParticipantEntitiesInfo) {
        let participant = Gid::prefixed(info.gid);
        let known = self.nodes.get(&participant);
        let is_new = known != Some(&info.node_entities_info_seq);
        if is_new && self.participants.contains_key(&participant) {
            self.replace_nodes(participant, info.node_entities_info_seq);
        }
    }

    fn replace_nodes(&mut self, participant: Gid, nodes: Vec<NodeEntitiesInfo>) {
        let mut touched = BTreeSet::new();
        for node in self.nodes.remove(&participant).into_iter().flatten() {
            let name = full_name(&node);
            self.graph.remove_node(&name);
            for gid in gids(&node) {
                if self.owners.get(&gid).is_some_and(|owner| **owner == *name) {
                    self.owners.remove(&gid);
                }
                touched.insert(gid);
            }
        }
        for node in &nodes {
            let name = Arc::<str>::from(full_name(node));
            self.graph.put_node(&name);
            for gid in gids(node) {
                self.owners.insert(gid, Arc::clone(&name));
                touched.insert(gid);
            }
        }
        if !nodes.is_empty() {
            self.nodes.insert(participant, nodes);
        }
        self.name_computer(participant);
        for gid in touched {
            self.show(gid);
        }
    }

    fn remove_endpoint(&mut self, gid: Gid) {
        let Some(found) = self.endpoints.remove(&gid) else { return };
        self.of_participants.remove(&(found.participant, gid));
        self.is_changed_here |= found.participant == self.own;
        if let Some(topic) = names::ros_topic(&found.topic) {
            self.graph.remove(&topic, gid);
        }
        if let Some(service) = self.service(&found) {
            self.graph.remove_service(&service.type_name, gid);
        }
    }

    /// Updates an endpoint of a ROS topic in the graph.
    fn show(&mut self, gid: Gid) {
        let Some(found) = self.endpoints.get(&gid) else { return };
        let Some(topic) = names::ros_topic(&found.topic) else { return };
        self.graph.put(Endpoint {
            kind: found.kind,
            topic,
            type_name: names::ros_type(&found.type_name),
            type_hash: found.type_hash.clone(),
            qos: found.qos.clone(),
            gid,
            node: self.owners.get(&gid).map(ToString::to_string),
            own: found.participant == self.own,
        });
    }

    /// Names the computer of a participant: as announced, otherwise by the participant's first node.
    fn name_computer(&mut self, gid: Gid) {
        let participant = gid.participant();
        let node = || self.nodes.get(&gid).and_then(|nodes| nodes.first()).map(full_name);
        let computer = self.participants.get(&gid).and_then(|announced| match announced {
            Some(Process { host, name }) => {
                let separator = if name.is_empty() { "" } else { ", " };
                let name = format!("{host} ({name}{separator}{participant})");
                Some(Computer { name, host: Some(host.clone()) })
            }
            None => {
                node().map(|node| Computer { name: format!("{node} ({participant})"), host: None })
            }
        });
        self.graph.name_computer(participant, computer);
    }

    fn put_service(&mut self, found: &Found) {
        if let Some(service) = self.service(found) {
            self.graph.put_service(service);
        }
    }

    /// The service of an endpoint, if it uses our mapping.
    fn service(&self, found: &Found) -> Option<Service> {
        let takes = found.kind == EndpointKind::Subscription && service::speaks_it(found.gid);
        let name = takes.then(|| names::ros_service(&found.topic)).flatten()?;
        Some(Service {
            name,
            type_name: names::ros_type(&found.type_name).strip_suffix("_Request")?.to_owned(),
            gid: found.gid,
            own: found.participant == self.own,
        })
    }

    /// Whether our own endpoints have changed since the last call.
    pub(super) fn take_own_change(&mut self) -> bool {
        std::mem::take(&mut self.is_changed_here)
    }

    /// The announcement of our single node.
    pub(super) fn own_nodes(&self, namespace: &str, name: &str) -> ParticipantEntitiesInfo {
        let ours = self.of_participants.range((self.own, Gid::default())..);
        let ours = ours.take_while(|(participant, _)| *participant == self.own);
        let ours: Vec<&Found> = ours.filter_map(|(_, gid)| self.endpoints.get(gid)).collect();
        let gids = |kind| {
            let of_kind =
                ours.iter().filter(|each| each.kind == kind && names::is_ros(&each.topic));
            of_kind.map(|each| each.gid.bytes()).collect()
        };
        let node = NodeEntitiesInfo {
            node_namespace: namespace.to_owned(),
            node_name: name.to_owned(),
            reader_gid_seq: gids(EndpointKind::Subscription),
            writer_gid_seq: gids(EndpointKind::Publisher),
        };
        ParticipantEntitiesInfo { gid: self.own.bytes(), node_entities_info_seq: vec![node] }
    }

    /// The graph in ROS terms.
    pub(super) fn graph(&self) -> Graph {
        self.graph.clone()
    }

    /// The nodes of other participants that publish a ROS type, without duplicates.
    pub(super) fn nodes_that_publish(&self, type_name: &str) -> BTreeSet<String> {
        let publishes = |endpoint: &&Endpoint| {
            endpoint.kind == EndpointKind::Publisher
                && endpoint.type_name == type_name
                && !endpoint.own
        };
        self.graph.endpoints().filter(publishes).filter_map(|each| each.node.clone()).collect()
    }

    /// The server of a request topic, if another participant has one.
    pub(super) fn server(&self, request_topic: &str) -> Option<Gid> {
        let answers = |found: &&Found| {
            found.kind == EndpointKind::Subscription
                && found.topic == request_topic
                && found.participant != self.own
        };
        self.endpoints.values().find(answers).map(|found| found.gid)
    }
}

/// The ids of the endpoints of a node.
fn gids(node: &NodeEntitiesInfo) -> impl Iterator<Item = Gid> {
    node.reader_gid_seq.iter().chain(&node.writer_gid_seq).map(|gid| Gid::prefixed(*gid))
}

/// The types with which a topic is published, if there are several.
pub(super) fn several_types(graph: &Graph, topic: &str) -> Option<BTreeSet<String>> {
    let types: BTreeSet<String> = graph.publishers(topic).map(|it| it.type_name.clone()).collect();
    (types.len() > 1).then_some(types)
}

fn full_name(node: &NodeEntitiesInfo) -> String {
    names::node(&node.node_namespace, &node.node_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: Gid = Gid::prefixed([1; 16]);
    const ROBOT: Gid = Gid::prefixed([2; 16]);

    fn found(kind: EndpointKind, participant: Gid, id: u8, topic: &str) -> Found {
        Found {
            kind,
            gid: Gid::prefixed([id; 16]),
            participant,
            topic: topic.into(),
            type_name: "a::msg::dds_::X_".into(),
            type_hash: String::new(),
            qos: Qos::reliable(1),
        }
    }

    fn census() -> Census {
        let mut census = Census::new(OURS);
        census.apply(Change::Participant(
            ROBOT,
            Some(Process { host: "laptop2".into(), name: "driver".into() }),
        ));
        let publisher = found(EndpointKind::Publisher, ROBOT, 21, "rt/r1/x");
        let service = found(EndpointKind::Subscription, ROBOT, 22, "rq/r1/driver/yRequest");
        let ours = found(EndpointKind::Subscription, OURS, 11, "rt/r1/x");
        let nodes = found(EndpointKind::Publisher, OURS, 12, DISCOVERY_TOPIC);
        for found in [publisher, service, ours, nodes] {
            census.apply(Change::Endpoint(found));
        }
        let node = NodeEntitiesInfo {
            node_namespace: "/r1".into(),
            node_name: "driver".into(),
            reader_gid_seq: vec![[22; 16]],
            writer_gid_seq: vec![[21; 16]],
        };
        census.hear(ParticipantEntitiesInfo {
            gid: ROBOT.bytes(),
            node_entities_info_seq: vec![node],
        });
        census
    }

    #[test]
    fn the_graph_has_topics_only_and_knows_their_nodes() {
        let graph = census().graph();
        assert!(graph.nodes().eq(["/r1/driver"]));
        let topics: Vec<_> = graph.endpoints().map(|each| each.topic.as_str()).collect();
        assert_eq!(topics, ["/r1/x", "/r1/x"]);
        let publisher = graph.publishers("/r1/x").next().unwrap();
        assert_eq!((publisher.node.as_deref(), publisher.own), (Some("/r1/driver"), false));
        assert_eq!(publisher.type_name, "a/msg/X");
    }

    #[test]
    fn a_computer_is_called_by_what_its_participant_gives_else_by_its_node() {
        let mut census = census();
        let robot = |census: &Census| census.graph().computer(Gid::prefixed([2; 16]));
        assert_eq!(robot(&census), "laptop2 (driver, 020202020202)");
        census.apply(Change::Participant(ROBOT, None));
        assert_eq!(robot(&census), "/r1/driver (020202020202)");
        assert_eq!(census.graph().computer(Gid::prefixed([3; 16])), "030303030303");
    }

    #[test]
    fn services_of_those_who_speak_our_mapping_can_be_asked() {
        let mut census = census();
        assert_eq!(census.graph().services().count(), 0);
        let topic = "rq/r1/driver/probe_clockRequest";
        let mut server = found(EndpointKind::Subscription, ROBOT, 0, topic);
        let mut id = server.gid.bytes();
        id[..2].copy_from_slice(&[0x01, 0x10]);
        server.gid = Gid::prefixed(id);
        server.type_name = "teampulse_msgs::srv::dds_::ProbeClock_Request_".into();
        let gid = server.gid;
        census.apply(Change::Endpoint(server));
        let (name, type_name) = ("/r1/driver/probe_clock", "teampulse_msgs/srv/ProbeClock");
        let service = Service { name: name.into(), type_name: type_name.into(), gid, own: false };
        assert!(census.graph().services().eq([&service]));
        census.apply(Change::EndpointGone(gid));
        assert_eq!(census.graph().services().count(), 0);
    }

    #[test]
    fn our_node_has_our_endpoints_but_not_those_that_are_not_ros() {
        let info = census().own_nodes("/", "teampulse");
        let node = &info.node_entities_info_seq[0];
        assert_eq!(node.reader_gid_seq, [[11; 16]]);
        assert!(node.writer_gid_seq.is_empty());
        assert_eq!(info.gid, OURS.bytes());
    }

    #[test]
    fn nodes_of_nobody_are_not_there() {
        let node = NodeEntitiesInfo { node_name: "ghost".into(), ..NodeEntitiesInfo::default() };
        let mut census = census();
        census.hear(ParticipantEntitiesInfo { gid: [9; 16], node_entities_info_seq: vec![node] });
        assert!(census.graph().nodes().eq(["/r1/driver"]));
    }

    #[test]
    fn a_participant_takes_its_nodes_and_endpoints_with_it() {
        let mut census = census();
        census.apply(Change::ParticipantGone(ROBOT));
        let graph = census.graph();
        assert_eq!(graph.nodes().count(), 0);
        assert!(graph.endpoints().all(|each| each.own));
    }

    #[test]
    fn the_nodes_that_can_give_a_type_are_those_that_publish_it() {
        let census = census();
        assert_eq!(census.nodes_that_publish("a/msg/X").len(), 1);
        assert_eq!(census.nodes_that_publish("a/msg/Y").len(), 0);
        assert_eq!(census.server("rq/r1/driver/yRequest"), Some(Gid::prefixed([22; 16])));
        assert_eq!(census.server("rq/r1/driver/zRequest"), None);
    }

    #[test]
    fn a_topic_with_two_types_is_ambiguous() {
        let mut census = census();
        assert_eq!(several_types(&census.graph(), "/r1/x"), None);
        let mut second = found(EndpointKind::Publisher, ROBOT, 23, "rt/r1/x");
        second.type_name = "a::msg::dds_::Y_".into();
        census.apply(Change::Endpoint(second));
        let types = BTreeSet::from(["a/msg/X".to_owned(), "a/msg/Y".to_owned()]);
        assert_eq!(several_types(&census.graph(), "/r1/x"), Some(types));
    }
}
