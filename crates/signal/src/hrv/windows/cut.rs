//! The beats within a span.

use crate::intervals::Kind;

/// The longest time [s] between an end of a span and the nearest beat that counts as covered: the longest
/// plausible interval.
pub(super) const LONGEST_EDGE_SECS: f64 = 2.0;

/// The beats of a span, corrected.
pub(super) struct Cut {
    /// The share of the span that has intervals [0..1].
    pub(super) coverage: f64,
    /// The length of the span [s].
    pub(super) window_secs: f64,
    /// The end of each interval [s since the start of the span].
    pub(super) ends_secs: Vec<f64>,
    /// The intervals [ms]; NaN across holes, and where implausible.
    pub(super) intervals_ms: Vec<f64>,
    /// The intervals between beats as detected, at any length [ms]; NaN across holes.
    pub(super) uncorrected_ms: Vec<f64>,
    /// The number of beats as detected.
    pub(super) detected: usize,
    /// The kinds of the corrections.
    pub(super) corrections: Vec<Kind>,
}

impl Cut {
    /// The number of corrections of a kind.
    pub(super) fn count(&self, kind: Kind) -> f64 {
        self.corrections.iter().filter(|&&each| each == kind).count() as f64
    }

    /// The share of detected beats that were corrected [%]; 0 without beats.
    pub(super) fn corrected_percent(&self) -> f64 {
        100.0 * self.corrections.len() as f64 / self.detected.max(1) as f64
    }

    /// The ends [s] and lengths [ms] of the intervals that are not missing.
    pub(super) fn present(&self) -> (Vec<f64>, Vec<f64>) {
        let timed = self.ends_secs.iter().copied().zip(self.intervals_ms.iter().copied());
        timed.filter(|(_, interval_ms)| interval_ms.is_finite()).unzip()
    }
}
