//! The topics that a team publishes.

use super::topic::Topic;

/// A topic of a robot.
#[derive(Clone, Debug)]
pub struct Published {
    /// The robot's name.
    pub robot: String,
    /// The topic.
    pub topic: Topic,
    /// The rate of the topic [Hz]; 0 if it is irregular.
    pub rate_hz: f64,
}
