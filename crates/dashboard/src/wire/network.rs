//! The computers of the team and the buses that connect them.

use serde::Serialize;

/// Another computer, and its clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Computer {
    /// The host and process of the computer if they are announced, otherwise its node; unique for each participant.
    pub name: String,
    /// How the clock is known: by round-trip `probes`, by the `stamps` of received messages, or `unknown` so far.
    pub known_by: &'static str,
    /// The offset of the clock, positive if it is ahead of the session's [s].
    pub offset_secs: Option<f64>,
    /// The rate error of the clock, positive if it is fast [ppm].
    pub skew_ppm: Option<f64>,
    /// Half the width of the 95 % interval of the true time of a stamp [s].
    pub uncertainty_secs: Option<f64>,
    /// The shortest round trip of the last minute's probes [s].
    pub round_trip_secs: Option<f64>,
    /// The time since the clock last answered a probe [s].
    pub probe_age_secs: Option<f64>,
    /// The number of streams that the computer stamps.
    pub streams: u32,
}

/// A bus that carries streams.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Bus {
    /// The name of the bus: `ROS domain 0`.
    pub name: String,
    /// The name of our node on the bus.
    pub node: String,
    /// The number of other discovered participants: usually processes.
    pub participants: u32,
    /// The number of topics that these participants publish.
    pub topics: u32,
    /// The number of the session's streams on the bus.
    pub streams: u32,
    /// The rate of data received on the bus: messages, and samples of waves [1/s].
    pub rate_hz: f64,
    /// The number of samples lost before arrival, over the streams whose losses can be counted; `null` if there is no
    /// such stream.
    pub lost: Option<u64>,
    /// The number of streams on the bus that have no sequence numbers, so that their losses cannot be counted.
    pub uncounted: u32,
}
