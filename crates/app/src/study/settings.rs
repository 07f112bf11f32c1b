//! The settings that are common to all studies.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clocks::ClockSettings;
use teampulse_sources::session::Phase;

/// What is common to all studies; sources and sinks have tables of their own.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct General {
    /// The session as a whole.
    pub session: SessionSettings,
    /// What is computed.
    pub features: FeatureSettings,
    /// What is known of the devices' clocks, by the device's name; `teampulse calibrate` finds it.
    pub clocks: BTreeMap<String, ClockSettings>,
    /// The phases of the study, at set times or begun by hand; `baseline` is the reference.
    pub phases: Vec<Phase>,
    /// Streams that are published on ROS while running, by name; `*` stands for a part of a token.
    /// Nothing about a person is published unless it is named here.
    pub publish: Vec<teampulse_core::pattern::Pattern>,
}

/// The session as a whole.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SessionSettings {
    /// What the session is called; its bag is `<name>_<UTC>`.
    pub name: String,
    /// What the time is: `host`, or `/clock` to follow simulated time on ROS.
    pub clock: SessionClock,
    /// The ROS domain of `/clock`, `/session/events` and what is published; without it that of
    /// `ROS_DOMAIN_ID`, else 0.
    pub domain: Option<u32>,
    /// A folder with the definitions of types that nobody on the network can explain, as a ROS
    /// workspace installs them: `<folder>/share/<package>/msg/<Type>.msg`.
    pub messages: Option<PathBuf>,
    /// Shows estimates of people's workload and arousal on the screen. Whoever sees them in an
    /// experiment is no longer blind. Default: false; they are recorded all the same.
    pub show_estimates: bool,
}

impl Default for SessionSettings {
    fn default() -> SessionSettings {
        let (name, clock) = ("session".into(), SessionClock::Host);
        SessionSettings { name, clock, domain: None, messages: None, show_estimates: false }
    }
}

/// What the time of a session is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum SessionClock {
    /// The host's clock.
    #[serde(rename = "host")]
    Host,
    /// Simulated time, as it is told on the ROS topic `/clock`.
    #[serde(rename = "/clock")]
    Simulated,
}

/// What is computed. Beside these, each feature has a table of its own: `[features.state]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FeatureSettings {
    /// The lengths of the sliding windows [s].
    pub windows_secs: Vec<f64>,
    /// The frequency of the mains, whose hum is taken out of an ECG [Hz]: 50 or 60. Without it the one that
    /// is heard in the signal.
    pub mains_hz: Option<f64>,
    /// Families of features that are not computed; see `teampulse list features`.
    pub disable: Vec<String>,
}

impl Default for FeatureSettings {
    fn default() -> FeatureSettings {
        FeatureSettings { windows_secs: vec![30.0, 60.0], mains_hz: None, disable: Vec::new() }
    }
}
