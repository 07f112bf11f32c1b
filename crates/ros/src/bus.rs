//! The bus: plain ROS names and raw CDR, whatever carries them.

use std::sync::Arc;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_core::qos::Qos;
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;
use thiserror::Error;
use tokio::sync::{broadcast, watch};

use crate::graph::{Gid, Graph};

/// Something that carries ROS messages: DDS on one domain, or memory.
///
/// Topic and type names are ROS's own (`/robot1/odom`, `nav_msgs/msg/Odometry`); what they are
/// called on the wire stays inside.
#[async_trait]
pub trait Bus: Send + Sync {
    /// What it is called in messages: `ROS domain 0`.
    fn name(&self) -> String;

    /// Who is there, always the newest; our own endpoints included.
    fn graph(&self) -> watch::Receiver<Arc<Graph>>;

    /// What goes wrong between endpoints, as it happens.
    fn incidents(&self) -> broadcast::Receiver<Incident>;

    /// Subscribes to a topic. `deliver` is called on a thread of the bus for each message and must
    /// not wait. The subscription ends when it is dropped.
    fn subscribe(
        &self,
        topic: &str,
        type_name: &str,
        asked: Asked,
        deliver: Deliver,
    ) -> Result<Subscription, BusError>;

    /// Begins to publish on a topic; ends when the publisher is dropped.
    fn publish(
        &self,
        topic: &str,
        schema: &Schema,
        qos: &Qos,
    ) -> Result<Box<dyn Publisher>, BusError>;

    /// The full name of our node: `/teampulse`.
    fn node(&self) -> String;

    /// Offers a service, of the type `teampulse_msgs/srv/ProbeClock`. `answer` is called on a thread
    /// of the bus for each request and must not wait. The service ends when it is dropped.
    fn serve(
        &self,
        service: &str,
        type_name: &str,
        answer: Answer,
    ) -> Result<Subscription, BusError>;

    /// Becomes a client of a service: of all who offer one of this name, but for ourselves. `hear` is
    /// called on a thread of the bus for each answer to what this client asked, and must not wait.
    fn client(
        &self,
        service: &str,
        type_name: &str,
        hear: Hear,
    ) -> Result<Box<dyn Client>, BusError>;

    /// The definition of a type, from any participant that provides it.
    async fn definition(&self, type_name: &str, hash: &str) -> Result<Schema, BusError>;
}

/// The quality of service that a subscription asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Asked {
    /// What suits everything that is offered, as rosbag2 chooses it, and chosen again when
    /// publishers join; keeps the last `depth` messages.
    Adaptive {
        /// How many messages are kept until they are taken.
        depth: u32,
    },
    /// Exactly this.
    Exactly(Qos),
}

/// What is called for each message.
pub type Deliver = Arc<dyn Fn(Arrival) + Send + Sync>;

/// A message as it arrives.
#[derive(Clone, Debug)]
pub struct Arrival {
    /// CDR with its four-byte header.
    pub bytes: Bytes,
    /// When the publisher wrote it, by its own clock.
    pub source_time: Option<Time>,
    /// Who published it.
    pub publisher: Gid,
    /// Its number among the publisher's messages, where it can be known; consecutive.
    pub sequence: Option<u64>,
}

/// What is called for each request: CDR with its four-byte header, and so is the answer. `None`
/// leaves the request without one.
pub type Answer = Arc<dyn Fn(&[u8]) -> Option<Bytes> + Send + Sync>;

/// What is called for each reply.
pub type Hear = Arc<dyn Fn(Reply) + Send + Sync>;

/// A reply as it arrives.
#[derive(Clone, Debug)]
pub struct Reply {
    /// The number that the request was given.
    pub number: i64,
    /// CDR with its four-byte header.
    pub bytes: Bytes,
    /// Who answered.
    pub server: Gid,
}

/// The asking end of a service.
pub trait Client: Send + Sync {
    /// Sends a request: CDR with its four-byte header, at most once. Its reply carries the same number.
    fn ask(&self, number: i64, request: &[u8]) -> Result<(), BusError>;
}

/// A subscription; it ends when this is dropped.
pub struct Subscription(#[expect(dead_code, reason = "held for its drop")] Box<dyn Send + Sync>);

impl Subscription {
    /// A subscription that ends when `guard` is dropped.
    pub fn new(guard: impl Send + Sync + 'static) -> Subscription {
        Subscription(Box::new(guard))
    }
}

/// The publishing end of a topic.
pub trait Publisher: Send + Sync {
    /// Publishes a message: CDR with its four-byte header, at most once, stamped now.
    fn publish(&self, cdr: &[u8]) -> Result<(), BusError>;

    /// The same, with a given stamp.
    fn publish_at(&self, cdr: &[u8], stamp: Time) -> Result<(), BusError>;

    /// How many subscribers are matched now.
    fn subscribers(&self) -> usize;
}

/// Something that goes wrong between endpoints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A publisher and a subscriber ask for what the other does not offer: nothing flows.
    IncompatibleQos {
        /// The topic.
        topic: String,
        /// The policy on which they differ: `reliability`.
        policy: String,
        /// Whether it is our subscription that asks for too much, or a foreign one of our topic.
        ours: bool,
    },
    /// A publisher missed the deadline that it promised.
    DeadlineMissed {
        /// The topic.
        topic: String,
        /// How often since the subscription began.
        total: u64,
    },
    /// This machine dropped packets because our receive buffers were full. What reliable publishers
    /// send again is not lost.
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

/// What can go wrong on a bus. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum BusError {
    /// The bus can't be joined.
    #[error("join {bus}: {reason}")]
    Join {
        /// The bus.
        bus: String,
        /// What the library says.
        reason: String,
        /// What the user can do; may be empty.
        hint: String,
    },
    /// A variable of the environment means nothing.
    #[error("read the environment: {variable} is {value:?}, expected {expected}")]
    Variable {
        /// The variable: `ROS_DOMAIN_ID`.
        variable: &'static str,
        /// Its value.
        value: String,
        /// What it could be.
        expected: String,
    },
    /// A topic can't be subscribed to or published on.
    #[error("open topic {topic} of type {type_name}: {reason}")]
    Topic {
        /// The topic.
        topic: String,
        /// The type.
        type_name: String,
        /// What the library says.
        reason: String,
    },
    /// A message can't be published.
    #[error("publish on {topic}: {reason}")]
    Publish {
        /// The topic.
        topic: String,
        /// What the library says.
        reason: String,
    },
    /// No participant provides a definition.
    #[error("find the definition of {type_name}: {reason}")]
    Definition {
        /// The type.
        type_name: String,
        /// What was tried.
        reason: String,
    },
}

impl BusError {
    /// What the user can do about it; may be empty.
    pub fn hint(&self) -> String {
        match self {
            BusError::Join { hint, .. } => hint.clone(),
            BusError::Variable { variable, .. } => {
                format!("set it to that of the robots, or `unset {variable}`")
            }
            BusError::Topic { .. } | BusError::Publish { .. } | BusError::Definition { .. } => {
                String::new()
            }
        }
    }
}
