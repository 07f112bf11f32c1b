//! The values of many sources at common times.

mod sources;
mod time;
mod arrivals;
mod rows;

use super::error::AlignError;
use super::row::{Cells, Column, Output};
use super::settings::{
    MOST_SOURCES, Mode, RowTimes, Run, Sample, SourceId, SourceSettings, time as checked,
};
use super::source::{Counts, Source};
use super::watermark::Presence;

/// How far a sample's time of measurement may be after its arrival [ns].
pub const AHEAD_NANOS: i64 = 1_000_000_000;
/// The number of grid periods for which rows continue when no source delivers: five minutes at 64 Hz.
pub const ROWS_IN_SILENCE: i64 = 19_200;

/// Aligns many sources to common times, and reports every sample that it leaves out.
///
/// The output depends only on the inputs and their order. Extra ticks, and splitting runs into parts with
/// the same arrival time, change nothing.
///
/// A row is issued when no outstanding sample could change it: each source is complete up to its watermark,
/// which is its newest sample's time less its bounded lateness. Rows do not wait for a source that has been
/// silent for its idle time-out, nor for one that has not reached a row when its lateness and idle time-out
/// have passed since the row's time. Both return automatically: with the next sample, and when they have
/// caught up.
///
/// The output is bounded for any input times: n samples give at most (n + 1) · ([`ROWS_IN_SILENCE`] + 1)
/// rows, and ticks give none beyond these. The cost of a row is linear in the number of sources and of
/// samples in its windows.
#[derive(Clone, Debug)]
pub struct Aligner {
    onto: RowTimes,
    mode: Mode,
    sources: Vec<Option<Source>>,
    pivot: Option<SourceId>,
    serial: u32,
    cells: Cells,
    /// The session time; `None` before it starts.
    now: Option<i64>,
    /// The time of the newest sample of any source, or in available mode the arrival time of the last one; `i64::MIN`
    /// before the first sample.
    newest: i64,
    /// The next row of a grid.
    next: Option<i64>,
    /// The time of the newest row.
    last: Option<i64>,
    /// The time after which samples may be ordinary: that of the newest row of a reproducible grid.
    ordinary_after: i64,
    /// [`ROWS_IN_SILENCE`] periods of a grid [ns].
    silence_nanos: i64,
    /// All sources before this index are complete for the next row, and their cells computed, or are not
    /// waited for.
    settled: usize,
    /// The source that the next row waits for, and the time up to which it must be complete.
    waits_for: Option<(usize, i64)>,
    /// When the next row is issued without further samples.
    row_due: i64,
    /// The earliest time at which a source can fall silent.
    silence_due: i64,
    /// The longest time that a row waits for any source [ns].
    patience_nanos: i64,
    /// The number of sources that have ended but are still in the rows.
    leaving: usize,
    rows: u64,
    skipped: u64,
}

/// A due time that is never reached.
const NEVER: i64 = i64::MAX;

impl Aligner {
    /// Creates an aligner without sources. The period of a grid must be 1 ns to a day.
    pub fn new(onto: RowTimes, mode: Mode) -> Result<Aligner, AlignError> {
        let mut silence_nanos = 0;
        if let RowTimes::Grid { period_nanos } = onto {
            checked("grid's period", 1, period_nanos)?;
            silence_nanos = period_nanos.saturating_mul(ROWS_IN_SILENCE);
        }
        Ok(Aligner {
            onto,
            mode,
            sources: Vec::new(),
            pivot: None,
            serial: 0,
            cells: Cells::default(),
            now: None,
            newest: i64::MIN,
            next: None,
            last: None,
            ordinary_after: NEVER,
            silence_nanos,
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

    /// Adds a source that is present from the start, before any time has passed; rows wait for its first
    /// sample up to its idle time-out. Fails for settings out of range, and for more than
    /// [`MOST_SOURCES`](super::MOST_SOURCES) sources at once.
    pub fn add(&mut self, settings: SourceSettings) -> Result<SourceId, AlignError> {
        if self.now.is_some() {
            return Err(AlignError::Begun);
        }
        self.admit(settings)
    }

    /// Holds some channels of a source where its policy interpolates the others: states and flags have no values in
    /// between.
    pub fn hold(&mut self, source: SourceId, held: &[bool]) -> Result<(), AlignError> {
        let place = self.place(source)?;
        if let Some(source) = &mut self.sources[place] {
            let (expected, got) = (source.channels, held.len());
            if expected != got {
                return Err(AlignError::Channels { expected, got });
            }
            source.held = if held.contains(&true) { held.to_vec() } else { Vec::new() };
        }
        Ok(())
    }

    /// Adds a source at `now` [ns of session time], after issuing everything that is due until then.
    pub fn join<F>(
        &mut self,
        settings: SourceSettings,
        now: i64,
        mut out: F,
    ) -> Result<SourceId, AlignError>
    where
        F: FnMut(Output<'_>),
    {
        self.advance(now, &mut out);
        self.admit(settings)
    }

    fn admit(&mut self, settings: SourceSettings) -> Result<SourceId, AlignError> {
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
        if self.onto == RowTimes::Pivot && self.serial == 0 {
            self.pivot = Some(id);
            source.policy = super::Policy::Exact;
        }
        self.serial = self.serial.wrapping_add(1);
        self.sources[place] = Some(source);
        self.arrange();
        Ok(id)
    }

    /// Ends a source at the time of the last sample or tick: its samples are used up to the last one, then
    /// it leaves the rows.
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
        match self.take_ordinary(source, &sample) {
            Some(true) => self.settle(&mut out),
            Some(false) => {}
            None => self.push_any(source, sample, &mut out)?,
        }
        Ok(())
    }

    /// Advances time to a sample's arrival, then takes the sample, whatever its kind.
    #[cold]
    fn push_any<F: FnMut(Output<'_>)>(
        &mut self,
        source: SourceId,
        sample: Sample<'_>,
        out: &mut F,
    ) -> Result<(), AlignError> {
        let place = self.place(source)?;
        let expected = self.channels(place);
        if sample.values.len() != expected {
            return Err(AlignError::Channels { expected, got: sample.values.len() });
        }
        self.advance(sample.arrival, out);
        if self.take_any(place, sample.measured, sample.values, out) {
            self.settle(out);
        }
        Ok(())
    }

    /// Takes samples of a source that arrived together: equivalent to pushing each with their common
    /// arrival time.
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
            let measured = run.measured.saturating_add(since_first);
            self.push(source, Sample { measured, arrival: run.arrival, values }, &mut out)?;
        }
        Ok(())
    }

    /// Advances session time to `now` [ns]; all samples that arrived earlier must have been pushed.
    pub fn tick<F: FnMut(Output<'_>)>(&mut self, now: i64, mut out: F) {
        self.advance(now, &mut out);
    }

    /// Ends the input: issues the rows up to the newest sample. No source may deliver afterwards.
    pub fn finish<F: FnMut(Output<'_>)>(&mut self, mut out: F) {
        for source in self.sources.iter_mut().flatten() {
            if source.is_here() {
                source.watermark.end(Presence::Ended);
            }
        }
        self.settle_anew(&mut out);
    }

    /// The numbers of a source's samples by outcome; `None` once it has left the rows.
    pub fn counts(&self, source: SourceId) -> Option<Counts> {
        let present = self.sources.get(source.place as usize)?.as_ref()?;
        (present.id == source).then_some(present.counts)
    }

    /// The number of rows issued.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// The number of grid rows left out because no source delivered.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The most memory that the aligner uses with its present sources [B]: for each source its capacity,
    /// rounded up to a power of two, times 8 B per channel plus 8 B for the time, and the overhead per
    /// source and row.
    pub fn bytes_bound(&self) -> usize {
        let of_samples = |source: &Source| source.samples.bytes_bound() + 8 * source.channels;
        let of_source = size_of::<Option<Source>>() + size_of::<Column>();
        let samples: usize = self.sources.iter().flatten().map(of_samples).sum();
        // Vectors double when they grow.
        size_of::<Aligner>() + samples + 2 * of_source * self.sources.len().max(4)
    }
}
