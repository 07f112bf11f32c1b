//! `diagnostic_msgs`: a robot's reports about its own components.

use super::message;
use super::std_msgs::Header;

/// The states of several components.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnosticArray {
    /// The time of the report.
    pub header: Header,
    /// The state of each component.
    pub status: Vec<DiagnosticStatus>,
}

message!(DiagnosticArray { header, status } = "diagnostic_msgs/msg/DiagnosticArray");

/// The state of one component.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnosticStatus {
    /// The level, as one of the codes below.
    pub level: u8,
    /// The name of the component.
    pub name: String,
    /// A description of the state.
    pub message: String,
    /// The id of the hardware.
    pub hardware_id: String,
    /// The measurements.
    pub values: Vec<KeyValue>,
}

message!(
    DiagnosticStatus { level, name, message, hardware_id, values } =
        "diagnostic_msgs/msg/DiagnosticStatus"
);

impl DiagnosticStatus {
    /// The component works normally.
    pub const OK: u8 = 0;
    /// The component works, with a warning.
    pub const WARN: u8 = 1;
    /// The component has failed.
    pub const ERROR: u8 = 2;
    /// The component no longer reports.
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
