//! `std_msgs`: the header.

use teampulse_core::time::Time;

use super::message;

/// The time of a measurement, and its coordinate frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// The time of measurement.
    pub stamp: Time,
    /// The coordinate frame; empty if there is none.
    pub frame_id: String,
}

message!(Header { stamp, frame_id } = "std_msgs/msg/Header");

/// A text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text {
    /// The text.
    pub data: String,
}

message!(Text { data } = "std_msgs/msg/String");

/// A boolean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flag {
    /// The boolean.
    pub data: bool,
}

message!(Flag { data } = "std_msgs/msg/Bool");

impl Header {
    /// A header with a stamp and without a frame.
    pub fn at(stamp: Time) -> Header {
        Header { stamp, frame_id: String::new() }
    }
}
