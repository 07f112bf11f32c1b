//! A study's settings for the clocks of devices.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_timefilter::clock::Latency;

/// Properties of the clock of a kind of device: `[clocks.polar_h10]` in a study. For messages, the device is the last
/// token of the topic: `[clocks.imu]` for `/strap/imu`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ClockSettings {
    /// The shortest time from measuring to arrival [s], as `teampulse calibrate` measures it; by default the value in
    /// the table of known devices.
    pub latency_secs: Option<f64>,
    /// Half the width of the 95 % interval of that time [s].
    pub uncertainty_secs: Option<f64>,
    /// The time after which the device's counter wraps to zero [s].
    pub wraps_secs: Option<f64>,
    /// Latencies for links with a known connection interval: each applies once the session has recognised the interval
    /// from the arrivals.
    pub intervals: Vec<IntervalLatency>,
}

/// The latency of a device over links with one connection interval.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IntervalLatency {
    /// The time from one connection event to the next [s]; values from 0.0075 to 0.1 are recognised.
    pub interval_secs: f64,
    /// The shortest time from measuring to arrival [s].
    pub latency_secs: f64,
    /// Half the width of the 95 % interval of that time [s].
    pub uncertainty_secs: Option<f64>,
}

impl IntervalLatency {
    /// Whether this latency applies to links with this connection interval [s].
    pub fn is_of(&self, interval_secs: f64) -> bool {
        (self.interval_secs - interval_secs).abs() < SAME_INTERVAL_SECS
    }

    pub(super) fn latency(&self) -> Latency {
        Latency::new(self.latency_secs, self.uncertainty_secs.unwrap_or(CALIBRATED_SECS))
    }
}

/// The tolerance for connection intervals [s], which are multiples of 1.25 ms.
const SAME_INTERVAL_SECS: f64 = 0.000_6;

/// The default 95 % uncertainty of a latency [s].
const CALIBRATED_SECS: f64 = 0.005;

impl ClockSettings {
    /// The latency over links with this connection interval [s], or with an unknown interval; `None` if the study
    /// states none.
    pub fn latency_secs_at(&self, interval_secs: Option<f64>) -> Option<f64> {
        let of_interval = interval_secs
            .and_then(|secs| self.intervals.iter().find(|interval| interval.is_of(secs)));
        of_interval.map(|interval| interval.latency_secs).or(self.latency_secs)
    }

    pub(super) fn latency(&self) -> Option<Latency> {
        let uncertainty_secs = self.uncertainty_secs.unwrap_or(CALIBRATED_SECS);
        Some(Latency::new(self.latency_secs?, uncertainty_secs))
    }
}
