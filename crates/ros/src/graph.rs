//! The graph: who publishes and subscribes to what.

use std::fmt;

use teampulse_core::qos::Qos;

/// What there is on a bus at one moment, sorted by topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// Every publisher and subscription of ROS topics.
    pub endpoints: Vec<Endpoint>,
    /// The full names of all nodes: `/robot1/driver`; sorted.
    pub nodes: Vec<String>,
}

impl Graph {
    /// The publishers of a topic.
    pub fn publishers<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a Endpoint> {
        let writes =
            move |each: &&Endpoint| each.kind == EndpointKind::Publisher && each.topic == topic;
        self.endpoints.iter().filter(writes)
    }
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
    /// The type hash that it tells; empty when it tells none.
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

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}
