//! Decimation to the rate of breath detection.

use super::Breath;
use crate::gaps::is_usable;

/// Rates of at least twice this are averaged down to no less than it [Hz].
const WORKING_RATE_HZ: f64 = 25.0;

/// Averages whole groups of samples.
#[derive(Clone, Debug)]
pub(super) struct Grouping {
    group: usize,
    in_group: usize,
    usable: usize,
    sum: f64,
}

impl Grouping {
    pub(super) fn new(rate_hz: f64) -> Grouping {
        let group = (rate_hz / WORKING_RATE_HZ).floor().max(1.0) as usize;
        Grouping { group, in_group: 0, usable: 0, sum: 0.0 }
    }

    /// The number of samples averaged into one at the working rate.
    pub(super) fn length(&self) -> usize {
        self.group
    }

    /// Whether the next sample begins a group.
    pub(super) fn is_empty(&self) -> bool {
        self.in_group == 0
    }

    /// The (fractional) sample at which a group begins.
    pub(super) fn edge(&self, place: usize) -> f64 {
        place as f64 * self.group as f64 - 0.5
    }

    /// Converts an index at the working rate to a sample.
    pub(super) fn sample(&self, place: f64) -> f64 {
        place * self.group as f64 + (self.group as f64 - 1.0) / 2.0
    }

    /// Converts a sample to an index at the working rate.
    pub(super) fn place(&self, sample: f64) -> f64 {
        (sample - (self.group as f64 - 1.0) / 2.0) / self.group as f64
    }

    /// Converts a breath from samples to the working rate.
    pub(super) fn placed(&self, breath: &Breath) -> Breath {
        let [begin, peak, end] =
            [breath.begin, breath.peak, breath.end].map(|each| self.place(each));
        Breath { begin, peak, end, amplitude: breath.amplitude }
    }

    /// Converts a breath from the working rate to samples.
    pub(super) fn sampled(&self, breath: &Breath) -> Breath {
        let [begin, peak, end] =
            [breath.begin, breath.peak, breath.end].map(|each| self.sample(each));
        Breath { begin, peak, end, amplitude: breath.amplitude }
    }

    /// Takes in the next sample, and returns the mean of the usable samples of the group that it completes,
    /// NaN without any.
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
        (self.in_group, self.usable, self.sum) = (0, 0, 0.0);
        Some(mean)
    }

    /// The means of a whole signal.
    pub(super) fn all(mut self, signal: &[f64]) -> Vec<f64> {
        signal.iter().filter_map(|&sample| self.push(sample)).collect()
    }
}
