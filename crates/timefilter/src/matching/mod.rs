//! Matching messages into sets, as ROS's `message_filters` does.
//!
//! A set has one message of each topic, and each message is in one set at most. The sets follow from
//! the stamps and the order of arrival alone. Whatever was pushed is in a set, or waits, or was
//! dropped for a [`DropReason`].

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
