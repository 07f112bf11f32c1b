//! What of the beats lies in a span.

use crate::intervals::Kind;

/// Up to this time [s] from an end of a span to the beat nearest to it, the next beat was not due:
/// the longest plausible interval.
pub(super) const LONGEST_EDGE_SECS: f64 = 2.0;

/// The beats of a span, corrected.
pub(super) struct Cut {
    /// The share of the span that has intervals [0..1].
    pub(super) coverage: f64,
    /// How long the span is [s].
    pub(super) window_secs: f64,
    /// When each interval ends [s since the span's beginning].
    pub(super) ends_secs: Vec<f64>,
    /// The intervals [ms]; NaN across holes, and where no heart has one.
    pub(super) intervals_ms: Vec<f64>,
    /// The intervals between the beats as they were detected, however long or short [ms]; NaN across holes.
    pub(super) uncorrected_ms: Vec<f64>,
    /// Beats as they were detected.
    pub(super) detected: usize,
    /// What was corrected.
    pub(super) corrections: Vec<Kind>,
}

impl Cut {
    /// How many beats of a kind were corrected.
    pub(super) fn count(&self, kind: Kind) -> f64 {
        self.corrections.iter().filter(|&&each| each == kind).count() as f64
    }

    /// Corrected beats in all detected ones [%]; 0 of none.
    pub(super) fn corrected_percent(&self) -> f64 {
        100.0 * self.corrections.len() as f64 / self.detected.max(1) as f64
    }

    /// Where there are intervals: when each ends [s], and how long it is [ms].
    pub(super) fn present(&self) -> (Vec<f64>, Vec<f64>) {
        let timed = self.ends_secs.iter().copied().zip(self.intervals_ms.iter().copied());
        timed.filter(|(_, interval_ms)| interval_ms.is_finite()).unzip()
    }
}
