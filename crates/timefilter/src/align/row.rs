//! What an aligner gives out.

use super::settings::SourceId;

/// Something that an aligner gives out, in the order in which it happens.
#[derive(Clone, Copy, Debug)]
pub enum Output<'a> {
    /// The values of all sources at one time.
    Row(&'a Row<'a>),
    /// A sample that rows went without.
    Aside(Aside<'a>),
    /// A source came or went.
    News(News),
}

/// The values of all sources at one time. Rows come in order, no two at the same time.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// The time [ns since the Unix epoch].
    pub at: i64,
    pub(super) columns: &'a [Column],
    pub(super) values: &'a [f64],
}

impl<'a> Row<'a> {
    /// The cells of all sources, always in the same order; a source that joins takes the place of
    /// one that left, or the last.
    #[inline]
    pub fn cells(&self) -> impl ExactSizeIterator<Item = (SourceId, Cell<'a>)> + use<'a> {
        let values = self.values;
        self.columns.iter().map(move |column| (column.source, column.cell(values)))
    }

    /// The cell of one source; `None` if it is not there (any more).
    pub fn cell(&self, source: SourceId) -> Option<Cell<'a>> {
        let column = self.columns.iter().find(|column| column.source == source)?;
        Some(column.cell(self.values))
    }
}

/// The value of one source at the time of its row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell<'a> {
    /// The values, one a channel. All NaN where there is none: always when the validity is
    /// [`Validity::Gap`] or [`Validity::Missing`].
    pub values: &'a [f64],
    /// The row's time less that of the newest sample which the values come from [ns]: negative
    /// when that was measured later, as happens with `linear` and `nearest`. Without values, how
    /// long ago the last sample until then was measured; `i64::MAX` if there never was one.
    pub age_nanos: i64,
    /// What the values are worth.
    pub validity: Validity,
}

/// What the values of a cell are worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Validity {
    /// As the policy asks for: measured at that time (`exact`, `hold`), within the tolerance
    /// (`nearest`), between neighbours that are close enough (`linear`), or from a window whose
    /// samples are complete.
    Fresh,
    /// The last value, not older than its maximum age (`hold`). In available mode also `linear`,
    /// not older than the maximum gap: its next sample is not there yet.
    Held,
    /// The last value, older than its maximum age; or of whatever age, because its source is
    /// silent.
    Stale,
    /// No value: the samples before and after are further apart than the maximum gap (`linear`),
    /// or its source has ended and there is none after.
    Gap,
    /// No value: there was no sample yet; or none at that time (`exact`), within the tolerance
    /// (`nearest`), or in the window.
    Missing,
    /// The last value, or none: the row did not wait any longer for this source, which delivers,
    /// but too late. Its samples for this row are set aside as [`Why::Late`] when they come.
    Late,
}

impl Validity {
    /// In one word, as tables have it.
    pub fn word(self) -> &'static str {
        match self {
            Validity::Fresh => "fresh",
            Validity::Held => "held",
            Validity::Stale => "stale",
            Validity::Gap => "gap",
            Validity::Missing => "missing",
            Validity::Late => "late",
        }
    }
}

/// A sample that rows went without. Each is counted, too: see [`super::Counts`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aside<'a> {
    /// Whose it is.
    pub source: SourceId,
    /// When it was measured [ns since the Unix epoch].
    pub measured: i64,
    /// Its values, one a channel.
    pub values: &'a [f64],
    /// Why rows went without it.
    pub why: Why,
}

/// Why rows went without a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Why {
    /// It was measured at or before the time of the newest row, and came after that. Later rows
    /// still use it where they can: it may be the last value, or in their window.
    Late,
    /// It claims to be measured more than a second after its arrival ([`super::AHEAD_NANOS`]).
    Ahead,
    /// It was the oldest of more samples than its source's capacity, while rows had to wait.
    Crowded,
}

/// A source came or went. All by session time, so that a recording gives the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// It was silent for its idle time-out; rows do not wait for it any more.
    Silent(SourceId),
    /// It delivers, but so late that rows do not wait for it any more.
    Behind(SourceId),
    /// Rows wait for it again.
    Back(SourceId),
}

/// One source's part of the row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub source: SourceId,
    pub begin: usize,
    pub end: usize,
    pub age_nanos: i64,
    pub validity: Validity,
}

impl Column {
    #[inline]
    fn cell<'a>(&self, values: &'a [f64]) -> Cell<'a> {
        Cell {
            values: &values[self.begin..self.end],
            age_nanos: self.age_nanos,
            validity: self.validity,
        }
    }
}
