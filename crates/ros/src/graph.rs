//! The graph: who publishes and subscribes to what.

use std::collections::BTreeMap;
use std::fmt;

use teampulse_core::qos::Qos;

/// What there is on a bus at one moment, sorted by topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// Every publisher and subscription of ROS topics.
    pub endpoints: Vec<Endpoint>,
    /// The full names of all nodes: `/robot1/driver`; sorted.
    pub nodes: Vec<String>,
    /// The services that can be asked.
    pub services: Vec<Service>,
    /// Names of the computers of participants, where announced.
    pub computers: BTreeMap<Participant, String>,
}

impl Graph {
    /// The publishers of a topic.
    pub fn publishers<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a Endpoint> {
        // They are sorted by topic: thousands of topics are looked up at every change.
        let first = self.endpoints.partition_point(|each| each.topic.as_str() < topic);
        let of_topic = self.endpoints[first..].iter().take_while(move |each| each.topic == topic);
        of_topic.filter(|each| each.kind == EndpointKind::Publisher)
    }

    /// The name of the computer behind an endpoint: its host and process where its participant announces
    /// them, else its node. Different for each participant.
    pub fn computer(&self, of: Gid) -> String {
        let participant = of.participant();
        let known = self.computers.get(&participant);
        known.cloned().unwrap_or_else(|| participant.to_string())
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
