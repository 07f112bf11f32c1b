//! `diagnostic_msgs`: what a robot says about its own parts.

use super::message;
use super::std_msgs::Header;

/// The states of several parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnosticArray {
    /// When.
    pub header: Header,
    /// A state for each part.
    pub status: Vec<DiagnosticStatus>,
}

message!(DiagnosticArray { header, status } = "diagnostic_msgs/msg/DiagnosticArray");

/// The state of one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnosticStatus {
    /// One of the codes below.
    pub level: u8,
    /// The part.
    pub name: String,
    /// What is the matter.
    pub message: String,
    /// Which piece of hardware it is.
    pub hardware_id: String,
    /// What was measured.
    pub values: Vec<KeyValue>,
}

message!(
    DiagnosticStatus { level, name, message, hardware_id, values } =
        "diagnostic_msgs/msg/DiagnosticStatus"
);

impl DiagnosticStatus {
    /// The part works.
    pub const OK: u8 = 0;
    /// It works, and something is unusual.
    pub const WARN: u8 = 1;
    /// It fails.
    pub const ERROR: u8 = 2;
    /// It has not been heard of.
    pub const STALE: u8 = 3;
}

/// A named value, as text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyValue {
    /// The name.
    pub key: String,
    /// The value.
    pub value: String,
}

message!(KeyValue { key, value } = "diagnostic_msgs/msg/KeyValue");
