//! Converts incoming samples into a gap-free signal near 250 Hz.

use crate::gaps::is_usable;

/// Rates above twice this are averaged down towards it [Hz].
const WORKING_RATE_HZ: f64 = 250.0;
/// After a gap longer than this the signal may have moved to another level [s].
const SHORT_GAP_SECS: f64 = 0.02;

/// Bridges gaps by holding the last value, removes the jump after long ones, so that it does not look like a
/// beat, and averages groups of samples.
#[derive(Clone, Debug)]
pub(super) struct Intake {
    group: usize,
    short_gap: u64,
    held: Option<f64>,
    missing: u64,
    offset: f64,
    sum: f64,
    in_group: usize,
}

/// The result of a sample.
pub(super) struct Taken {
    /// The sample without gaps.
    pub(super) sample: f64,
    /// The mean of the group that it completes, if any.
    pub(super) mean: Option<f64>,
    /// Whether it is the first one after a long gap.
    pub(super) resumed: bool,
}

impl Intake {
    pub(super) fn new(rate_hz: f64) -> Intake {
        let group = (rate_hz / WORKING_RATE_HZ).floor().max(1.0) as usize;
        let short_gap = (rate_hz * SHORT_GAP_SECS) as u64;
        Intake { group, short_gap, held: None, missing: 0, offset: 0.0, sum: 0.0, in_group: 0 }
    }

    /// The number of samples averaged into one at the working rate.
    pub(super) fn group(&self) -> usize {
        self.group
    }

    pub(super) fn push(&mut self, sample: f64) -> Taken {
        let resumed = is_usable(sample) && self.held.is_some() && self.missing > self.short_gap;
        if resumed {
            self.offset = self.held.unwrap_or(sample) - sample;
        }
        if is_usable(sample) {
            self.held = Some(sample + self.offset);
            self.missing = 0;
        } else {
            self.missing = self.missing.saturating_add(1);
        }
        let sample = self.held.unwrap_or(0.0);
        Taken { sample, mean: self.mean_with(sample), resumed }
    }

    fn mean_with(&mut self, sample: f64) -> Option<f64> {
        self.sum += sample;
        self.in_group += 1;
        if self.in_group < self.group {
            return None;
        }
        let mean = self.sum / self.group as f64;
        (self.sum, self.in_group) = (0.0, 0);
        Some(mean)
    }
}
