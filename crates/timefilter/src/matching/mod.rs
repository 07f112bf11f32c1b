//! Matching messages into sets, as ROS's `message_filters` does.
//!
//! A set has one message of each topic, and each message is in at most one set. The sets depend only on the
//! stamps and the order of arrival. Every message is in a set, is queued, or was dropped for a
//! [`DropReason`].

mod message;
mod drops;
mod approximate;
mod queue;
mod interval;
mod age_penalty;
mod exact;

pub use approximate::{ApproximateSettings, ApproximateTime, TopicSettings};
pub use drops::DropReason;
pub use exact::ExactTime;
pub use message::{Listener, Message, Set};
