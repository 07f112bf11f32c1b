//! The computers of the team and the buses that connect them.

use serde::Serialize;

/// Another computer, and its clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Computer {
    /// Its host and process if they are announced, otherwise its node; unique for each participant.
    pub name: String,
    /// How its clock is known: by round-trip `probes`, by the `stamps` of received messages, or `unknown` so far.
    pub known_by: &'static str,
    /// The offset of its clock, positive when ahead of the session's [s].
    pub offset_secs: Option<f64>,
    /// The rate error of its clock, positive when fast [ppm].
    pub skew_ppm: Option<f64>,
    /// Half the width of the 95 % interval of the true time of its stamps [s].
    pub uncertainty_secs: Option<f64>,
    /// The shortest round trip of the last minute's probes [s].
    pub round_trip_secs: Option<f64>,
    /// The time since its clock last answered a probe [s].
    pub probe_age_secs: Option<f64>,
    /// The number of streams that it stamps.
    pub streams: u32,
}

/// A bus that carries streams.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Bus {
    /// Its name: `ROS domain 0`.
    pub name: String,
    /// Our node there.
    pub node: String,
    /// The number of other discovered participants: usually processes.
    pub participants: u32,
    /// The number of their topics.
    pub topics: u32,
    /// The number of the session's streams on it.
    pub streams: u32,
    /// The rate of data received on it: messages, and samples of waves [1/s].
    pub rate_hz: f64,
    /// The number of samples lost before arrival, over the streams whose losses can be counted; `null` if there are
    /// none.
    pub lost: Option<u64>,
    /// The number of its streams without sequence numbers, whose losses cannot be counted.
    pub uncounted: u32,
}
