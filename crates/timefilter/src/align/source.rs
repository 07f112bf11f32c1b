//! One source of an aligner.

use super::policy::Policy;
use super::row::{LeftOut, LeftOutReason, Output};
use super::samples::Samples;
use super::segment::Segment;
use super::settings::{SourceId, SourceSettings};
use super::watermark::{Presence, Watermark};

/// The numbers of a source's samples by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All samples received.
    pub received: u64,
    /// Samples that arrived after a row of their time or later was issued: [`super::LeftOutReason::Late`].
    pub late: u64,
    /// Samples with a time of measurement more than a second after their arrival: [`super::LeftOutReason::Ahead`].
    pub ahead: u64,
    /// Samples for which there was no room: [`super::LeftOutReason::Crowded`].
    pub crowded: u64,
    /// Samples with only NaN values: they show that the source is alive, and are otherwise ignored.
    pub blank: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Source {
    pub id: SourceId,
    pub watermark: Watermark,
    pub policy: Policy,
    pub channels: usize,
    pub samples: Samples,
    /// Whether each channel is held where others are interpolated; empty if none is.
    pub held: Vec<bool>,
    /// The indices of the source's column and of its first value in a row.
    pub column: usize,
    pub first_value: usize,
    /// The segment that contains the source's next cells.
    pub segment: Segment,
    pub counts: Counts,
}

impl Source {
    pub fn new(id: SourceId, settings: &SourceSettings, now: i64) -> Source {
        Source {
            id,
            watermark: Watermark::new(settings, now),
            policy: settings.policy,
            channels: settings.channels,
            samples: Samples::new(settings.channels, settings.capacity),
            held: Vec::new(),
            column: 0,
            first_value: 0,
            segment: Segment::NOWHERE,
            counts: Counts::default(),
        }
    }

    /// The time until which samples affect the cell at `row`: while the watermark is before it, more data
    /// are needed (the third of \psi's interpolation results: created, does not exist, insufficient data).
    #[inline]
    pub(super) fn decided_by(&self, row: i64) -> i64 {
        let (before, after) = self.neighbours(row);
        match self.policy {
            Policy::Exact | Policy::Hold { .. } | Policy::Window { .. } => row,
            Policy::Nearest { tolerance_nanos } => {
                let nearest = distance(before, row).min(distance(after, row));
                row.saturating_add(nearest.min(tolerance_nanos))
            }
            Policy::Linear { max_gap_nanos } => match before {
                None => row,
                Some(before) if before == row => row,
                Some(before) => {
                    let end_of_gap = before.saturating_add(max_gap_nanos).max(row);
                    after.map_or(end_of_gap, |after| after.min(end_of_gap))
                }
            },
        }
    }

    /// The times of the last sample at or before `row` and of the first after it. Requires a policy without a window,
    /// and that [`Source::forget_before`] was called for the row.
    #[inline]
    pub(super) fn neighbours(&self, row: i64) -> (Option<i64>, Option<i64>) {
        match self.samples.time(0) {
            Some(first) if first <= row => (Some(first), self.samples.time(1)),
            first => (None, first),
        }
    }

    /// Drops samples that no row from `row` on needs. The last sample before it is always kept.
    #[inline]
    pub fn forget_before(&mut self, row: i64) {
        self.segment = Segment::NOWHERE;
        match self.policy {
            Policy::Window { length_nanos, .. } => {
                let before_window = row.saturating_sub(length_nanos);
                while self.samples.time(1).is_some_and(|second| second <= row)
                    && self.samples.time(0).is_some_and(|oldest| oldest <= before_window)
                {
                    self.samples.forget_oldest();
                }
            }
            _ => self.samples.forget_before_last_until(row),
        }
    }

    /// Buffers a sample for rows after `last`, unless it is blank or not needed; at capacity it replaces
    /// the oldest.
    #[inline]
    pub fn keep<F>(&mut self, measured: i64, values: &[f64], last: Option<i64>, out: &mut F)
    where
        F: FnMut(Output<'_>),
    {
        self.segment = Segment::NOWHERE;
        if values.iter().all(|value| value.is_nan()) {
            self.counts.blank += 1;
            return;
        }
        if last.is_some_and(|last| measured <= last && !self.is_of_use_after(last, measured)) {
            return;
        }
        if self.samples.is_full() {
            self.counts.crowded += 1;
            let (source, reason) = (self.id, LeftOutReason::Crowded);
            let oldest = self.samples.time(0).unwrap_or(measured);
            if measured < oldest {
                return out(Output::LeftOut(LeftOut { source, measured, values, reason }));
            }
            let (measured, values) = (oldest, self.samples.values(0));
            out(Output::LeftOut(LeftOut { source, measured, values, reason }));
            self.samples.forget_oldest();
        }
        self.samples.insert(measured, values);
    }

    /// Whether a row after `row` may need a sample measured at this time.
    pub fn is_of_use_after(&self, row: i64, measured: i64) -> bool {
        match (self.policy, self.samples.time(0)) {
            (_, None) => true,
            (Policy::Window { length_nanos, .. }, _) => measured > row.saturating_sub(length_nanos),
            (_, Some(oldest)) => oldest > row || measured >= oldest,
        }
    }

    /// Whether the source may still deliver samples.
    #[inline]
    pub fn is_here(&self) -> bool {
        !matches!(self.watermark.presence, Presence::Ended | Presence::Left)
    }

    /// Whether all samples up to `row` have arrived.
    #[inline]
    pub fn is_complete(&self, row: i64) -> bool {
        self.watermark.complete_until >= row
    }
}

#[inline]
pub(super) fn distance(time: Option<i64>, row: i64) -> i64 {
    time.map_or(i64::MAX, |time| i64::try_from(time.abs_diff(row)).unwrap_or(i64::MAX))
}
