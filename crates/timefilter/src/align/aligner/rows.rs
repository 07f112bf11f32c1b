//! When an aligner issues a row.

use super::super::row::{Cells, Output, Row, SourceEvent};
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
        if is_grid && row <= self.reach() {
            self.row_due = row;
        }
        !is_grid || (row <= self.reach() && self.now.is_some_and(|now| row <= now))
    }

    /// Whether no awaited sample can change a row.
    #[inline]
    pub(super) fn is_decided<F: FnMut(Output<'_>)>(&mut self, row: i64, out: &mut F) -> bool {
        let now = self.now.unwrap_or(i64::MIN);
        while !self.settle_sources(row) {
            if self.awaits(row, now, out) {
                return false;
            }
        }
        self.onto == RowTimes::Pivot || row <= self.newest || self.is_due_in_silence(row, now)
    }

    /// Decides the cells of the next sources, up to the first one that outstanding samples could change. Returns
    /// whether all are decided.
    fn settle_sources(&mut self, row: i64) -> bool {
        let mut unsettled = self.sources[self.settled..].iter_mut();
        let is_open = |source: &mut Option<Source>| {
            source.as_mut().is_some_and(|source| !source.decide(row, &mut self.cells))
        };
        let open = unsettled.position(is_open);
        self.settled = open.map_or(self.sources.len(), |open| self.settled + open);
        open.is_none()
    }

    /// Whether a row waits longer for the next source; if not, that source is behind.
    #[inline]
    fn awaits<F: FnMut(Output<'_>)>(&mut self, row: i64, now: i64, out: &mut F) -> bool {
        let Some(source) = &mut self.sources[self.settled] else { return false };
        let due = row.saturating_add(source.watermark.patience_nanos());
        if due > now {
            self.row_due = due;
            self.waits_for = Some((self.settled, row));
            return true;
        }
        source.watermark.presence = Presence::Behind;
        out(Output::Event(SourceEvent::Behind(source.id)));
        false
    }

    /// Whether a row that no source has reached is due anyway: after the longest time that a row waits for any source.
    #[cold]
    pub(super) fn is_due_in_silence(&mut self, row: i64, now: i64) -> bool {
        if row > self.reach() || !self.sources.iter().flatten().any(Source::is_here) {
            return false;
        }
        self.row_due = row.saturating_add(self.patience_nanos);
        self.row_due <= now
    }

    /// Computes the pending cells of a row, and those of the sources that are not settled.
    fn fill(&mut self, row: i64) {
        let is_available = self.mode == Mode::Available;
        for (place, source) in self.sources.iter_mut().enumerate() {
            if let Some(source) = source
                && (place >= self.settled || self.cells.columns[source.column].is_pending)
            {
                source.fill(row, is_available, &mut self.cells);
            }
        }
        self.cells.some_pending = false;
    }

    /// Issues a row.
    pub(super) fn give<F: FnMut(Output<'_>)>(&mut self, row: i64, out: &mut F) {
        if self.leaving > 0 {
            self.let_go(row);
        }
        if self.cells.some_pending || self.settled < self.sources.len() {
            self.fill(row);
        }
        self.rows += 1;
        self.last = Some(row);
        self.settled = 0;
        if let RowTimes::Grid { period_nanos } = self.onto {
            if self.mode == Mode::Reproducible {
                self.ordinary_after = row;
            }
            self.next = row.checked_add(period_nanos);
        }
        let Cells { columns, values, .. } = &self.cells;
        out(Output::Row(&Row { at: row, columns, values }));
    }
}
