//! The output of an aligner.

use super::settings::SourceId;

/// An output of an aligner; outputs come in order of time.
#[derive(Clone, Copy, Debug)]
pub enum Output<'a> {
    /// The values of all sources at one time.
    Row(&'a Row<'a>),
    /// A sample that rows left out.
    LeftOut(LeftOut<'a>),
    /// A source fell silent, fell behind or came back.
    Event(SourceEvent),
}

/// The values of all sources at one time. Rows come in order of strictly increasing time.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// The time [ns since the Unix epoch].
    pub at: i64,
    pub(super) columns: &'a [Column],
    pub(super) values: &'a [f64],
}

impl<'a> Row<'a> {
    /// The cells of all sources, always in the same order; a source that joins takes the place of one that
    /// left, or the last place.
    #[inline]
    pub fn cells(&self) -> impl ExactSizeIterator<Item = (SourceId, Cell<'a>)> + use<'a> {
        let Row { at, columns, values } = *self;
        columns.iter().map(move |column| (column.source, column.cell(at, values)))
    }

    /// The cell of one source; `None` if the source has left or does not exist.
    pub fn cell(&self, source: SourceId) -> Option<Cell<'a>> {
        let column = self.columns.iter().find(|column| column.source == source)?;
        Some(column.cell(self.at, self.values))
    }
}

/// The value of one source at the time of its row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell<'a> {
    /// The values, one per channel; all NaN if there is no value, as always when the validity is [`Validity::Gap`] or
    /// [`Validity::Missing`].
    pub values: &'a [f64],
    /// The row's time minus that of the newest sample used for the values [ns]: negative if that sample was measured
    /// later, as with `linear` and `nearest`. Without values, the time since the last sample at or before the row was
    /// measured; `i64::MAX` if there never was one.
    pub age_nanos: i64,
    /// How reliable the values are.
    pub validity: Validity,
}

/// How reliable the values of a cell are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Validity {
    /// As the policy requires: measured at that time (`exact`, `hold`), within the tolerance (`nearest`),
    /// between neighbours that are close enough (`linear`), or from a window whose samples are complete.
    Fresh,
    /// The last value, not older than its maximum age (`hold`). In available mode also for `linear`, not
    /// older than the maximum gap: the next sample has not arrived yet.
    Held,
    /// The last value, older than its maximum age, or of any age because its source is silent.
    Stale,
    /// No value: the samples before and after are further apart than the maximum gap (`linear`), or its
    /// source has ended and there is no later sample.
    Gap,
    /// No value: there was no sample yet, or none at that time (`exact`), within the tolerance (`nearest`)
    /// or in the window.
    Missing,
    /// The last value, or none: the row no longer waited for this source, whose data arrive too late. Its
    /// samples for this row are reported as [`LeftOutReason::Late`] when they arrive.
    Late,
}

impl Validity {
    /// The validity as a word, for tables.
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

/// A sample that rows left out. Each is also counted: see [`super::Counts`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut<'a> {
    /// The source of the sample.
    pub source: SourceId,
    /// When the sample was measured [ns since the Unix epoch].
    pub measured: i64,
    /// The values, one per channel.
    pub values: &'a [f64],
    /// Why rows left it out.
    pub reason: LeftOutReason,
}

/// Why rows left a sample out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LeftOutReason {
    /// The sample was measured at or before the time of the newest row, but arrived after that row was issued. Later
    /// rows still use it where they can: it may be the last value, or in their window.
    Late,
    /// The sample's time of measurement is more than a second after its arrival ([`super::AHEAD_NANOS`]).
    Ahead,
    /// The sample was the oldest one when its source's capacity was exceeded while rows had to wait.
    Crowded,
}

/// A change in whether rows wait for a source. It depends on session time only, so a replay gives the same changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceEvent {
    /// The source was silent for its idle time-out; rows no longer wait for it.
    Silent(SourceId),
    /// The source delivers data too late; rows no longer wait for it.
    Behind(SourceId),
    /// Rows wait for the source again.
    Back(SourceId),
}

/// One source's part of the row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub source: SourceId,
    pub begin: usize,
    pub end: usize,
    pub newest: Option<i64>,
    pub validity: Validity,
    /// Whether the cell is computed only when the row is issued, as samples that arrive until then could change it.
    pub is_pending: bool,
}

/// The cells of the next row: a column for each present source, in their order, and all their values.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    pub columns: Vec<Column>,
    pub values: Vec<f64>,
    /// Whether any column is pending.
    pub some_pending: bool,
}

impl Cells {
    /// Postpones a column: its cell is computed only when the row is issued.
    pub fn postpone(&mut self, column: usize) {
        self.columns[column].is_pending = true;
        self.some_pending = true;
    }
}

/// Where the values of a cell come from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// The time of the newest sample used; without values, that of the last sample at or before the row.
    pub newest: Option<i64>,
    pub validity: Validity,
}

impl Column {
    /// Sets where the values of the cell come from.
    #[inline]
    pub fn set(&mut self, origin: Origin) {
        (self.newest, self.validity) = (origin.newest, origin.validity);
        self.is_pending = false;
    }

    #[inline]
    fn cell<'a>(&self, row: i64, values: &'a [f64]) -> Cell<'a> {
        Cell {
            values: &values[self.begin..self.end],
            age_nanos: self.newest.map_or(i64::MAX, |newest| row.saturating_sub(newest)),
            validity: self.validity,
        }
    }
}
