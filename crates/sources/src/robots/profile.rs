//! The robot profile: what a robot should offer so that its condition can be judged.
//!
//! The profile has a norm for each parameter: a standard type in SI units, at least at the given rate, with a header
//! stamp from a synchronised clock. Rates are minimums that the drivers of common platforms (Clearpath, TurtleBot, PAL)
//! meet with their defaults.

use teampulse_core::stream::Signal;

/// What a robot should offer for one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Norm {
    /// The name that a study uses: `battery`.
    pub parameter: &'static str,
    /// The signal that it measures.
    pub signal: Signal,
    /// The ROS type.
    pub type_name: &'static str,
    /// The usual name of the topic, below the robot's namespace.
    pub topic: &'static str,
    /// The minimum rate [Hz].
    pub least_hz: f64,
    /// The numbers that are read, by field and unit.
    pub channels: &'static [(&'static str, &'static str)],
    /// The units of a single number mapped to this parameter; any unit is accepted if the list is empty.
    pub units: &'static [&'static str],
    /// Whether a robot without this parameter falls short of the profile.
    pub essential: bool,
    /// A description for users.
    pub doc: &'static str,
}

/// The robot profile.
pub const PROFILE: &[Norm] = &[
    Norm {
        parameter: "battery",
        signal: Signal::Battery,
        type_name: "sensor_msgs/msg/BatteryState",
        topic: "battery_state",
        least_hz: 0.5,
        channels: &[
            ("voltage", "V"),
            ("current", "A"),
            ("percentage", "1"),
            ("charge", "Ah"),
            ("capacity", "Ah"),
            ("power_supply_status", "1"),
        ],
        units: &["V", "A", "Ah", "W", "J", "1", "%"],
        essential: true,
        doc: "charge of the battery; current is negative when discharging, percentage 0 to 1",
    },
    Norm {
        parameter: "link",
        signal: Signal::Link,
        type_name: "wireless_msgs/msg/Connection",
        topic: "wifi",
        least_hz: 0.5,
        channels: &[("signal_level", "dBm"), ("link_quality", "1"), ("bitrate", "Mb/s")],
        units: &["dBm", "1", "%"],
        essential: true,
        doc: "quality of the radio link",
    },
    Norm {
        parameter: "odometry",
        signal: Signal::Odometry,
        type_name: "nav_msgs/msg/Odometry",
        topic: "odom",
        least_hz: 5.0,
        channels: &[
            ("pose.pose.position.x", "m"),
            ("pose.pose.position.y", "m"),
            ("twist.twist.linear.x", "m/s"),
            ("twist.twist.angular.z", "rad/s"),
        ],
        units: &[],
        essential: true,
        doc: "pose and velocity of the robot",
    },
    Norm {
        parameter: "diagnostics",
        signal: Signal::Diagnostics,
        type_name: "diagnostic_msgs/msg/DiagnosticArray",
        topic: "diagnostics",
        least_hz: 0.5,
        channels: &[("status[0].level", "1")],
        units: &[],
        essential: false,
        doc: "diagnostics of the robot's parts",
    },
    Norm {
        parameter: "temperature",
        signal: Signal::Temperature,
        type_name: "sensor_msgs/msg/Temperature",
        topic: "temperature",
        least_hz: 0.1,
        channels: &[("temperature", "degC")],
        units: &[],
        essential: false,
        doc: "temperatures of the robot's parts",
    },
];

/// Returns the norm of a parameter; `None` if there is no such parameter.
pub fn norm(parameter: &str) -> Option<&'static Norm> {
    PROFILE.iter().find(|norm| norm.parameter == parameter)
}

/// Returns the norm that applies to topics of this type.
pub fn norm_of_type(type_name: &str) -> Option<&'static Norm> {
    PROFILE.iter().find(|norm| norm.type_name == type_name)
}
