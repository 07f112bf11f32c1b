//! The bus: ROS names and raw CDR, independent of the transport.

use std::sync::Arc;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_core::qos::Qos;
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;
use thiserror::Error;
use tokio::sync::{broadcast, watch};

use crate::graph::{Gid, Graph};

/// A transport for ROS messages: DDS in one domain, or memory.
///
/// Topic and type names are ROS's own (`/robot1/odom`, `nav_msgs/msg/Odometry`); the mapping to names on
/// the wire is internal.
///
/// # Contract
/// - No bus delivers its own messages: a subscription never receives messages that the same bus publishes, and a client
///   never receives replies of its own services.
/// - For each subscription, messages of one publisher are delivered in order, each once, and one at a time. A
///   transient-local publisher's last messages are delivered to late joiners, before newer ones.
/// - The bus matches publishers and subscriptions by their QoS, as ROS 2 does; a pair that does not match exchanges
///   nothing and is reported as [`Incident::IncompatibleQos`]. For [`Asked::Adaptive`] the bus finds the QoS that
///   matches all publishers, and adapts it when one joins.
/// - Once a [`Subscription`] has been dropped, its callback is not called again. The drop may wait for a running call:
///   callbacks must neither drop their subscription nor call the bus.
/// - All methods may be called from several threads. Joining ([`BusKind::join`](crate::buses::BusKind)) may block until
///   the transport is open, as a bus is joined only once, on its first use. Methods that open an endpoint must not
///   block.
#[async_trait]
pub trait Bus: Send + Sync {
    /// The name of the bus in messages: `ROS domain 0`.
    fn name(&self) -> String;

    /// The latest graph, including our own endpoints.
    fn graph(&self) -> watch::Receiver<Arc<Graph>>;

    /// Problems between endpoints, as they occur.
    fn incidents(&self) -> broadcast::Receiver<Incident>;

    /// Subscribes to a topic. `deliver` is called on a thread of the bus for each message and must not
    /// block. The subscription ends when it is dropped.
    fn subscribe(
        &self,
        topic: &str,
        type_name: &str,
        asked: Asked,
        deliver: Deliver,
    ) -> Result<Subscription, BusError>;

    /// Starts to publish on a topic, until the publisher is dropped.
    fn publish(
        &self,
        topic: &str,
        schema: &Schema,
        qos: &Qos,
    ) -> Result<Box<dyn Publisher>, BusError>;

    /// The full name of our node: `/teampulse`.
    fn node(&self) -> String;

    /// Offers a service of type `teampulse_msgs/srv/ProbeClock`. `answer` is called on a thread of the bus
    /// for each request and must not block. The service ends when it is dropped.
    fn serve(
        &self,
        service: &str,
        type_name: &str,
        answer: Answer,
    ) -> Result<Subscription, BusError>;

    /// Creates a client of all servers of this service except our own. `hear` is called on a thread of the
    /// bus for each reply to this client's requests, and must not block.
    fn client(
        &self,
        service: &str,
        type_name: &str,
        hear: Hear,
    ) -> Result<Box<dyn Client>, BusError>;

    /// The definition of a type, from any participant that provides it.
    async fn definition(&self, type_name: &str, hash: &str) -> Result<Schema, BusError>;
}

/// The quality of service that a subscription requests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Asked {
    /// A QoS compatible with all offers, as rosbag2 chooses it, and adapted by the bus when publishers join; keeps the
    /// last `depth` messages.
    Adaptive {
        /// The number of messages kept until they are taken.
        depth: u32,
    },
    /// Requests exactly this QoS.
    Exactly(Qos),
}

/// The callback for each message.
pub type Deliver = Arc<dyn Fn(Arrival) + Send + Sync>;

/// A received message.
#[derive(Clone, Debug)]
pub struct Arrival {
    /// CDR with its four-byte header.
    pub bytes: Bytes,
    /// When the publisher wrote the message, by the publisher's clock.
    pub source_time: Option<Time>,
    /// The publisher of the message.
    pub publisher: Gid,
    /// The publisher's sequence number, if known; numbers are consecutive.
    pub sequence: Option<u64>,
}

/// The callback for each request. Request and reply are CDR with its four-byte header. `None` sends no
/// reply.
pub type Answer = Arc<dyn Fn(&[u8]) -> Option<Bytes> + Send + Sync>;

/// The callback for each reply.
pub type Hear = Arc<dyn Fn(Reply) + Send + Sync>;

/// A received reply.
#[derive(Clone, Debug)]
pub struct Reply {
    /// The sequence number of the request.
    pub number: i64,
    /// CDR with its four-byte header.
    pub bytes: Bytes,
    /// The server that replied.
    pub server: Gid,
}

/// The client end of a service.
pub trait Client: Send + Sync {
    /// Sends a request: CDR with its four-byte header, at most once. The reply carries the same sequence number.
    fn ask(&self, number: i64, request: &[u8]) -> Result<(), BusError>;
}

/// A subscription, which ends when this value is dropped.
pub struct Subscription(#[expect(dead_code, reason = "held for its drop")] Box<dyn Send + Sync>);

impl Subscription {
    /// A subscription that ends when `guard` is dropped.
    pub fn new(guard: impl Send + Sync + 'static) -> Subscription {
        Subscription(Box::new(guard))
    }
}

/// The publishing end of a topic.
pub trait Publisher: Send + Sync {
    /// Publishes a message: CDR with its four-byte header, at most once, stamped with the current time.
    fn publish(&self, cdr: &[u8]) -> Result<(), BusError>;

    /// Publishes a message with a given timestamp.
    fn publish_at(&self, cdr: &[u8], stamp: Time) -> Result<(), BusError>;

    /// The number of matched subscribers.
    fn subscribers(&self) -> usize;
}

/// A problem between endpoints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incident {
    /// The QoS of a publisher and of a subscriber are incompatible: no messages are exchanged.
    IncompatibleQos {
        /// The topic.
        topic: String,
        /// The incompatible policy: `reliability`.
        policy: String,
        /// Whether the subscription is ours, rather than another participant's subscription to our topic.
        ours: bool,
    },
    /// A publisher missed the deadline that it offered.
    DeadlineMissed {
        /// The topic.
        topic: String,
        /// The number of missed deadlines since the subscription started.
        total: u64,
    },
    /// This machine dropped packets because our receive buffers were full. Messages that reliable
    /// publishers retransmit are not lost.
    Overflow {
        /// The number of packets since the previous report.
        packets: u64,
    },
    /// One topic is published with two types.
    TwoTypes {
        /// The topic.
        topic: String,
        /// The types, sorted.
        types: Vec<String>,
    },
}

/// An error of a bus. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum BusError {
    /// The bus can't be joined.
    #[error("join {bus}: {reason}")]
    Join {
        /// The bus.
        bus: String,
        /// The error of the library.
        reason: String,
        /// What the user can do; may be empty.
        hint: String,
    },
    /// An environment variable has an invalid value.
    #[error("read the environment: {variable} is {value:?}, expected {expected}")]
    Variable {
        /// The variable: `ROS_DOMAIN_ID`.
        variable: &'static str,
        /// The value of the variable.
        value: String,
        /// The valid values.
        expected: String,
    },
    /// A topic can't be subscribed to or published on.
    #[error("open topic {topic} of type {type_name}: {reason}")]
    Topic {
        /// The topic.
        topic: String,
        /// The type.
        type_name: String,
        /// The error of the library.
        reason: String,
    },
    /// A message can't be published.
    #[error("publish on {topic}: {reason}")]
    Publish {
        /// The topic.
        topic: String,
        /// The error of the library.
        reason: String,
    },
    /// No participant provided a definition.
    #[error("find the definition of {type_name}: {reason}")]
    Definition {
        /// The type.
        type_name: String,
        /// The attempts that were made.
        reason: String,
    },
}

impl BusError {
    /// What the user can do about it; may be empty.
    pub fn hint(&self) -> String {
        match self {
            BusError::Join { hint, .. } => hint.clone(),
            BusError::Variable { variable, .. } => {
                format!("set it to the domain of the robots, or `unset {variable}`")
            }
            BusError::Topic { .. } | BusError::Publish { .. } | BusError::Definition { .. } => {
                String::new()
            }
        }
    }
}
