//! `teampulse extract`: computes features from any table of samples.

mod analyses;
mod around;
mod asked;
mod found;
mod inverted;
mod odd_intervals;
mod options;
mod plausible;
mod progress;
mod rows;
mod printed;
mod table;
mod times;
mod report;
mod truth;
mod windows;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use teampulse_core::counted::counted;
use teampulse_core::stream::Signal;
use teampulse_features::analyses::{Analysis, Chosen};
use teampulse_signal::agreement::matched;
use teampulse_signal::analysis::{Cadence, Live, LiveOutput, Recording, Span};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;
pub use analyses::signal;
pub use asked::TableArgs;
pub use rows::Rows;
pub use table::{Oddity, Row, Table, without_unit};

use around::{Analysed, AroundArgs};
use found::{Found, Purpose};
use options::{failure, mains, seconds, warn};
use progress::Progress;
use report::{Report, Score};
use table::{TableError, is_raw};
use truth::Marks;
use windows::{Lengths, Windows};

/// Returns the distances from a true event within which a detected event counts as found [s]. For beats, the usual
/// tolerance and one that is fine enough for their intervals; slower events have less exact onsets.
const fn tolerances_secs(signal: Signal) -> &'static [f64] {
    match signal {
        Signal::Eda => &[1.0],
        Signal::Respiration => &[0.5],
        _ => &[0.15, 0.05],
    }
}

/// The most cells held in memory: half a gigabyte, and an analysis needs several copies.
const MOST_CELLS: usize = 1 << 26;

/// The duration by sample count and the duration by times agree if they differ by less than this fraction.
const MOST_ASTRAY: f64 = 0.005;

/// Finds events and computes features of windows in any table of samples.
///
/// A table has one number per line, or columns separated by commas, semicolons, bars, tabs or spaces, with decimal
/// points or commas, with or without a header. Files from Empatica (E4, Embrace Plus), Shimmer (Consensys) and Polar
/// Sensor Logger are supported, as are comments that state the sampling rate, units below or next to names, and times
/// in s, ms, us, ns, as dates (also Excel's), or as minutes and seconds.
///
/// Each number is printed with the recipe it was computed by. Where a number would be meaningless, the reason is given
/// instead.
#[derive(Debug, Args)]
pub struct Extract {
    /// The table; - is standard input
    file: PathBuf,
    /// What was measured
    #[arg(long, value_parser = signal())]
    signal: &'static Analysis,
    #[command(flatten)]
    table: TableArgs,
    /// The mains frequency to remove from an ECG; by default detected in the signal
    #[arg(long, value_name = "HZ", value_parser = mains)]
    mains: Option<f64>,
    /// Length of a window; by default one window covers the whole recording
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    window: Option<f64>,
    /// Time between the starts of successive windows; by default the length of a window
    #[arg(long, value_name = "SECS", value_parser = seconds, requires = "window")]
    hop: Option<f64>,
    /// Causal analysis, as in a live session, or analysis of the whole recording at once
    #[arg(long, default_value = "whole")]
    method: Method,
    /// How to split skin conductance into tonic and phasic components in whole recordings; by default high-pass
    #[arg(long, value_name = "METHOD")]
    phasic: Option<analyses::Phasic>,
    /// How to treat artefacts in a table of intervals; by default they are kept. Intervals of an ECG or a PPG are
    /// always corrected
    #[arg(long, value_name = "WHAT")]
    artefacts: Option<analyses::Artefacts>,
    /// A table of true events to score the detected ones against: column `sample`, or `time_secs` or `onset` on the
    /// time axis of the table. Beats and pulses are scored within 150 and 50 ms, the onsets of skin responses within 1
    /// s, the onsets of breaths within 0.5 s
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    around: AroundArgs,
    /// Prints the events as comma-separated values, instead of the features
    #[arg(long, conflicts_with = "json")]
    events: bool,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

/// The method of analysis of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Each result uses only earlier samples, as in a live session
    Causal,
    /// Each result uses earlier and later samples
    Whole,
}

impl Extract {
    /// Runs the command.
    pub fn run(self) -> Result<Exit, Failure> {
        let table = self.table.open(&self.file, self.signal)?;
        self.check(&table)?;
        let rate_hz = table.rate_hz();
        let mut rows = self.table.rows(self.signal, table)?;
        let progress = Progress::new();
        let purpose = match (self.json, self.events) {
            (true, _) => Purpose::Kept,
            (false, true) => Purpose::Events,
            (false, false) => Purpose::Windows,
        };
        let mut found = Found::new(purpose, self.truth.as_ref().and(self.signal.main_event()));
        rows.table().notes().iter().for_each(|note| found.note(note.clone()));
        match self.method {
            Method::Causal => self.causal(&mut rows, &progress, &mut found)?,
            Method::Whole => self.whole(&mut rows, &progress, &mut found)?,
        }
        progress.end();
        warn(&rows, &mut found);
        if let Some(note) = self.artefacts_kept(found.artefacts) {
            found.note(note);
        }
        let score = self.scored(&rows, &mut found)?;
        let rate_hz = self.signal.is_even().then_some(rate_hz);
        let method = if self.method == Method::Causal { "causal" } else { "whole" };
        match purpose {
            Purpose::Kept => {
                output::json(&Report::new(self.signal.word(), rate_hz, method, &found, score));
            }
            Purpose::Events => {
                found.end_events();
                score.iter().flatten().for_each(|each| output::note(each.shown()));
            }
            Purpose::Windows => {
                printed::around(&found.around);
                printed::recipes(&found.values, method);
                printed::recipes(&found.around.values, "around events");
                output::line(format!("\n{}", printed::counts(&found.counts)));
                output::lines(score.iter().flatten().map(Score::shown));
            }
        }
        Ok(Exit::Fine)
    }

    /// Checks that the options fit together.
    fn check(&self, table: &Table) -> Result<(), Failure> {
        let wrong = |message: String, hint: &str| {
            Err(Failure::new(message).hint(hint).exit(Exit::BadArguments))
        };
        let (word, count) = (self.signal.word(), table.names().len());
        if let Some(channels) = self.signal.table.channels.filter(|&channels| channels != count) {
            let message = format!("{word} needs {channels} column(s), but {count} were found");
            return wrong(message, "name them with --column NAME,NAME");
        }
        if self.phasic.is_some()
            && (self.signal.signal != Signal::Eda || self.method == Method::Causal)
        {
            let message = "--phasic is for --signal eda with --method whole".to_owned();
            return wrong(message, "a causal analysis splits skin conductance by its own filter");
        }
        if self.artefacts.is_some() && self.signal.is_even() {
            let message = "--artefacts is for --signal interval".to_owned();
            return wrong(message, "intervals of an ECG or a PPG are always corrected");
        }
        self.around.check(self.signal, self.method == Method::Causal)?;
        let option = if self.truth.is_some() { "--truth" } else { "--events" };
        if (self.truth.is_some() || self.events) && self.signal.main_event().is_none() {
            return wrong(format!("{word} has no events"), &format!("remove {option}"));
        }
        Ok(())
    }

    /// Returns the note that artefacts among intervals were kept, if the user did not choose that.
    fn artefacts_kept(&self, artefacts: usize) -> Option<String> {
        let is_default = !self.signal.is_even() && self.artefacts.is_none();
        (is_default && artefacts > 0).then(|| {
            let kept = counted(artefacts, "artefact is", "artefacts are");
            format!("{kept} kept; give --artefacts corrected to correct them, as in an ECG")
        })
    }

    fn causal(
        &self,
        rows: &mut Rows,
        progress: &Progress,
        found: &mut Found,
    ) -> Result<(), Failure> {
        let lengths = Lengths::new(self.window, self.hop);
        let mut live = self.live(rows, lengths)?;
        found.values = live.values().to_vec();
        let mut held = 0;
        let mut windows = None;
        while let Some((at_ns, row)) = self.next(rows)? {
            let begin_ns = rows.times().begin_ns();
            let windows = windows.get_or_insert_with(|| Windows::new(begin_ns, lengths));
            if lengths.is_none() {
                held += row.values.len() * (1 + rows.times().skipped());
                not_too_much(held, Method::Causal)?;
            }
            let missing = live.push(at_ns, &row.values, &mut |output| match output {
                LiveOutput::Event(event) => progress.aside(|| found.event(event)),
                LiveOutput::Window(_, span, measured) if windows.take(span) => {
                    progress.aside(|| found.window(span, measured));
                }
                LiveOutput::Window(..) => {}
            });
            found.count(missing, row.line);
            progress.reading(rows.table().rows(), || rows.table().read_share());
        }
        let mut windows = windows.ok_or_else(|| failure(TableError::NoNumbers))?;
        windows.skip_until(live.next_end_ns().unwrap_or(0));
        for span in windows.rest(self.end_ns(rows, found.last_event_ns)) {
            progress.aside(|| found.window(span, live.measure(span)));
        }
        Ok(())
    }

    /// Returns the next row and its time [ns]; fails if the clock of an evenly sampled signal was set back. Intervals
    /// that end before an earlier one are left out one by one.
    fn next(&self, rows: &mut Rows) -> Result<Option<(i64, Row)>, Failure> {
        let next = rows.next()?;
        if let Some((_, row)) = next.as_ref().filter(|_| self.signal.is_even()) {
            rows.in_order(row.line)?;
        }
        Ok(next)
    }

    fn live(&self, rows: &Rows, lengths: Option<Lengths>) -> Result<Live, Failure> {
        let table = rows.table();
        let (chosen, signal) = (self.chosen(rows), self.signal);
        let channels = table.names().len();
        let make = Box::new(move |rate_hz| (signal.causal)(&chosen, rate_hz));
        let rate_hz = if signal.is_even() { table.rate_hz() } else { 0.0 };
        let (window_ns, hop_ns) =
            lengths.map_or((vec![], 1), |each| (vec![each.window_ns], each.hop_ns));
        let live = Live::new(make, rate_hz, channels, &window_ns, hop_ns);
        let live = live.map_err(|error| analyses::failure(signal, error))?;
        let live = live.first_after(lengths.map_or(1, Lengths::first_ns));
        // An interval starts before its row, which is stamped at its end.
        Ok(if signal.is_even() { live } else { live.beginning_at(rows.times().begin_ns()) })
    }

    fn whole(
        &self,
        rows: &mut Rows,
        progress: &Progress,
        found: &mut Found,
    ) -> Result<(), Failure> {
        let mut channels = vec![Vec::new(); rows.table().names().len()];
        // The end of each interval, since the start of the recording [s].
        let mut ends_secs = Vec::new();
        let rate_hz = if self.signal.is_even() { rows.table().rate_hz() } else { 0.0 };
        let mut cadence = Cadence::new(rate_hz);
        while let Some((at_ns, row)) = self.next(rows)? {
            let missing = cadence.missing_before(at_ns);
            found.count(missing, row.line);
            let Some(missing) = missing else { continue };
            not_too_much((channels[0].len() + missing) * channels.len(), Method::Whole)?;
            for (channel, value) in channels.iter_mut().zip(&row.values) {
                channel.extend(std::iter::repeat_n(f64::NAN, missing));
                channel.push(*value);
            }
            if !self.signal.is_even() {
                let begin_ns = rows.times().begin_ns();
                let end_secs = |_| at_ns.saturating_sub(begin_ns) as f64 / 1e9;
                ends_secs.push(row.at_ns.map_or(f64::NAN, end_secs));
            }
            progress.reading(rows.table().rows(), || rows.table().read_share());
        }
        if channels[0].is_empty() {
            return Err(failure(TableError::NoNumbers));
        }
        if rate_hz > 0.0 {
            compare(rows, channels[0].len() as f64 / rate_hz, found);
        }
        channels.extend((!self.signal.is_even()).then_some(ends_secs));
        let (table, begin_ns) = (rows.table(), rows.times().begin_ns());
        let recording = Recording { rate_hz: table.rate_hz(), begin_ns, channels: &channels };
        progress.analysing();
        let whole = (self.signal.whole)(&self.chosen(rows), &recording);
        let whole = whole.map_err(|error| analyses::failure(self.signal, error))?;
        found.values = whole.windows.values().to_vec();
        let span = Span { begin_ns, end_ns: rows.times().end_ns() };
        let upside_down =
            inverted::note(self.signal, &self.chosen(rows), &recording, (&whole, span));
        if let Some(note) = upside_down {
            found.note(note);
        }
        let events = if self.around.are_given() { whole.events.clone() } else { Vec::new() };
        whole.events.into_iter().for_each(|event| progress.aside(|| found.event(event)));
        let end_ns = self.end_ns(rows, found.last_event_ns);
        found.around = self.around.find(&Analysed {
            signal: self.signal,
            rate_hz: rows.table().rate_hz(),
            begin_ns,
            end_ns,
            is_corrected: self.signal.is_even()
                || self.artefacts == Some(analyses::Artefacts::Corrected),
            events: &events,
            windows: &*whole.windows,
        })?;
        for note in std::mem::take(&mut found.around.notes) {
            found.note(note);
        }
        for span in Windows::new(begin_ns, Lengths::new(self.window, self.hop)).rest(end_ns) {
            progress.measuring((span.end_ns - begin_ns) as f64 / (end_ns - begin_ns) as f64);
            progress.aside(|| found.window(span, whole.windows.measure(span)));
        }
        Ok(())
    }

    fn chosen(&self, rows: &Rows) -> Chosen {
        let in_table =
            || rows.table().units().first().cloned().flatten().filter(|unit| !is_raw(unit));
        let unit = self
            .table
            .unit()
            .map(str::to_owned)
            .or_else(in_table)
            .unwrap_or_else(|| "1".to_owned());
        let live = Chosen::default();
        let of_beats = rows.are_of_beats().then_some(analyses::BEATS_ASTRAY_SECS);
        Chosen {
            channels: analyses::named(rows.table().names()),
            unit,
            mains_hz: self.mains,
            phasic: self.phasic.unwrap_or(analyses::Phasic::HighPass).into(),
            artefacts: self.artefacts.unwrap_or(analyses::Artefacts::Kept).into(),
            most_astray_secs: of_beats.unwrap_or(live.most_astray_secs),
        }
    }

    /// Returns when the recording ends [ns]: at the last beat, if the sum of the intervals exceeds the span of their
    /// times.
    fn end_ns(&self, rows: &Rows, last_beat_ns: i64) -> i64 {
        let end_ns = rows.times().end_ns();
        if self.signal.is_even() { end_ns } else { end_ns.max(last_beat_ns.saturating_add(1)) }
    }

    /// Returns the agreement with the true events, if they are given.
    fn scored(&self, rows: &Rows, found: &mut Found) -> Result<Option<Vec<Score>>, Failure> {
        let Some(truth) = &self.truth else { return Ok(None) };
        let (times, rate_hz) = (rows.times(), rows.table().rate_hz());
        let span_secs = (times.begin_ns() as f64 / 1e9, times.end_ns() as f64 / 1e9);
        let (marks, read_as) = Marks::read(truth)?;
        let (places, note) = marks.places(span_secs, rate_hz);
        read_as.into_iter().chain(note).for_each(|note| found.note(note));
        Ok(Some(self.score(found, &places, rate_hz)))
    }

    fn score(&self, found: &Found, truth: &[f64], rate_hz: f64) -> Vec<Score> {
        let agreement = |secs: f64| matched(truth, &found.places, secs * rate_hz);
        let score = |&secs: &f64| Score::new(secs, &agreement(secs), rate_hz);
        tolerances_secs(self.signal.signal).iter().map(score).collect()
    }
}

/// Adds a note if the sampling rate and the times give different durations [s].
fn compare(rows: &Rows, by_rate_secs: f64, found: &mut Found) {
    let by_times_secs = rows.times().end_ns().saturating_sub(rows.times().begin_ns()) as f64 / 1e9;
    if (by_rate_secs - by_times_secs).abs() > MOST_ASTRAY * by_times_secs {
        let rate_hz = rows.table().rate_hz();
        found.note(format!(
            "the samples last {by_rate_secs:.1} s at {rate_hz} Hz, but {by_times_secs:.1} s by their times: events are placed by the rate; --method causal follows the times"
        ));
    }
}

fn not_too_much(cells: usize, method: Method) -> Result<(), Failure> {
    if cells <= MOST_CELLS {
        return Ok(());
    }
    let hint = match method {
        Method::Causal => "give --window SECS",
        Method::Whole => "give --method causal and --window SECS, or split the table",
    };
    Err(Failure::new(format!(
        "the table has more than {MOST_CELLS} samples, too many to hold in memory"
    ))
    .hint(hint))
}
