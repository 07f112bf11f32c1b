//! When an aligner issues a row.

use super::super::row::{Output, Row, SourceEvent};
use super::super::settings::{Mode, RowTimes};
use super::super::source::Source;
use super::super::watermark::Presence;
use super::{Aligner, NEVER};

impl Aligner {
    pub(super) fn settle_anew<F: FnMut(Output<'_>)>(&mut self, out: &mut F) {
        self.settled = 0;
        self.settle(out);
    }

    /// Issues all rows that are due.
    #[inline]
    pub(super) fn settle<F: FnMut(Output<'_>)>(&mut self, out: &mut F) {
        self.waits_for = None;
        self.row_due = NEVER;
        while let Some(row) = self.next_row() {
            let is_due = match self.mode {
                Mode::Reproducible => self.is_decided(row, out),
                Mode::Available => self.is_time(row),
            };
            if !is_due {
                return;
            }
            self.give(row, out);
        }
    }

    #[inline]
    pub(super) fn next_row(&self) -> Option<i64> {
        match self.onto {
            RowTimes::Grid { .. } => self.next,
            RowTimes::Pivot => {
                let pivot = self.pivot?;
                let source = self.sources[pivot.place as usize].as_ref()?;
                let place = self.last.map_or(0, |last| source.samples.place_after(last));
                if source.id == pivot { source.samples.time(place) } else { None }
            }
        }
    }

    /// Whether a row is due in available mode.
    #[inline]
    pub(super) fn is_time(&mut self, row: i64) -> bool {
        let is_grid = self.onto != RowTimes::Pivot;
        if is_grid && row <= self.reach {
            self.row_due = row;
        }
        !is_grid || (row <= self.reach && self.now.is_some_and(|now| row <= now))
    }

    /// Whether no awaited sample can change a row.
    #[inline]
    pub(super) fn is_decided<F: FnMut(Output<'_>)>(&mut self, row: i64, out: &mut F) -> bool {
        let now = self.now.unwrap_or(i64::MIN);
        while let Some(source) = self.sources.get_mut(self.settled) {
            if let Some(source) = source
                && source.could_change(row)
            {
                let due = row.saturating_add(source.watermark.patience_nanos());
                if due > now {
                    self.row_due = due;
                    self.waits_for = Some((self.settled, row));
                    return false;
                }
                source.watermark.presence = Presence::Behind;
                out(Output::Event(SourceEvent::Behind(source.id)));
            }
            self.settled += 1;
        }
        self.onto == RowTimes::Pivot || row <= self.newest || self.is_due_in_silence(row, now)
    }

    /// Whether a row that no source has reached is due anyway: as late as if a source were awaited.
    #[cold]
    pub(super) fn is_due_in_silence(&mut self, row: i64, now: i64) -> bool {
        if row > self.reach || !self.sources.iter().flatten().any(Source::is_here) {
            return false;
        }
        self.row_due = row.saturating_add(self.patience_nanos);
        self.row_due <= now
    }

    /// Issues a row.
    pub(super) fn give<F: FnMut(Output<'_>)>(&mut self, row: i64, out: &mut F) {
        if self.leaving > 0 {
            self.let_go(row);
        }
        let available = self.mode == Mode::Available;
        for (source, column) in self.sources.iter_mut().flatten().zip(&mut self.columns) {
            let values = &mut self.values[column.begin..column.end];
            (column.age_nanos, column.validity) = source.cell(row, available, values);
        }
        self.rows += 1;
        self.last = Some(row);
        self.settled = 0;
        if let RowTimes::Grid { period_nanos } = self.onto {
            self.next = row.checked_add(period_nanos);
        }
        out(Output::Row(&Row { at: row, columns: &self.columns, values: &self.values }));
    }
}
