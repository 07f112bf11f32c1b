//! The settings that all studies share.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clocks::ClockSettings;
use teampulse_core::commands::CommandSettings;
use teampulse_features::thresholds::Threshold;
use teampulse_ros::BusId;
use teampulse_sources::session::Phase;

/// The settings that all studies share; sources, sinks and workers have separate tables.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct General {
    /// The session as a whole.
    pub session: SessionSettings,
    /// The features to compute.
    pub features: FeatureSettings,
    /// Properties of the devices' clocks, by the device's name, as measured by `teampulse calibrate`.
    pub clocks: BTreeMap<String, ClockSettings>,
    /// The phases of the study, at set times or started manually; `baseline` is the reference.
    pub phases: Vec<Phase>,
    /// Limits for numbers of people, robots and the team, beyond which someone must attend.
    pub alerts: Vec<Threshold>,
    /// Who may command the session while it runs; by default only the terminal's keys.
    pub commands: CommandSettings,
    /// The commands that letters and digits of the terminal send instead of setting a marker named after the key:
    /// `b = "do nback start 2"`. Markers, such as `l = "mark robot lost"`, apply to the dashboard, too.
    pub keys: BTreeMap<String, String>,
    /// Whether the session is also shown in a browser, at <http://127.0.0.1:8742>; `[[sinks]]` of the type `dashboard`
    /// holds its settings.
    pub dashboard: Shown,
    /// The names of streams that are published on ROS while running; `*` stands for a part of a token. Nothing about a
    /// person is published unless it is named here.
    pub publish: Vec<teampulse_core::pattern::Pattern>,
}

/// Whether something is shown.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Shown(pub bool);

impl Default for Shown {
    fn default() -> Shown {
        Shown(true)
    }
}

/// The settings of the whole session.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SessionSettings {
    /// The name of the session; its bag is named `<name>_<UTC>`.
    pub name: String,
    /// The session's clock: `host`, or `/clock` to follow simulated time on ROS.
    pub clock: SessionClock,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`, of `/clock`, `/session/events` and the published streams; by
    /// default the domain of `ROS_DOMAIN_ID`, else 0.
    pub domain: Option<BusId>,
    /// A folder with the definitions of message types that no node on the network provides, in the layout in which a
    /// ROS workspace installs them: `<folder>/share/<package>/msg/<Type>.msg`.
    pub messages: Option<PathBuf>,
    /// Shows estimates of people's workload and arousal on the screen. An experimenter who sees them is no longer blind
    /// to them. Default: false; they are recorded in any case.
    pub show_estimates: bool,
}

impl Default for SessionSettings {
    fn default() -> SessionSettings {
        let (name, clock) = ("session".into(), SessionClock::Host);
        SessionSettings { name, clock, domain: None, messages: None, show_estimates: false }
    }
}

/// The clock of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum SessionClock {
    /// The host's clock.
    #[serde(rename = "host")]
    Host,
    /// Simulated time, as published on the ROS topic `/clock`.
    #[serde(rename = "/clock")]
    Simulated,
}

/// The features to compute. In addition to these settings, each feature has a separate table, such as
/// `[features.state]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FeatureSettings {
    /// The lengths of the sliding windows [s].
    pub windows_secs: Vec<f64>,
    /// The mains frequency to remove from an ECG [Hz]: 50 or 60. By default it is detected in the signal.
    pub mains_hz: Option<f64>,
    /// The families of features that are not computed; see `teampulse list features`.
    pub disable: Vec<String>,
}

impl Default for FeatureSettings {
    fn default() -> FeatureSettings {
        FeatureSettings { windows_secs: vec![30.0, 60.0], mains_hz: None, disable: Vec::new() }
    }
}
