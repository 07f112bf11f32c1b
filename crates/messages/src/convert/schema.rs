use std::sync::Arc;

use teampulse_core::stream::{Schema, Shape};

use crate::catalogue;
use crate::standard::{Message, teampulse_msgs as msgs};

/// The ROS type of a stream's samples: its name, its hash and its full definition.
pub fn schema_of(shape: &Shape) -> Arc<Schema> {
    match shape {
        Shape::Message(schema) => Arc::clone(schema),
        ours => named(type_name(ours)),
    }
}

/// The name of the ROS type of a stream's samples.
pub fn type_name(shape: &Shape) -> &str {
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

/// The shape of samples received as messages of this type.
pub fn shape_of(schema: &Arc<Schema>) -> Shape {
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

/// The schema of a type by its name: without definition and hash unless these are shipped.
pub(super) fn named(type_name: &str) -> Arc<Schema> {
    let unknown = || {
        Arc::new(Schema {
            name: type_name.to_owned(),
            encoding: "ros2msg".to_owned(),
            text: String::new(),
            hash: String::new(),
        })
    };
    catalogue::shipped(type_name).unwrap_or_else(unknown)
}
