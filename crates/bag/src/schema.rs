//! The ROS types of streams, and back.

use std::sync::Arc;

use teampulse_core::stream::{Schema, Shape};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs as msgs;

/// The topic on which streams are described.
pub(crate) const DESCRIPTIONS_TOPIC: &str = "/teampulse/streams";

/// Whether a topic with a type is the one on which streams are described.
pub(crate) fn is_description(topic: &str, type_name: &str) -> bool {
    topic == DESCRIPTIONS_TOPIC && type_name == msgs::StreamDescription::NAME
}

/// The shape of samples that were recorded as the type of one of our own shapes.
pub(crate) fn own_shape(schema: &Arc<Schema>) -> Shape {
    match schema.name.as_str() {
        msgs::Sample::NAME => Shape::Sample,
        msgs::Wave::NAME => Shape::Wave,
        msgs::Feature::NAME => Shape::Feature,
        msgs::Event::NAME => Shape::Event,
        msgs::StreamStatus::NAME => Shape::Status,
        msgs::StreamDescription::NAME => Shape::Description,
        _ => Shape::Message(Arc::clone(schema)),
    }
}

/// The name of the type of a stream's samples.
pub(crate) fn type_name(shape: &Shape) -> &str {
    match shape {
        Shape::Sample => msgs::Sample::NAME,
        Shape::Wave => msgs::Wave::NAME,
        Shape::Feature => msgs::Feature::NAME,
        Shape::Event => msgs::Event::NAME,
        Shape::Status => msgs::StreamStatus::NAME,
        Shape::Description => msgs::StreamDescription::NAME,
        Shape::Message(schema) => &schema.name,
    }
}
