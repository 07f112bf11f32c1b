//! How the cell of a source at a given time follows from its samples.

use super::policy::Policy;
use super::row::{Cells, Origin, Validity};
use super::segment::Segment;
use super::source::{Source, distance};
use super::watermark::Presence;
use super::window::Window;

/// Computes cells from a source's samples.
impl Source {
    /// Computes the cell at `row`, or postpones it if rows do not wait for the source. Returns false, and does neither,
    /// while outstanding samples could change the cell. No earlier row will follow.
    #[inline]
    pub fn decide(&mut self, row: i64, cells: &mut Cells) -> bool {
        if !self.segment.has(row) {
            if self.watermark.presence != Presence::Awaited {
                cells.postpone(self.column);
                return true;
            }
            if !self.is_complete(row) {
                return false;
            }
            self.forget_before(row);
            let Some(segment) = self.first_segment().filter(|segment| segment.has(row)) else {
                return self.decide_otherwise(row, cells);
            };
            self.segment = segment;
            let origin = Origin { newest: Some(segment.after), validity: Validity::Fresh };
            cells.columns[self.column].set(origin);
        }
        cells.values[self.first_value] = self.segment.at(row);
        true
    }

    /// The segment between the first two samples of one channel, once all samples up to the second have arrived.
    /// No policy needs more than these two, and usually both have.
    #[inline]
    fn first_segment(&self) -> Option<Segment> {
        let Policy::Linear { max_gap_nanos } = self.policy else { return None };
        if !self.held.is_empty() {
            return None;
        }
        let ends = self.samples.first_two_of_one_channel()?;
        if self.is_complete(ends[1].0) { Segment::between(ends, max_gap_nanos) } else { None }
    }

    /// Computes the cell at `row` under any policy, with any number of channels; returns false while outstanding
    /// samples could change it.
    fn decide_otherwise(&mut self, row: i64, cells: &mut Cells) -> bool {
        let is_decided = self.is_complete(self.decided_by(row));
        if is_decided {
            self.fill(row, false, cells);
        }
        is_decided
    }

    /// Computes the cell at `row` from the samples present.
    pub fn fill(&mut self, row: i64, available: bool, cells: &mut Cells) {
        self.forget_before(row);
        let column = &mut cells.columns[self.column];
        let values = &mut cells.values[column.begin..column.end];
        let origin = self.any_cell(row, available, values);
        column.set(origin);
    }

    fn any_cell(&self, row: i64, available: bool, values: &mut [f64]) -> Origin {
        match self.policy {
            Policy::Linear { max_gap_nanos } => self.linear(row, max_gap_nanos, available, values),
            Policy::Hold { max_age_nanos } => self.hold(row, max_age_nanos, available, values),
            Policy::Exact => self.nearest(row, 0, available, values),
            Policy::Nearest { tolerance_nanos } => {
                self.nearest(row, tolerance_nanos, available, values)
            }
            Policy::Window { length_nanos, aggregate } => {
                let window = Window { row, length_nanos, aggregate };
                self.window(&window, available, values)
            }
        }
    }

    #[inline]
    fn linear(&self, row: i64, max_gap_nanos: i64, available: bool, values: &mut [f64]) -> Origin {
        match self.neighbours(row) {
            (Some(before), _) if before == row => self.sample(0, Validity::Fresh, values),
            (Some(before), Some(after)) => {
                self.between(row, (before, after), max_gap_nanos, values)
            }
            (Some(before), None) if self.is_complete(row) => {
                absent(values, Some(before), Validity::Gap)
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
    ) -> Origin {
        let gap_nanos = after.saturating_sub(before);
        if gap_nanos > max_gap_nanos {
            return absent(values, Some(before), Validity::Gap);
        }
        let share = (row - before) as f64 / gap_nanos as f64;
        let ends = self.samples.values(0).iter().zip(self.samples.values(1));
        for (value, (begin, end)) in values.iter_mut().zip(ends) {
            *value = begin + share * (end - begin);
        }
        let held = self.held.iter().zip(self.samples.values(0)).zip(values);
        for ((_, begin), value) in held.filter(|((is_held, _), _)| **is_held) {
            *value = *begin;
        }
        Origin { newest: Some(after), validity: Validity::Fresh }
    }

    #[inline]
    fn hold(&self, row: i64, max_age_nanos: i64, available: bool, values: &mut [f64]) -> Origin {
        match self.neighbours(row).0 {
            None => self.none(row, available, values),
            Some(before) if before == row => self.sample(0, Validity::Fresh, values),
            Some(before) if self.is_complete(row) => {
                let is_held = row.saturating_sub(before) <= max_age_nanos;
                let validity = if is_held { Validity::Held } else { Validity::Stale };
                self.sample(0, validity, values)
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
    ) -> Origin {
        let (before, after) = self.neighbours(row);
        let (earlier, later) = (distance(before, row), distance(after, row));
        if earlier.min(later) > tolerance_nanos {
            return self.none(row, available, values);
        }
        let place = usize::from(later < earlier && before.is_some());
        self.sample(place, Validity::Fresh, values)
    }

    /// The cell with the last value, for which later samples are still possible: held up to the maximum age, then
    /// stale; late or stale if the row did not wait.
    fn last(&self, row: i64, max_nanos: i64, available: bool, values: &mut [f64]) -> Origin {
        let Some(before) = self.neighbours(row).0 else {
            return absent(values, None, self.unawaited());
        };
        let age_nanos = row.saturating_sub(before);
        let validity = match self.unawaited() {
            Validity::Late if available && age_nanos <= max_nanos => Validity::Held,
            Validity::Late if available => Validity::Stale,
            other => other,
        };
        self.sample(0, validity, values)
    }

    /// The cell of a row at which the policy found no sample: without a value if that is certain, otherwise with the
    /// last one.
    pub(super) fn none(&self, row: i64, available: bool, values: &mut [f64]) -> Origin {
        let before = self.last_until(row);
        let newest = before.and_then(|place| self.samples.time(place));
        let awaited = matches!(self.watermark.presence, Presence::Awaited | Presence::Behind);
        let sure = self.is_complete(row) || (available && awaited);
        match (before, self.unawaited()) {
            _ if sure => absent(values, newest, Validity::Missing),
            (None, Validity::Late) => absent(values, None, Validity::Late),
            (None, _) => absent(values, None, Validity::Missing),
            (Some(place), validity) => self.sample(place, validity, values),
        }
    }

    /// The index of the last sample at or before `row`.
    fn last_until(&self, row: i64) -> Option<usize> {
        let until = |&place: &usize| self.samples.time(place).is_some_and(|time| time <= row);
        (0..self.samples.len()).take_while(until).last()
    }

    /// The validity of a value that a row used without waiting for its source.
    pub(super) fn unawaited(&self) -> Validity {
        match self.watermark.presence {
            Presence::Awaited | Presence::Behind => Validity::Late,
            Presence::Silent | Presence::Ended | Presence::Left => Validity::Stale,
        }
    }

    /// The cell with the values of the sample at an index.
    #[inline]
    fn sample(&self, place: usize, validity: Validity, values: &mut [f64]) -> Origin {
        values.copy_from_slice(self.samples.values(place));
        Origin { newest: self.samples.time(place), validity }
    }
}

/// The cell without values.
pub(super) fn absent(values: &mut [f64], newest: Option<i64>, validity: Validity) -> Origin {
    values.fill(f64::NAN);
    Origin { newest, validity }
}
