//! The computers of the team and the buses that join them.

use serde::Serialize;

/// Another computer, and its clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Computer {
    /// Its host and process where they are announced, otherwise its node; different for each participant.
    pub name: String,
    /// How its clock is known: `probes` there and back, `stamps` of what arrives, or not yet: `unknown`.
    pub known_by: &'static str,
    /// How far its clock is ahead of the session's [s].
    pub offset_secs: Option<f64>,
    /// How much faster it runs [ppm].
    pub skew_ppm: Option<f64>,
    /// Half the interval that holds the true time of what it stamps with a probability of 95 % [s].
    pub uncertainty_secs: Option<f64>,
    /// The shortest way there and back of the last minute's probes [s].
    pub round_trip_secs: Option<f64>,
    /// Since its clock last answered a probe [s].
    pub probe_age_secs: Option<f64>,
    /// How many streams it stamps.
    pub streams: u32,
}

/// A bus on which streams come.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Bus {
    /// Its name: `ROS domain 0`.
    pub name: String,
    /// Our node there.
    pub node: String,
    /// The others that were discovered: processes, as a rule.
    pub participants: u32,
    /// Their topics.
    pub topics: u32,
    /// How many of the session's streams come on it.
    pub streams: u32,
    /// What comes on it: messages, and samples of waves [1/s].
    pub rate_hz: f64,
    /// What was lost on the way here, of the streams whose losses can be counted; `null` where there is none.
    pub lost: Option<u64>,
    /// How many of its streams number nothing, so that losses can't be counted.
    pub uncounted: u32,
}
