//! Time in a simulation.

use std::ops::Add;
use std::time::Duration;

/// A time in a simulation, in nanoseconds after its start; negative for a clock that is behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct SimTime(i64);

impl SimTime {
    /// The start of the simulation.
    pub const START: SimTime = SimTime(0);

    /// Returns the time `nanos` [ns] after the start.
    pub const fn from_nanos(nanos: i64) -> SimTime {
        SimTime(nanos)
    }

    /// The time after the start [ns].
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// The time after the start [s].
    pub fn secs(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// Returns the reading of a clock that is ahead by `secs` [s] at this time.
    #[must_use]
    pub fn ahead_by(self, secs: f64) -> SimTime {
        SimTime(self.0.saturating_add((secs * 1e9).round() as i64))
    }
}

impl Add<Duration> for SimTime {
    type Output = SimTime;

    fn add(self, later: Duration) -> SimTime {
        SimTime(self.0.saturating_add(i64::try_from(later.as_nanos()).unwrap_or(i64::MAX)))
    }
}
