//! `std_msgs`: the header.

use teampulse_core::time::Time;

use super::message;

/// When something was measured, and in which frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// When it was measured.
    pub stamp: Time,
    /// The frame of its coordinates; empty where it has none.
    pub frame_id: String,
}

message!(Header { stamp, frame_id } = "std_msgs/msg/Header");

impl Header {
    /// A header with a stamp and no frame.
    pub fn at(stamp: Time) -> Header {
        Header { stamp, frame_id: String::new() }
    }
}
