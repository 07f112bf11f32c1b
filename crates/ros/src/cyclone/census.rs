//! The participants present: discovered endpoints, joined with the nodes that participants announce.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_core::qos::Qos;
use teampulse_messages::standard::rmw_dds_common::{NodeEntitiesInfo, ParticipantEntitiesInfo};

use super::names;
use super::service;
use crate::graph::{Endpoint, EndpointKind, Gid, Graph, Participant, Service};

/// The topic on which participants announce their nodes.
pub(super) const DISCOVERY_TOPIC: &str = "ros_discovery_info";

/// Something that was discovered.
#[derive(Debug)]
pub(super) enum Change {
    /// A participant is present, on a computer whose name it may announce.
    Participant(Gid, Option<String>),
    /// An endpoint is there, or more is known about it.
    Endpoint(Found),
    /// An endpoint is there no more.
    EndpointGone(Gid),
    /// A participant is there no more.
    ParticipantGone(Gid),
}

/// An endpoint as DDS knows it.
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

/// Everyone on a domain.
#[derive(Debug)]
pub(super) struct Census {
    own: Gid,
    /// The computer that each participant announces, by id.
    participants: BTreeMap<Gid, Option<String>>,
    endpoints: BTreeMap<Gid, Found>,
    nodes: BTreeMap<Gid, Vec<NodeEntitiesInfo>>,
}

impl Census {
    /// An empty census, as taken by this participant.
    pub(super) fn new(own: Gid) -> Census {
        let participants = BTreeMap::from([(own, None)]);
        Census { own, participants, endpoints: BTreeMap::new(), nodes: BTreeMap::new() }
    }

    pub(super) fn apply(&mut self, change: Change) {
        match change {
            Change::Participant(gid, computer) => {
                self.participants.insert(gid, computer);
            }
            Change::Endpoint(found) => {
                self.endpoints.insert(found.gid, found);
            }
            Change::EndpointGone(gid) => {
                self.endpoints.remove(&gid);
            }
            Change::ParticipantGone(gid) => {
                self.participants.remove(&gid);
                self.nodes.remove(&gid);
                self.endpoints.retain(|_, found| found.participant != gid);
            }
        }
    }

    /// Takes in a participant's announcement of its nodes; ignores participants that are not present.
    pub(super) fn hear(&mut self, info: ParticipantEntitiesInfo) {
        if self.participants.contains_key(&Gid(info.gid)) {
            self.nodes.insert(Gid(info.gid), info.node_entities_info_seq);
        }
    }

    /// The announcement of our only node.
    pub(super) fn own_nodes(&self, namespace: &str, name: &str) -> ParticipantEntitiesInfo {
        let gids = |kind| {
            let ours = self.endpoints.values().filter(move |found| {
                found.participant == self.own && found.kind == kind && names::is_ros(&found.topic)
            });
            ours.map(|found| found.gid.0).collect()
        };
        let node = NodeEntitiesInfo {
            node_namespace: namespace.to_owned(),
            node_name: name.to_owned(),
            reader_gid_seq: gids(EndpointKind::Subscription),
            writer_gid_seq: gids(EndpointKind::Publisher),
        };
        ParticipantEntitiesInfo { gid: self.own.0, node_entities_info_seq: vec![node] }
    }

    /// Who is there in ROS's terms.
    pub(super) fn graph(&self) -> Graph {
        let owners = self.owners();
        let endpoint = |found: &Found| {
            Some(Endpoint {
                kind: found.kind,
                topic: names::ros_topic(&found.topic)?,
                type_name: names::ros_type(&found.type_name),
                type_hash: found.type_hash.clone(),
                qos: found.qos.clone(),
                gid: found.gid,
                node: owners.get(&found.gid).cloned(),
                own: found.participant == self.own,
            })
        };
        let mut endpoints: Vec<Endpoint> = self.endpoints.values().filter_map(endpoint).collect();
        endpoints.sort_by(|one, other| (&one.topic, one.gid).cmp(&(&other.topic, other.gid)));
        let nodes: BTreeSet<String> = self.nodes.values().flatten().map(full_name).collect();
        let nodes = nodes.into_iter().collect();
        Graph { endpoints, nodes, services: self.services(), computers: self.computers() }
    }

    /// The services of those who speak our mapping.
    fn services(&self) -> Vec<Service> {
        let service = |found: &Found| {
            let type_name = names::ros_type(&found.type_name);
            Some(Service {
                name: names::ros_service(&found.topic)?,
                type_name: type_name.strip_suffix("_Request")?.to_owned(),
                gid: found.gid,
                own: found.participant == self.own,
            })
        };
        let takes = |found: &&Found| {
            found.kind == EndpointKind::Subscription && service::speaks_it(found.gid)
        };
        self.endpoints.values().filter(takes).filter_map(service).collect()
    }

    /// The names of participants' computers: as announced, else the name of their first node.
    fn computers(&self) -> BTreeMap<Participant, String> {
        let computer = |(gid, told): (&Gid, &Option<String>)| {
            let participant = gid.participant();
            let node = || self.nodes.get(gid).and_then(|nodes| nodes.first()).map(full_name);
            let text = told.clone().or_else(node)?;
            let (name, process) = text.split_once(' ').unwrap_or((&text, ""));
            let separator = if process.is_empty() { "" } else { ", " };
            Some((participant, format!("{name} ({process}{separator}{participant})")))
        };
        self.participants.iter().filter_map(computer).collect()
    }

    /// The nodes that publish a ROS type, others' only, each once.
    pub(super) fn nodes_that_publish(&self, type_name: &str) -> BTreeSet<String> {
        let publishes = |endpoint: &&Endpoint| {
            endpoint.kind == EndpointKind::Publisher
                && endpoint.type_name == type_name
                && !endpoint.own
        };
        let graph = self.graph();
        let nodes = graph.endpoints.iter().filter(publishes).filter_map(|each| each.node.clone());
        nodes.collect()
    }

    /// Who of others answers requests on a DDS topic.
    pub(super) fn server(&self, request_topic: &str) -> Option<Gid> {
        let answers = |found: &&Found| {
            found.kind == EndpointKind::Subscription
                && found.topic == request_topic
                && found.participant != self.own
        };
        self.endpoints.values().find(answers).map(|found| found.gid)
    }

    fn owners(&self) -> BTreeMap<Gid, String> {
        let of_node = |node: &NodeEntitiesInfo| {
            let name = full_name(node);
            let gids = node.reader_gid_seq.iter().chain(&node.writer_gid_seq);
            gids.map(|gid| (Gid(*gid), name.clone())).collect::<Vec<_>>()
        };
        self.nodes.values().flatten().flat_map(of_node).collect()
    }
}

/// The topics that are published with more than one type, each with its types.
pub(super) fn ambiguous_topics(graph: &Graph) -> BTreeMap<String, BTreeSet<String>> {
    let mut types = BTreeMap::<String, BTreeSet<String>>::new();
    for endpoint in graph.endpoints.iter().filter(|each| each.kind == EndpointKind::Publisher) {
        types.entry(endpoint.topic.clone()).or_default().insert(endpoint.type_name.clone());
    }
    types.retain(|_, types| types.len() > 1);
    types
}

fn full_name(node: &NodeEntitiesInfo) -> String {
    names::node(&node.node_namespace, &node.node_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: Gid = Gid([1; 16]);
    const ROBOT: Gid = Gid([2; 16]);

    fn found(kind: EndpointKind, participant: Gid, id: u8, topic: &str) -> Found {
        Found {
            kind,
            gid: Gid([id; 16]),
            participant,
            topic: topic.into(),
            type_name: "a::msg::dds_::X_".into(),
            type_hash: String::new(),
            qos: Qos::reliable(1),
        }
    }

    fn census() -> Census {
        let mut census = Census::new(OURS);
        census.apply(Change::Participant(ROBOT, Some("laptop2 driver".into())));
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
        census.hear(ParticipantEntitiesInfo { gid: ROBOT.0, node_entities_info_seq: vec![node] });
        census
    }

    #[test]
    fn the_graph_has_topics_only_and_knows_their_nodes() {
        let graph = census().graph();
        assert_eq!(graph.nodes, ["/r1/driver"]);
        let topics: Vec<_> = graph.endpoints.iter().map(|each| each.topic.as_str()).collect();
        assert_eq!(topics, ["/r1/x", "/r1/x"]);
        let publisher = graph.publishers("/r1/x").next().unwrap();
        assert_eq!((publisher.node.as_deref(), publisher.own), (Some("/r1/driver"), false));
        assert_eq!(publisher.type_name, "a/msg/X");
    }

    #[test]
    fn a_computer_is_called_by_what_its_participant_gives_else_by_its_node() {
        let mut census = census();
        let robot = |census: &Census| census.graph().computer(Gid([2; 16]));
        assert_eq!(robot(&census), "laptop2 (driver, 020202020202)");
        census.participants.insert(ROBOT, None);
        assert_eq!(robot(&census), "/r1/driver (020202020202)");
        assert_eq!(census.graph().computer(Gid([3; 16])), "030303030303");
    }

    #[test]
    fn services_of_those_who_speak_our_mapping_can_be_asked() {
        let mut census = census();
        assert_eq!(census.graph().services, []);
        let topic = "rq/r1/driver/probe_clockRequest";
        let mut server = found(EndpointKind::Subscription, ROBOT, 0, topic);
        server.gid.0[..2].copy_from_slice(&[0x01, 0x10]);
        server.type_name = "teampulse_msgs::srv::dds_::ProbeClock_Request_".into();
        let gid = server.gid;
        census.apply(Change::Endpoint(server));
        let (name, type_name) = ("/r1/driver/probe_clock", "teampulse_msgs/srv/ProbeClock");
        let service = Service { name: name.into(), type_name: type_name.into(), gid, own: false };
        assert_eq!(census.graph().services, [service]);
    }

    #[test]
    fn our_node_has_our_endpoints_but_not_those_that_are_not_ros() {
        let info = census().own_nodes("/", "teampulse");
        let node = &info.node_entities_info_seq[0];
        assert_eq!(node.reader_gid_seq, [[11; 16]]);
        assert!(node.writer_gid_seq.is_empty());
        assert_eq!(info.gid, OURS.0);
    }

    #[test]
    fn nodes_of_nobody_are_not_there() {
        let node = NodeEntitiesInfo { node_name: "ghost".into(), ..NodeEntitiesInfo::default() };
        let mut census = census();
        census.hear(ParticipantEntitiesInfo { gid: [9; 16], node_entities_info_seq: vec![node] });
        assert_eq!(census.graph().nodes, ["/r1/driver"]);
    }

    #[test]
    fn a_participant_takes_its_nodes_and_endpoints_with_it() {
        let mut census = census();
        census.apply(Change::ParticipantGone(ROBOT));
        let graph = census.graph();
        assert!(graph.nodes.is_empty());
        assert!(graph.endpoints.iter().all(|each| each.own));
    }

    #[test]
    fn the_nodes_that_can_give_a_type_are_those_that_publish_it() {
        let census = census();
        assert_eq!(census.nodes_that_publish("a/msg/X").len(), 1);
        assert_eq!(census.nodes_that_publish("a/msg/Y").len(), 0);
        assert_eq!(census.server("rq/r1/driver/yRequest"), Some(Gid([22; 16])));
        assert_eq!(census.server("rq/r1/driver/zRequest"), None);
    }

    #[test]
    fn a_topic_with_two_types_is_ambiguous() {
        let mut census = census();
        assert!(ambiguous_topics(&census.graph()).is_empty());
        let mut second = found(EndpointKind::Publisher, ROBOT, 23, "rt/r1/x");
        second.type_name = "a::msg::dds_::Y_".into();
        census.apply(Change::Endpoint(second));
        let types = BTreeSet::from(["a/msg/X".to_owned(), "a/msg/Y".to_owned()]);
        assert_eq!(ambiguous_topics(&census.graph()).get("/r1/x"), Some(&types));
    }
}
