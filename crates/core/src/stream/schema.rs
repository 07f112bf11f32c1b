//! The type of a ROS message.

use std::sync::Arc;

use crate::text::{self, LONGEST_NAME};

/// The type of a ROS message.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Schema {
    /// The full name: `sensor_msgs/msg/BatteryState`.
    pub name: String,
    /// How `text` is written: `ros2msg` or `ros2idl`.
    pub encoding: String,
    /// The definition with all its dependencies, as rosbag2 stores it in a bag; empty while unknown.
    pub text: String,
    /// The type hash, `RIHS01_` and 64 hexadecimal digits; empty where unknown.
    pub hash: String,
}

impl Schema {
    /// The memory that the schema's texts occupy [bytes].
    pub(super) fn held_bytes(&self) -> usize {
        let Schema { name, encoding, text, hash } = self;
        [name, encoding, text, hash].map(String::capacity).iter().sum()
    }

    /// Cuts and cleans all texts but the definition, which stays unchanged.
    pub(super) fn clean(this: &mut Arc<Schema>) {
        let Schema { name, encoding, hash, .. } = &**this;
        if [name, encoding, hash].iter().all(|text| text::is_clean(text, LONGEST_NAME)) {
            return;
        }
        let Schema { name, encoding, hash, .. } = Arc::make_mut(this);
        for text in [name, encoding, hash] {
            *text = text::name(std::mem::take(text), LONGEST_NAME);
        }
    }
}
