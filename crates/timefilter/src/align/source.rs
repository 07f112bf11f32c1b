//! One source of an aligner.

use super::policy::Policy;
use super::row::{LeftOut, LeftOutReason, Output, Validity};
use super::samples::Samples;
use super::settings::{SourceId, SourceSettings};
use super::watermark::{Presence, Watermark};

/// The numbers of a source's samples by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All samples received.
    pub received: u64,
    /// Those that arrived after a row of their time or later was issued: [`super::LeftOutReason::Late`].
    pub late: u64,
    /// Those with a time of measurement after their arrival: [`super::LeftOutReason::Ahead`].
    pub ahead: u64,
    /// Those for which there was no room: [`super::LeftOutReason::Crowded`].
    pub crowded: u64,
    /// Those with only NaN values: they show that the source is alive, and are otherwise ignored.
    pub blank: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Source {
    pub id: SourceId,
    pub watermark: Watermark,
    pub policy: Policy,
    pub channels: usize,
    pub samples: Samples,
    /// Where cells are decided.
    decided: Decided,
    pub counts: Counts,
}

/// The time between the first two samples, once all samples up to the second have arrived.
#[derive(Clone, Copy, Debug)]
struct Decided {
    before: i64,
    after: i64,
    /// The first channel at the first of them, and its difference to the second.
    begin: f64,
    rise: f64,
}

impl Decided {
    const NOWHERE: Decided = Decided { before: i64::MAX, after: i64::MIN, begin: 0.0, rise: 0.0 };

    #[inline]
    fn has(&self, row: i64) -> bool {
        self.before < row && row < self.after
    }
}

impl Source {
    pub fn new(id: SourceId, settings: &SourceSettings, now: i64) -> Source {
        Source {
            id,
            watermark: Watermark::new(settings, now),
            policy: settings.policy,
            channels: settings.channels,
            samples: Samples::new(settings.channels, settings.capacity),
            decided: Decided::NOWHERE,
            counts: Counts::default(),
        }
    }

    /// Whether outstanding samples could change the cell at `row`. No earlier row will follow.
    #[inline]
    pub fn could_change(&mut self, row: i64) -> bool {
        if self.decided.has(row) || self.watermark.presence != Presence::Awaited {
            return false;
        }
        let complete_until = self.watermark.complete_until;
        complete_until < row || {
            self.forget_before(row);
            // Usually both neighbours have arrived, and no policy needs more.
            match (self.samples.time(0), self.samples.time(1)) {
                (Some(before), Some(after)) if after <= complete_until => {
                    let (begin, end) = (self.samples.values(0)[0], self.samples.values(1)[0]);
                    self.decided = Decided { before, after, begin, rise: end - begin };
                    false
                }
                _ => complete_until < self.decided_by(row),
            }
        }
    }

    /// The time until which samples affect the cell at `row`: while the watermark is before it, more data
    /// are needed (the third of \psi's interpolation results: created, does not exist, insufficient data).
    #[inline]
    fn decided_by(&self, row: i64) -> i64 {
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

    /// The times of the last sample at or before `row` and of the first after it. Requires that
    /// [`Source::forget_before`] was called for the row, and no window.
    #[inline]
    fn neighbours(&self, row: i64) -> (Option<i64>, Option<i64>) {
        match self.samples.time(0) {
            Some(first) if first <= row => (Some(first), self.samples.time(1)),
            first => (None, first),
        }
    }

    /// Drops samples that no row from `row` on needs. The last sample before it is always kept.
    #[inline]
    pub fn forget_before(&mut self, row: i64) {
        self.decided = Decided::NOWHERE;
        match self.policy {
            Policy::Window { length_nanos, .. } => {
                let before_window = row.saturating_sub(length_nanos);
                while self.samples.time(1).is_some_and(|second| second <= row)
                    && self.samples.time(0).is_some_and(|oldest| oldest <= before_window)
                {
                    self.samples.forget_oldest();
                }
            }
            _ => {
                while self.samples.time(1).is_some_and(|second| second <= row) {
                    self.samples.forget_oldest();
                }
            }
        }
    }

    /// Buffers a sample for rows after `last`, unless it is blank or not needed; at capacity it replaces
    /// the oldest.
    #[inline]
    pub fn keep<F>(&mut self, measured: i64, values: &[f64], last: Option<i64>, out: &mut F)
    where
        F: FnMut(Output<'_>),
    {
        if values.iter().all(|value| value.is_nan()) {
            self.counts.blank += 1;
            return;
        }
        if last.is_some_and(|last| measured <= last && !self.is_of_use_after(last, measured)) {
            return;
        }
        if measured <= self.decided.after {
            self.decided = Decided::NOWHERE;
        }
        if self.samples.is_full() {
            self.decided = Decided::NOWHERE;
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
fn distance(time: Option<i64>, row: i64) -> i64 {
    time.map_or(i64::MAX, |time| i64::try_from(time.abs_diff(row)).unwrap_or(i64::MAX))
}

/// Computes cells from a source's samples.
impl Source {
    /// Writes the values at `row`; returns their age [ns] and validity.
    #[inline]
    pub fn cell(&mut self, row: i64, available: bool, values: &mut [f64]) -> (i64, Validity) {
        if self.decided.has(row)
            && let Policy::Linear { max_gap_nanos } = self.policy
            && let [value] = values
        {
            let Decided { before, after, begin, rise } = self.decided;
            let gap_nanos = after.saturating_sub(before);
            if gap_nanos <= max_gap_nanos {
                let share = (row - before) as f64 / gap_nanos as f64;
                *value = begin + share * rise;
                return (row.saturating_sub(after), Validity::Fresh);
            }
        }
        self.any_cell(row, available, values)
    }

    /// The same for any policy, number of channels and place.
    fn any_cell(&mut self, row: i64, available: bool, values: &mut [f64]) -> (i64, Validity) {
        self.forget_before(row);
        match self.policy {
            Policy::Linear { max_gap_nanos } => self.linear(row, max_gap_nanos, available, values),
            Policy::Hold { max_age_nanos } => self.hold(row, max_age_nanos, available, values),
            Policy::Exact => self.nearest(row, 0, available, values),
            Policy::Nearest { tolerance_nanos } => {
                self.nearest(row, tolerance_nanos, available, values)
            }
            Policy::Window { length_nanos, aggregate } => {
                let window = super::window::Window { row, length_nanos, aggregate };
                self.window(&window, available, values)
            }
        }
    }

    #[inline]
    fn linear(
        &self,
        row: i64,
        max_gap_nanos: i64,
        available: bool,
        values: &mut [f64],
    ) -> (i64, Validity) {
        match self.neighbours(row) {
            (Some(before), _) if before == row => {
                values.copy_from_slice(self.samples.values(0));
                (0, Validity::Fresh)
            }
            (Some(before), Some(after)) => {
                self.between(row, (before, after), max_gap_nanos, values)
            }
            (Some(before), None) if self.is_complete(row) => {
                absent(values, row.saturating_sub(before), Validity::Gap)
            }
            (Some(_), None) => self.last(row, max_gap_nanos, available, values),
            (None, _) => self.none(row, available, values),
        }
    }

    /// The values between the first two samples, whose times are given.
    #[inline]
    fn between(
        &self,
        row: i64,
        (before, after): (i64, i64),
        max_gap_nanos: i64,
        values: &mut [f64],
    ) -> (i64, Validity) {
        let gap_nanos = after.saturating_sub(before);
        if gap_nanos > max_gap_nanos {
            return absent(values, row.saturating_sub(before), Validity::Gap);
        }
        let share = (row - before) as f64 / gap_nanos as f64;
        let ends = self.samples.values(0).iter().zip(self.samples.values(1));
        for (value, (begin, end)) in values.iter_mut().zip(ends) {
            *value = begin + share * (end - begin);
        }
        (row.saturating_sub(after), Validity::Fresh)
    }

    #[inline]
    fn hold(
        &self,
        row: i64,
        max_age_nanos: i64,
        available: bool,
        values: &mut [f64],
    ) -> (i64, Validity) {
        match self.neighbours(row).0 {
            None => self.none(row, available, values),
            Some(before) if before == row => {
                values.copy_from_slice(self.samples.values(0));
                (0, Validity::Fresh)
            }
            Some(before) if self.is_complete(row) => {
                values.copy_from_slice(self.samples.values(0));
                let age_nanos = row.saturating_sub(before);
                let held = age_nanos <= max_age_nanos;
                (age_nanos, if held { Validity::Held } else { Validity::Stale })
            }
            Some(_) => self.last(row, max_age_nanos, available, values),
        }
    }

    fn nearest(
        &self,
        row: i64,
        tolerance_nanos: i64,
        available: bool,
        values: &mut [f64],
    ) -> (i64, Validity) {
        let (before, after) = self.neighbours(row);
        let (earlier, later) = (distance(before, row), distance(after, row));
        if earlier.min(later) > tolerance_nanos {
            return self.none(row, available, values);
        }
        let place = usize::from(later < earlier && before.is_some());
        values.copy_from_slice(self.samples.values(place));
        (if later < earlier { -later } else { earlier }, Validity::Fresh)
    }

    /// The last value, while later samples are still possible: held up to its maximum age, then stale; late
    /// or stale if the row did not wait.
    fn last(
        &self,
        row: i64,
        max_nanos: i64,
        available: bool,
        values: &mut [f64],
    ) -> (i64, Validity) {
        let Some(before) = self.neighbours(row).0 else {
            return absent(values, i64::MAX, self.unawaited());
        };
        values.copy_from_slice(self.samples.values(0));
        let age_nanos = row.saturating_sub(before);
        let validity = match self.unawaited() {
            Validity::Late if available && age_nanos <= max_nanos => Validity::Held,
            Validity::Late if available => Validity::Stale,
            other => other,
        };
        (age_nanos, validity)
    }

    /// No value if that is certain, otherwise the last one.
    pub(super) fn none(&self, row: i64, available: bool, values: &mut [f64]) -> (i64, Validity) {
        let before = self.last_until(row);
        let age_nanos = before.map_or(i64::MAX, |(_, before)| row.saturating_sub(before));
        let awaited = matches!(self.watermark.presence, Presence::Awaited | Presence::Behind);
        let sure = self.is_complete(row) || (available && awaited);
        match (before, self.unawaited()) {
            _ if sure => absent(values, age_nanos, Validity::Missing),
            (None, Validity::Late) => absent(values, age_nanos, Validity::Late),
            (None, _) => absent(values, age_nanos, Validity::Missing),
            (Some((place, _)), validity) => {
                values.copy_from_slice(self.samples.values(place));
                (age_nanos, validity)
            }
        }
    }

    /// The index and the time of the last sample at or before `row`.
    fn last_until(&self, row: i64) -> Option<(usize, i64)> {
        let until = |&place: &usize| self.samples.time(place).is_some_and(|time| time <= row);
        let place = (0..self.samples.len()).take_while(until).last()?;
        Some((place, self.samples.time(place)?))
    }

    /// The validity of a value for which the row did not wait.
    pub(super) fn unawaited(&self) -> Validity {
        match self.watermark.presence {
            Presence::Awaited | Presence::Behind => Validity::Late,
            Presence::Silent | Presence::Ended | Presence::Left => Validity::Stale,
        }
    }
}

/// Fills the cell with NaN.
pub(super) fn absent(values: &mut [f64], age_nanos: i64, validity: Validity) -> (i64, Validity) {
    values.fill(f64::NAN);
    (age_nanos, validity)
}
