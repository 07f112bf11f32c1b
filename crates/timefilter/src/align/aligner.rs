//! The values of many sources at common times.

use super::error::AlignError;
use super::row::{Aside, Column, News, Output, Row, Validity, Why};
use super::settings::{MOST_SOURCES, Mode, Onto, Run, Sample, SourceId, SourceSettings, time};
use super::source::{Counts, Source};
use super::watermark::Presence;

/// How much later than its arrival a sample may claim to be measured [ns].
pub const AHEAD_NANOS: i64 = 1_000_000_000;
/// For how many periods rows of a grid go on when no source delivers: five minutes at 64 Hz.
pub const ROWS_IN_SILENCE: i64 = 19_200;

/// The values of many sources at common times: a view that throws nothing away.
///
/// A pure function of what it is given and in which order. Extra ticks, and the cutting of runs
/// into pieces that arrive at the same time, change nothing.
///
/// A row is given out when no sample that is still expected could change it: each source is
/// complete up to its watermark, which is its newest sample's time less its bounded lateness. A
/// source that says nothing for its idle time-out is not waited for; nor is one that has not come
/// as far as a row when its lateness and idle time-out have passed since the row's time. Both come
/// back by themselves: with the next sample, and when they have caught up.
#[derive(Clone, Debug)]
pub struct Aligner {
    onto: Onto,
    mode: Mode,
    sources: Vec<Option<Source>>,
    pivot: Option<SourceId>,
    serial: u32,
    /// A column for each source that is there, in their order, and the values of all.
    columns: Vec<Column>,
    values: Vec<f64>,
    /// The session's time; `None` before it begins.
    now: Option<i64>,
    /// The newest sample of all; `i64::MIN` without any.
    newest: i64,
    /// The next row of a grid.
    next: Option<i64>,
    /// The time of the newest row.
    last: Option<i64>,
    /// Up to when a grid may have rows before another sample comes.
    reach: i64,
    /// All sources before this place are complete for the next row, or are not waited for.
    settled: usize,
    /// Which source the next row waits for, and until when that must be complete at least.
    waits_for: Option<(usize, i64)>,
    /// When the next row is given out without more samples.
    row_due: i64,
    /// No source falls silent before.
    silence_due: i64,
    /// The longest time that a row waits for any source [ns].
    patience_nanos: i64,
    /// How many sources have left, and are still in the rows.
    leaving: usize,
    rows: u64,
    skipped: u64,
}

/// Never, as a time when something is due.
const NEVER: i64 = i64::MAX;

impl Aligner {
    /// An aligner without sources. The period of a grid is refused unless it is 1 ns to a day.
    pub fn new(onto: Onto, mode: Mode) -> Result<Aligner, AlignError> {
        if let Onto::Grid { period_nanos } = onto {
            time("grid's period", 1, period_nanos)?;
        }
        Ok(Aligner {
            onto,
            mode,
            sources: Vec::new(),
            pivot: None,
            serial: 0,
            columns: Vec::new(),
            values: Vec::new(),
            now: None,
            newest: i64::MIN,
            next: None,
            last: None,
            reach: i64::MIN,
            settled: 0,
            waits_for: None,
            row_due: NEVER,
            silence_due: NEVER,
            patience_nanos: 0,
            leaving: 0,
            rows: 0,
            skipped: 0,
        })
    }

    /// Adds a source, at any time; rows wait for its first sample up to its idle time-out.
    /// Refuses what is out of range, and more than [`MOST_SOURCES`](super::MOST_SOURCES) at once.
    pub fn add(&mut self, settings: SourceSettings) -> Result<SourceId, AlignError> {
        let settings = settings.checked()?;
        let free = self.sources.iter().position(Option::is_none);
        let place = free.unwrap_or(self.sources.len());
        if place >= MOST_SOURCES {
            return Err(AlignError::Crowded { most: MOST_SOURCES });
        }
        if place == self.sources.len() {
            self.sources.push(None);
        }
        let id = SourceId { place: place as u32, serial: self.serial };
        let mut source = Source::new(id, &settings, self.now.unwrap_or(i64::MIN));
        if self.onto == Onto::Pivot && self.serial == 0 {
            self.pivot = Some(id);
            source.policy = super::Policy::Exact;
        }
        self.serial = self.serial.wrapping_add(1);
        self.sources[place] = Some(source);
        self.arrange();
        Ok(id)
    }

    /// A source has ended: its samples are used up to the last, then it is gone from the rows.
    pub fn leave<F>(&mut self, source: SourceId, mut out: F) -> Result<(), AlignError>
    where
        F: FnMut(Output<'_>),
    {
        let place = self.place(source)?;
        if let Some(source) = &mut self.sources[place] {
            source.watermark.end(Presence::Left);
            self.leaving += 1;
        }
        self.settle_anew(&mut out);
        Ok(())
    }

    /// Takes a sample of a source.
    #[inline]
    pub fn push<F>(
        &mut self,
        source: SourceId,
        sample: Sample<'_>,
        mut out: F,
    ) -> Result<(), AlignError>
    where
        F: FnMut(Output<'_>),
    {
        let place = self.place(source)?;
        let expected = self.channels(place);
        if sample.values.len() != expected {
            return Err(AlignError::Channels { expected, got: sample.values.len() });
        }
        self.advance(sample.arrival, &mut out);
        self.take(place, sample.measured, sample.values, &mut out);
        Ok(())
    }

    /// Takes samples of a source that arrived at once: the same as each by itself, with the
    /// arrival of all.
    pub fn push_run<F>(
        &mut self,
        source: SourceId,
        run: Run<'_>,
        mut out: F,
    ) -> Result<(), AlignError>
    where
        F: FnMut(Output<'_>),
    {
        let place = self.place(source)?;
        let expected = self.channels(place);
        if !run.values.len().is_multiple_of(expected) {
            return Err(AlignError::Channels { expected, got: run.values.len() });
        }
        self.advance(run.arrival, &mut out);
        for (number, values) in run.values.chunks_exact(expected).enumerate() {
            let since_first = (number as f64 * run.period_nanos).round() as i64;
            self.take(place, run.measured.saturating_add(since_first), values, &mut out);
        }
        Ok(())
    }

    /// Time passes: it is `now` [ns of session time], and all that arrived before was pushed.
    pub fn tick<F: FnMut(Output<'_>)>(&mut self, now: i64, mut out: F) {
        self.advance(now, &mut out);
    }

    /// Nothing more will come: gives out the rows up to the newest sample. No source may say more.
    pub fn finish<F: FnMut(Output<'_>)>(&mut self, mut out: F) {
        for source in self.sources.iter_mut().flatten() {
            if source.is_here() {
                source.watermark.end(Presence::Ended);
            }
        }
        self.settle_anew(&mut out);
    }

    /// What has become of a source's samples so far; `None` when it is gone from the rows.
    pub fn counts(&self, source: SourceId) -> Option<Counts> {
        let present = self.sources.get(source.place as usize)?.as_ref()?;
        (present.id == source).then_some(present.counts)
    }

    /// How many rows were given out.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// How many rows of a grid were left out, because no source delivered.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The most memory that it takes with its present sources [B]: for each its capacity, rounded
    /// up to a power of two, times 8 B for each channel and 8 B for the time, and what is kept of a
    /// source and of a row.
    pub fn bytes_bound(&self) -> usize {
        let of_samples = |source: &Source| source.samples.bytes_bound() + 8 * source.channels;
        let of_source = size_of::<Option<Source>>() + size_of::<Column>();
        let samples: usize = self.sources.iter().flatten().map(of_samples).sum();
        // Vectors double when they grow.
        size_of::<Aligner>() + samples + 2 * of_source * self.sources.len().max(4)
    }
}

/// Sources.
impl Aligner {
    #[inline]
    fn place(&self, id: SourceId) -> Result<usize, AlignError> {
        let place = id.place as usize;
        match self.sources.get(place) {
            Some(Some(source)) if source.id == id && source.is_here() => Ok(place),
            _ => Err(AlignError::Unknown),
        }
    }

    #[inline]
    fn channels(&self, place: usize) -> usize {
        self.sources[place].as_ref().map_or(1, |source| source.channels)
    }

    /// Lets go of the sources that have left before `row`.
    fn let_go(&mut self, row: i64) {
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

    /// Gives each source its columns, after one has come or gone.
    fn arrange(&mut self) {
        self.columns.clear();
        let mut begin = 0;
        for source in self.sources.iter().flatten() {
            let end = begin + source.channels;
            let validity = Validity::Missing;
            self.columns.push(Column { source: source.id, begin, end, age_nanos: 0, validity });
            begin = end;
        }
        self.values.clear();
        self.values.resize(begin, f64::NAN);
        self.values.shrink_to_fit();
        let patience = |source: &Source| source.watermark.patience_nanos();
        self.patience_nanos = self.sources.iter().flatten().map(patience).max().unwrap_or(0);
        self.find_silence();
        self.settled = 0;
    }

    fn find_silence(&mut self) {
        let silent_from = |source: &Source| source.watermark.silent_from();
        let earliest = self.sources.iter().flatten().filter_map(silent_from).min();
        self.silence_due = earliest.filter(|_| self.now.is_some()).unwrap_or(NEVER);
    }
}

/// Time.
impl Aligner {
    /// Lets session time pass, and gives out what falls due, each thing at its own time.
    #[inline]
    fn advance<F: FnMut(Output<'_>)>(&mut self, now: i64, out: &mut F) {
        if let Some(before) = self.now {
            if self.row_due.min(self.silence_due) <= now {
                self.pass_until(now, out);
            }
            self.now = Some(now.max(before));
        } else {
            self.begin(now);
        }
    }

    #[cold]
    fn begin(&mut self, now: i64) {
        self.now = Some(now);
        for source in self.sources.iter_mut().flatten() {
            source.watermark.begin(now);
        }
        self.find_silence();
    }

    fn pass_until<F: FnMut(Output<'_>)>(&mut self, now: i64, out: &mut F) {
        loop {
            let due = self.row_due.min(self.silence_due);
            if due > now || due == NEVER {
                return;
            }
            self.now = self.now.max(Some(due));
            if self.silence_due <= due {
                self.fall_silent(due, out);
                self.settled = 0;
            }
            self.settle(out);
        }
    }

    fn fall_silent<F: FnMut(Output<'_>)>(&mut self, now: i64, out: &mut F) {
        for source in self.sources.iter_mut().flatten() {
            if source.watermark.silent_from().is_some_and(|from| from <= now) {
                source.watermark.fall_silent();
                out(Output::News(News::Silent(source.id)));
            }
        }
        self.find_silence();
    }
}

/// Samples.
impl Aligner {
    #[inline]
    fn take<F>(&mut self, place: usize, measured: i64, values: &[f64], out: &mut F)
    where
        F: FnMut(Output<'_>),
    {
        let now = self.now.unwrap_or(measured);
        let Some(source) = &mut self.sources[place] else { return };
        source.counts.received += 1;
        if measured > now.saturating_add(AHEAD_NANOS) {
            source.counts.ahead += 1;
            let source = source.id;
            return out(Output::Aside(Aside { source, measured, values, why: Why::Ahead }));
        }
        if source.samples.is_full() {
            self.make_room(place, measured);
        }
        self.extend(measured, out);
        let is_pivot = self.is_pivot(place);
        let Some(source) = &mut self.sources[place] else { return };
        let is_late = self.last.is_some_and(|last| measured <= last)
            && (is_pivot || self.mode == Mode::Reproducible);
        if is_late {
            source.counts.late += 1;
            let source = source.id;
            out(Output::Aside(Aside { source, measured, values, why: Why::Late }));
        }
        let is_back = source.watermark.hear(measured, now);
        source.keep(measured, values, self.last, out);
        if is_back {
            out(Output::News(News::Back(source.id)));
            self.find_silence();
        }
        let begins_anew = is_back || is_pivot || self.begin_rows(measured);
        if begins_anew {
            self.settle_anew(out);
        } else if self.may_settle(place, out) {
            self.settle(out);
        }
    }

    #[inline]
    fn is_pivot(&self, place: usize) -> bool {
        self.pivot.is_some_and(|pivot| pivot.place as usize == place && self.place(pivot).is_ok())
    }

    /// Forgets what no row to come needs of a source whose samples are at capacity.
    #[cold]
    fn make_room(&mut self, place: usize, measured: i64) {
        let now = self.now.unwrap_or(measured);
        let oldest_row = match self.onto {
            Onto::Grid { .. } => self.last.and(self.next),
            Onto::Pivot => {
                let expected = now.saturating_sub(self.patience_nanos);
                Some(self.next_row().map_or(expected, |row| row.min(expected)))
            }
        };
        if let (Some(row), Some(source)) = (oldest_row, &mut self.sources[place]) {
            source.forget_before(row);
        }
    }

    /// Moves the end of what a grid may have rows for; over a hole in which no source delivered.
    #[inline]
    fn extend<F: FnMut(Output<'_>)>(&mut self, measured: i64, out: &mut F) {
        let Onto::Grid { period_nanos } = self.onto else { return };
        let silence_nanos = period_nanos.saturating_mul(ROWS_IN_SILENCE);
        if self.mode == Mode::Available {
            let now = self.now.unwrap_or(measured);
            if self.next.is_none_or(|next| next <= now) {
                self.skip_to(period_nanos, now.saturating_add(1));
            }
            self.reach = now.saturating_add(silence_nanos);
            self.row_due = self.next.unwrap_or(NEVER);
        } else if measured > self.newest {
            if self.newest > i64::MIN && measured > self.reach {
                self.cross_hole(period_nanos, measured, out);
            }
            self.newest = measured;
            self.reach = measured.saturating_add(silence_nanos);
        }
    }

    #[cold]
    fn cross_hole<F>(&mut self, period_nanos: i64, measured: i64, out: &mut F)
    where
        F: FnMut(Output<'_>),
    {
        while let Some(row) = self.next.filter(|&row| row <= self.reach) {
            self.give(row, out);
        }
        self.skip_to(period_nanos, measured);
        self.waits_for = None;
    }

    #[cold]
    fn skip_to(&mut self, period_nanos: i64, time: i64) {
        let after = multiple_from(period_nanos, time);
        if let (Some(next), Some(after)) = (self.next, after) {
            self.skipped += after.abs_diff(next.min(after)) / period_nanos as u64;
        }
        self.next = self.next.max(after);
    }

    /// Before the first row of a reproducible grid: lets it be no later than a sample, unless that
    /// came too late for rows to wait for it. Says whether it did.
    #[inline]
    fn begin_rows(&mut self, measured: i64) -> bool {
        if self.last.is_some() || self.mode == Mode::Available {
            return false;
        }
        let Onto::Grid { period_nanos } = self.onto else { return false };
        let earliest = self.now.unwrap_or(measured).saturating_sub(self.patience_nanos);
        let Some(row) = multiple_from(period_nanos, measured.max(earliest)) else { return false };
        let is_earlier = self.next.is_none_or(|next| row < next);
        if is_earlier {
            self.next = Some(row);
        }
        is_earlier
    }

    /// Whether the next row may not have to wait any longer, after a source has delivered.
    #[inline]
    fn may_settle<F: FnMut(Output<'_>)>(&mut self, place: usize, out: &mut F) -> bool {
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
    fn catch_up<F: FnMut(Output<'_>)>(&mut self, place: usize, out: &mut F) -> bool {
        let now = self.now.unwrap_or(i64::MIN);
        let Some(source) = &mut self.sources[place] else { return false };
        let is_back = source.watermark.catch_up(now);
        if is_back {
            out(Output::News(News::Back(source.id)));
            self.settled = 0;
        }
        is_back || self.waits_for.is_none()
    }
}

/// The first whole multiple of a period at or after a time.
#[inline]
fn multiple_from(period_nanos: i64, time: i64) -> Option<i64> {
    match time.rem_euclid(period_nanos) {
        0 => Some(time),
        since => time.checked_add(period_nanos - since),
    }
}

/// Rows.
impl Aligner {
    fn settle_anew<F: FnMut(Output<'_>)>(&mut self, out: &mut F) {
        self.settled = 0;
        self.settle(out);
    }

    /// Gives out all rows that are due.
    #[inline]
    fn settle<F: FnMut(Output<'_>)>(&mut self, out: &mut F) {
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
    fn next_row(&self) -> Option<i64> {
        match self.onto {
            Onto::Grid { .. } => self.next,
            Onto::Pivot => {
                let pivot = self.pivot?;
                let source = self.sources[pivot.place as usize].as_ref()?;
                let times =
                    (0..source.samples.len()).filter_map(|place| source.samples.time(place));
                let mut rows = times.filter(|&time| self.last.is_none_or(|last| time > last));
                if source.id == pivot { rows.next() } else { None }
            }
        }
    }

    /// Whether it is time for a row in available mode.
    #[inline]
    fn is_time(&mut self, row: i64) -> bool {
        let is_grid = self.onto != Onto::Pivot;
        if is_grid && row <= self.reach {
            self.row_due = row;
        }
        !is_grid || (row <= self.reach && self.now.is_some_and(|now| row <= now))
    }

    /// Whether nothing that is waited for can change a row.
    #[inline]
    fn is_decided<F: FnMut(Output<'_>)>(&mut self, row: i64, out: &mut F) -> bool {
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
                out(Output::News(News::Behind(source.id)));
            }
            self.settled += 1;
        }
        self.onto == Onto::Pivot || row <= self.newest || self.is_due_in_silence(row, now)
    }

    /// Whether a row that no source has reached is given out all the same: as late as if one were
    /// waited for.
    #[cold]
    fn is_due_in_silence(&mut self, row: i64, now: i64) -> bool {
        if row > self.reach || !self.sources.iter().flatten().any(Source::is_here) {
            return false;
        }
        self.row_due = row.saturating_add(self.patience_nanos);
        self.row_due <= now
    }

    /// Gives out a row.
    fn give<F: FnMut(Output<'_>)>(&mut self, row: i64, out: &mut F) {
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
        if let Onto::Grid { period_nanos } = self.onto {
            self.next = row.checked_add(period_nanos);
        }
        out(Output::Row(&Row { at: row, columns: &self.columns, values: &self.values }));
    }
}
