//! The topic on which streams are described.

use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs as msgs;

/// The topic on which streams are described.
pub(crate) const DESCRIPTIONS_TOPIC: &str = "/teampulse/streams";

/// Whether a topic with a type is the one on which streams are described.
pub(crate) fn is_description(topic: &str, type_name: &str) -> bool {
    topic == DESCRIPTIONS_TOPIC && type_name == msgs::StreamDescription::NAME
}
