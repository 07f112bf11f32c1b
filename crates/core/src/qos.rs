//! Quality of service: what a publisher offers and a subscriber requests.

use std::time::Duration;

/// How a stream is delivered, in the terms of ROS 2 and DDS.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Qos {
    /// Whether lost messages are sent again.
    pub reliability: Reliability,
    /// Whether a late joiner receives earlier messages.
    pub durability: Durability,
    /// How many messages are kept.
    pub history: History,
    /// The longest promised time between two messages; `None` promises nothing.
    pub deadline: Option<Duration>,
    /// How long a message stays valid; `None` means forever.
    pub lifespan: Option<Duration>,
    /// Who asserts that a publisher is alive.
    pub liveliness: Liveliness,
    /// The longest time between two assertions; `None` requires none.
    pub liveliness_lease: Option<Duration>,
}

/// Whether lost messages are sent again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reliability {
    /// Sent once.
    BestEffort,
    /// Sent again until acknowledged.
    Reliable,
}

/// Whether a late joiner receives earlier messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Durability {
    /// Only new messages.
    Volatile,
    /// The messages that the publisher still keeps.
    TransientLocal,
}

/// How many messages a publisher or subscriber keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum History {
    /// The last messages, up to this number.
    KeepLast(u32),
    /// All, within resource limits.
    KeepAll,
}

/// Who asserts that a publisher is alive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Liveliness {
    /// The middleware.
    Automatic,
    /// The program, for each topic.
    ManualByTopic,
}

impl Qos {
    /// Reliable, volatile, the last `depth` messages: ROS 2's default for topics.
    pub const fn reliable(depth: u32) -> Qos {
        Qos {
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            history: History::KeepLast(depth),
            deadline: None,
            lifespan: None,
            liveliness: Liveliness::Automatic,
            liveliness_lease: None,
        }
    }

    /// Best effort, volatile, the last `depth` messages: ROS 2's "sensor data".
    pub const fn best_effort(depth: u32) -> Qos {
        Qos { reliability: Reliability::BestEffort, ..Qos::reliable(depth) }
    }

    /// Reliable, and late joiners receive the last `depth` messages: for states and descriptions.
    pub const fn latched(depth: u32) -> Qos {
        Qos { durability: Durability::TransientLocal, ..Qos::reliable(depth) }
    }
}
