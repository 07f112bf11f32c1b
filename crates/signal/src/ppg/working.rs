//! Resamples the incoming signal to near 100 Hz, which is enough for pulse waves.

use super::clean::checked_ppg_rate_hz;
use crate::error::SignalError;
use crate::gaps::is_usable;

/// Rates of twice this or more are averaged down towards it [Hz].
const WORKING_RATE_HZ: f64 = 100.0;

/// Averages the usable samples of whole groups.
#[derive(Clone, Debug)]
pub(super) struct Grouping {
    group: usize,
    rate_hz: f64,
    sum: f64,
    usable: usize,
    in_group: usize,
}

impl Grouping {
    /// Creates the grouping; returns an error for a rate outside 20 to 2000 Hz.
    pub(super) fn new(rate_hz: f64) -> Result<Grouping, SignalError> {
        let group = (checked_ppg_rate_hz(rate_hz)? / WORKING_RATE_HZ).floor().max(1.0);
        let rate_hz = rate_hz / group;
        Ok(Grouping { group: group as usize, rate_hz, sum: 0.0, usable: 0, in_group: 0 })
    }

    /// The number of samples averaged into one at the working rate.
    pub(super) fn group(&self) -> usize {
        self.group
    }

    /// The working rate [Hz].
    pub(super) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Takes in a sample; returns the mean of the group that it completes, NaN without a usable one.
    pub(super) fn push(&mut self, sample: f64) -> Option<f64> {
        if is_usable(sample) {
            self.sum += sample;
            self.usable += 1;
        }
        self.in_group += 1;
        if self.in_group < self.group {
            return None;
        }
        let mean = self.sum / self.usable as f64;
        (self.sum, self.usable, self.in_group) = (0.0, 0, 0);
        Some(mean)
    }
}

/// Bridges gaps by holding the last value, and removes the jump after them, so that it does not look like a
/// pulse.
#[derive(Clone, Debug, Default)]
pub(super) struct Bridge {
    held: Option<f64>,
    is_gap: bool,
    offset: f64,
}

impl Bridge {
    /// Takes in a value; returns the bridged value, or `None` until the first usable one.
    pub(super) fn push(&mut self, value: f64) -> Option<f64> {
        if !is_usable(value) {
            self.is_gap = true;
            return self.held;
        }
        if self.is_gap {
            self.offset = self.held.map_or(0.0, |held| held - value);
        }
        self.is_gap = false;
        self.held = Some(value + self.offset);
        self.held
    }
}
