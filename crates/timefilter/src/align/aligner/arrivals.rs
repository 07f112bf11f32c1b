//! How an aligner receives samples.

use super::super::row::{LeftOut, LeftOutReason, Output, SourceEvent};
use super::super::settings::{Mode, RowTimes, Sample, SourceId};
use super::super::watermark::Presence;
use super::{AHEAD_NANOS, Aligner, NEVER};

impl Aligner {
    /// Takes an ordinary sample on a fast path: one in order and in time, with numbers, onto a grid in reproducible
    /// mode, while nothing else is due, from a source that rows wait for and that has room. Returns whether the next
    /// row may be ready, or `None` for any other sample, which is not taken; [`Aligner::push_any`] takes every sample,
    /// with the same result for ordinary ones.
    #[inline]
    pub(super) fn take_ordinary(&mut self, id: SourceId, sample: &Sample<'_>) -> Option<bool> {
        let Sample { measured, arrival, values } = *sample;
        let now = self.now?.max(arrival);
        let latest = now.min(self.reach());
        let source = self.sources.get_mut(id.place as usize)?.as_mut()?;
        let is_ordinary = source.id.serial == id.serial
            && source.channels == values.len()
            && arrival < self.row_due.min(self.silence_due)
            && self.ordinary_after < measured
            && measured <= latest
            && source.watermark.expects(measured)
            && source.samples.has_room()
            && values.iter().any(|value| !value.is_nan());
        if !is_ordinary {
            return None;
        }
        source.counts.received += 1;
        source.watermark.hear(measured, now);
        source.samples.append(measured, values);
        self.now = Some(now);
        self.newest = self.newest.max(measured);
        let complete_until = source.watermark.complete_until;
        let (place, awaited) = (id.place as usize, self.waits_for);
        Some(awaited.is_none_or(|(awaited, row)| awaited == place && complete_until >= row))
    }

    /// Takes any sample at the current session time. Returns whether the next row may be ready.
    pub(super) fn take_any<F>(
        &mut self,
        place: usize,
        measured: i64,
        values: &[f64],
        out: &mut F,
    ) -> bool
    where
        F: FnMut(Output<'_>),
    {
        let now = self.now.unwrap_or(measured);
        let Some(source) = &mut self.sources[place] else { return false };
        source.counts.received += 1;
        if measured > now.saturating_add(AHEAD_NANOS) {
            source.counts.ahead += 1;
            let source = source.id;
            let reason = LeftOutReason::Ahead;
            out(Output::LeftOut(LeftOut { source, measured, values, reason }));
            return false;
        }
        if source.samples.is_full() {
            self.make_room(place, measured);
        }
        self.extend(measured, out);
        let is_pivot = self.is_pivot(place);
        let Some(source) = &mut self.sources[place] else { return false };
        let is_late = self.last.is_some_and(|last| measured <= last)
            && (is_pivot || self.mode == Mode::Reproducible);
        if is_late {
            source.counts.late += 1;
            let source = source.id;
            out(Output::LeftOut(LeftOut { source, measured, values, reason: LeftOutReason::Late }));
        }
        let is_back = source.watermark.hear(measured, now);
        source.keep(measured, values, self.last, out);
        if place < self.settled {
            self.cells.postpone(source.column);
        }
        if is_back {
            out(Output::Event(SourceEvent::Back(source.id)));
            self.find_silence();
        }
        let begins_rows = self.begin_rows(measured);
        if begins_rows || is_back || is_pivot {
            self.settled = 0;
            return true;
        }
        self.may_settle(place, out)
    }

    #[inline]
    pub(super) fn is_pivot(&self, place: usize) -> bool {
        self.pivot.is_some_and(|pivot| pivot.place as usize == place && self.place(pivot).is_ok())
    }

    /// Drops samples that no future row needs from a source at capacity.
    #[cold]
    pub(super) fn make_room(&mut self, place: usize, measured: i64) {
        let now = self.now.unwrap_or(measured);
        let oldest_row = match self.onto {
            RowTimes::Grid { .. } => self.last.and(self.next),
            RowTimes::Pivot => {
                let expected = now.saturating_sub(self.patience_nanos);
                Some(self.next_row().map_or(expected, |row| row.min(expected)))
            }
        };
        if let (Some(row), Some(source)) = (oldest_row, &mut self.sources[place]) {
            source.forget_before(row);
        }
    }

    /// Extends the time range for which a grid may issue rows; skips gaps in which no source delivered.
    #[inline]
    pub(super) fn extend<F: FnMut(Output<'_>)>(&mut self, measured: i64, out: &mut F) {
        let RowTimes::Grid { period_nanos } = self.onto else { return };
        if self.mode == Mode::Available {
            let now = self.now.unwrap_or(measured);
            if self.next.is_none_or(|next| next <= now) {
                self.skip_to(period_nanos, now.saturating_add(1));
            }
            self.newest = now;
            self.row_due = self.next.unwrap_or(NEVER);
        } else if measured > self.newest {
            if measured > self.reach() {
                self.cross_hole(period_nanos, measured, out);
            }
            self.newest = measured;
        }
    }

    /// The time up to which a grid may issue rows before another sample arrives.
    #[inline]
    pub(super) fn reach(&self) -> i64 {
        self.newest.saturating_add(self.silence_nanos)
    }

    /// Issues the rows before a gap and continues after it; before the first sample there is no gap.
    #[cold]
    pub(super) fn cross_hole<F>(&mut self, period_nanos: i64, measured: i64, out: &mut F)
    where
        F: FnMut(Output<'_>),
    {
        if self.newest == i64::MIN && self.next.is_none() {
            return;
        }
        while let Some(row) = self.next.filter(|&row| row <= self.reach()) {
            self.give(row, out);
        }
        self.skip_to(period_nanos, measured);
        self.waits_for = None;
        self.settled = 0;
    }

    /// Continues with the first row at or after a time; near the end of the range of times there is no such
    /// row.
    #[cold]
    pub(super) fn skip_to(&mut self, period_nanos: i64, time: i64) {
        let after = multiple_from(period_nanos, time);
        let Some(next) = self.next else {
            self.next = after.filter(|&row| self.last.is_none_or(|last| row > last));
            return;
        };
        let skipped_nanos = after.unwrap_or(i64::MAX).abs_diff(next.min(time));
        self.skipped += skipped_nanos / period_nanos as u64;
        self.next = after.map(|after| after.max(next));
    }

    /// While the first row of a reproducible grid has not been issued, moves it to no later than a sample, unless the
    /// sample came too late for rows to wait for it, or is too old to bound the number of rows. Returns whether the row
    /// was moved.
    #[inline]
    pub(super) fn begin_rows(&mut self, measured: i64) -> bool {
        self.last.is_none() && self.begin_earlier(measured)
    }

    #[cold]
    fn begin_earlier(&mut self, measured: i64) -> bool {
        let (RowTimes::Grid { period_nanos }, Mode::Reproducible) = (self.onto, self.mode) else {
            return false;
        };
        let waited_for = self.now.unwrap_or(measured).saturating_sub(self.patience_nanos);
        let earliest = waited_for.max(self.newest.saturating_sub(self.silence_nanos));
        let Some(row) = multiple_from(period_nanos, measured.max(earliest)) else { return false };
        let is_earlier = self.next.is_none_or(|next| row < next);
        if is_earlier {
            self.next = Some(row);
        }
        is_earlier
    }

    /// Whether the next row may be ready after a source has delivered.
    #[inline]
    pub(super) fn may_settle<F: FnMut(Output<'_>)>(&mut self, place: usize, out: &mut F) -> bool {
        let Some(source) = &self.sources[place] else { return false };
        if source.watermark.presence == Presence::Behind {
            return self.catch_up(place, out);
        }
        match self.waits_for {
            None => self.mode == Mode::Reproducible,
            Some((awaited, row)) => awaited == place && source.watermark.complete_until >= row,
        }
    }

    #[cold]
    pub(super) fn catch_up<F: FnMut(Output<'_>)>(&mut self, place: usize, out: &mut F) -> bool {
        let now = self.now.unwrap_or(i64::MIN);
        let Some(source) = &mut self.sources[place] else { return false };
        let is_back = source.watermark.catch_up(now);
        if is_back {
            out(Output::Event(SourceEvent::Back(source.id)));
            self.settled = 0;
        }
        is_back || self.waits_for.is_none()
    }
}

/// The first multiple of a period at or after a time.
#[inline]
fn multiple_from(period_nanos: i64, time: i64) -> Option<i64> {
    match time.rem_euclid(period_nanos) {
        0 => Some(time),
        since => time.checked_add(period_nanos - since),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::align::{Policy, SourceSettings};

    const GRID: RowTimes = RowTimes::Grid { period_nanos: 7 };
    const LINEAR: Policy = Policy::Linear { max_gap_nanos: 40 };

    proptest! {
        #[test]
        fn an_ordinary_sample_is_taken_as_any_other(
            samples in prop::collection::vec((0..3_usize, 0..9_i64, 0..20_i64, 0..30), 1..300),
            idle_nanos in 1..200_i64,
            capacity in 1..20_usize,
        ) {
            let mut quick = Aligner::new(GRID, Mode::Reproducible)?;
            let settings = SourceSettings { idle_nanos, capacity, ..SourceSettings::new(LINEAR) };
            let sources = [quick.add(settings)?, quick.add(settings)?, quick.add(settings)?];
            let mut thorough = quick.clone();
            let (mut outputs, mut expected) = (Vec::new(), Vec::new());
            let mut arrival = 0;
            for (source, step, delay, value) in samples {
                arrival += step;
                let values = [if value == 0 { f64::NAN } else { f64::from(value) }];
                let sample = Sample { measured: arrival - delay, arrival, values: &values };
                quick.push(sources[source], sample, |output| outputs.push(format!("{output:?}")))?;
                let mut out = |output: Output<'_>| expected.push(format!("{output:?}"));
                thorough.push_any(sources[source], sample, &mut out)?;
            }
            prop_assert_eq!(outputs, expected);
            prop_assert_eq!(sources.map(|id| quick.counts(id)), sources.map(|id| thorough.counts(id)));
        }
    }
}
