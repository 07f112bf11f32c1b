//! The sources of an aligner, and their columns.

use super::super::error::AlignError;
use super::super::row::{Column, Validity};
use super::super::segment::Segment;
use super::super::settings::SourceId;
use super::super::source::Source;
use super::super::watermark::Presence;
use super::{Aligner, NEVER};

impl Aligner {
    #[inline]
    pub(super) fn place(&self, id: SourceId) -> Result<usize, AlignError> {
        let place = id.place as usize;
        match self.sources.get(place) {
            Some(Some(source)) if source.id == id && source.is_here() => Ok(place),
            _ => Err(AlignError::Unknown),
        }
    }

    #[inline]
    pub(super) fn channels(&self, place: usize) -> usize {
        self.sources[place].as_ref().map_or(1, |source| source.channels)
    }

    /// Removes the sources that left before `row`.
    pub(super) fn let_go(&mut self, row: i64) {
        let is_over = |source: &Source| {
            source.watermark.presence == Presence::Left && source.watermark.newest < row
        };
        for slot in &mut self.sources {
            if slot.as_ref().is_some_and(is_over) {
                *slot = None;
                self.leaving -= 1;
            }
        }
        self.arrange();
    }

    /// Assigns columns to the sources after one has joined or left.
    pub(super) fn arrange(&mut self) {
        self.cells.columns.clear();
        let mut begin = 0;
        for source in self.sources.iter_mut().flatten() {
            let end = begin + source.channels;
            source.segment = Segment::NOWHERE;
            (source.column, source.first_value) = (self.cells.columns.len(), begin);
            self.cells.columns.push(Column {
                source: source.id,
                begin,
                end,
                newest: None,
                validity: Validity::Missing,
                is_pending: false,
            });
            begin = end;
        }
        self.cells.values.clear();
        self.cells.values.resize(begin, f64::NAN);
        self.cells.values.shrink_to_fit();
        let patience = |source: &Source| source.watermark.patience_nanos();
        self.patience_nanos = self.sources.iter().flatten().map(patience).max().unwrap_or(0);
        self.find_silence();
        self.settled = 0;
    }

    pub(super) fn find_silence(&mut self) {
        let silent_from = |source: &Source| source.watermark.silent_from();
        let earliest = self.sources.iter().flatten().filter_map(silent_from).min();
        self.silence_due = earliest.filter(|_| self.now.is_some()).unwrap_or(NEVER);
    }
}
