//! The topic of stream descriptions.

use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs as msgs;

/// The topic of stream descriptions.
pub(crate) const DESCRIPTIONS_TOPIC: &str = "/teampulse/streams";

/// Whether a topic with this type carries stream descriptions.
pub(crate) fn is_description(topic: &str, type_name: &str) -> bool {
    topic == DESCRIPTIONS_TOPIC && type_name == msgs::StreamDescription::NAME
}
