//! `rosgraph_msgs`: simulated time.

use teampulse_core::time::Time;

use super::message;

/// The time published on `/clock`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    /// The time.
    pub clock: Time,
}

message!(Clock { clock } = "rosgraph_msgs/msg/Clock");
