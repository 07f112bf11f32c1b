//! Feature values in long format.

use std::collections::BTreeMap;
use std::path::Path;

use teampulse_core::data::{FeatureValues, Reason};
use teampulse_core::sample::Record;
use teampulse_core::stream::{Stream, StreamId};
use teampulse_core::time::Time;

use super::file::{TextFile, Unwritten, on_one_line};
use super::measures::{COVERAGE, QUALITY, has_coverage, is_of_phases, is_of_statistics, source_of};
use super::sidecar::Column;
use super::timeline::{SHORTEST_SECS, Section, Timeline, word_of};
use crate::csv::{cell, number};

/// The name of the file.
pub(super) const NAME: &str = "features.csv";
/// The name of the file that describes its columns.
pub(super) const SIDECAR: &str = "features.json";
/// The columns of the file.
pub(super) const COLUMNS: [(&str, Column); 11] = [
    ("start_secs", Column::united("Start of the window, since the start of the session.", "s")),
    ("window_secs", Column::united("Length of the window.", "s")),
    ("subject", Column::of("The subject: a person's pseudonym, a robot, the team or the session.")),
    (
        "phase",
        Column::of(
            "The phase that contains the window, to within half a second; empty between phases.",
        ),
    ),
    ("source", Column::of("The subject's device and signal from which the value was computed.")),
    ("measure", Column::of("The name of the value; for heart, breath and skin as in NeuroKit2.")),
    ("value", Column::of("The value, in its unit; empty if and only if there is a reason.")),
    ("unit", Column::of("The unit of the value and of its sigma; 1 if it has none.")),
    (
        "sigma",
        Column::of(
            "The standard uncertainty of the value; for a difference from a baseline, the uncertainty of the baseline \
             alone; empty if it can't be stated.",
        ),
    ),
    ("reason", Column::of("Why there is no value.")),
    ("span", Column::of("`phase` if the window is a whole phase; empty if it is a part of one.")),
];
/// The tolerance with which a window fits into a phase [ns]. Windows end each second by the clock of their device,
/// which may be off from the start and end of the phase.
const TOLERANCE_NS: i64 = 500_000_000;

/// A row for each value of a window, and for the window's coverage and quality. These are windows that do not overlap,
/// each within one phase or between two, and every window that is a whole phase. For the statistics of raw signals
/// there are only phases; their windows are in the bag. Times are seconds of the session.
#[derive(Debug)]
pub(super) struct Features {
    file: TextFile,
    every_ns: i64,
    last_windows: BTreeMap<StreamId, LastWindow>,
}

/// The last window of a stream that was written.
#[derive(Clone, Copy, Debug)]
struct LastWindow {
    end: Time,
    /// The start of the section that contains the window.
    section: Time,
}

/// The time that a feature covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    begin: Time,
    end: Time,
}

impl Features {
    /// Creates the file, with at most one row per stream every `every_secs`.
    pub(super) fn create(folder: &Path, every_secs: f64) -> Result<Features, Unwritten> {
        let mut file = TextFile::create(folder.join(NAME))?;
        file.push(COLUMNS.map(|(name, _)| name).join(","))?;
        Ok(Features { file, every_ns: (every_secs * 1e9) as i64, last_windows: BTreeMap::new() })
    }

    pub(super) fn take(
        &mut self,
        record: &Record,
        values: &FeatureValues,
        timeline: &Timeline,
    ) -> Result<(), Unwritten> {
        let window = Window::of(record.sample.measured, values);
        let section = timeline.section(&record.stream.subject(), window.middle());
        let id = record.sample.stream;
        if is_of_phases(&record.stream) {
            if says_nothing(values) {
                return Ok(());
            }
        } else {
            if is_of_statistics(&record.stream) {
                return Ok(());
            }
            if !self.is_due(self.last_windows.get(&id), window, section) {
                return Ok(());
            }
            self.last_windows.insert(id, LastWindow { end: window.end, section: section.begin });
        }
        self.write(&record.stream, window, values, (timeline, section))
    }

    pub(super) fn flush(&mut self) -> Result<(), Unwritten> {
        self.file.flush()
    }

    fn is_due(&self, last: Option<&LastWindow>, window: Window, section: Section<'_>) -> bool {
        window.lies_in(section)
            && last.is_none_or(|last| {
                let since_ns = window.end.nanos_since(last.end);
                let is_time = last.section != section.begin
                    || since_ns.saturating_add(TOLERANCE_NS) >= self.every_ns;
                is_time && since_ns > 0 && window.is_after(last.end)
            })
    }

    fn write(
        &mut self,
        stream: &Stream,
        Window { begin, .. }: Window,
        values: &FeatureValues,
        (timeline, section): (&Timeline, Section<'_>),
    ) -> Result<(), Unwritten> {
        let begin_secs = timeline.secs(begin);
        let (subject, source) = (cell(word_of(&stream.subject())), cell(&source_of(stream)));
        let phase = cell(&on_one_line(section.phase.unwrap_or_default()));
        let FeatureValues { window_secs, coverage, quality, .. } = values;
        let of_window = format!("{begin_secs:.3},{window_secs},{subject},{phase},{source}");
        let span = if is_of_phases(stream) { "phase" } else { "" };
        if has_coverage(stream) {
            // The quality of a link is a separate value.
            let is_own = |name: &str| stream.channels.iter().any(|channel| channel.name == name);
            let shares = [(COVERAGE, coverage), (QUALITY, quality)].into_iter();
            for (measure, share) in shares.filter(|(measure, _)| !is_own(measure)) {
                self.file.push(format_args!("{of_window},{measure},{share},1,,,{span}"))?;
            }
        }
        for (k, channel) in stream.channels.iter().enumerate() {
            let at = |numbers: &[f64]| number(numbers.get(k).copied().unwrap_or(f64::NAN));
            let (value, sigma) = (at(&values.values), at(&values.sigmas));
            let reason = match values.reasons.get(k) {
                None | Some(Reason::Ok) => String::new(),
                Some(reason) => reason.to_string(),
            };
            let (channel, unit) = (cell(&channel.name), cell(&channel.unit));
            let of_value = format_args!("{channel},{value},{unit},{sigma},{reason}");
            self.file.push(format_args!("{of_window},{of_value},{span}"))?;
        }
        Ok(())
    }
}

impl Window {
    pub(super) fn of(end: Time, values: &FeatureValues) -> Window {
        let length_ns = (values.window_secs * 1e9).round() as i64;
        Window { begin: Time::from_nanos(end.nanos().saturating_sub(length_ns)), end }
    }

    /// Whether the window begins at a time or later, within the tolerance.
    pub(super) fn is_after(self, moment: Time) -> bool {
        moment.nanos_since(self.begin) <= TOLERANCE_NS
    }

    /// Whether the window is within a section, given the tolerance.
    pub(super) fn lies_in(self, section: Section<'_>) -> bool {
        self.is_after(section.begin) && section.end.is_none_or(|end| self.is_before(end))
    }

    /// Whether the window ends at a time or earlier, within the tolerance.
    fn is_before(self, moment: Time) -> bool {
        self.end.nanos_since(moment) <= TOLERANCE_NS
    }

    pub(super) fn middle(self) -> Time {
        let half_ns = self.end.nanos_since(self.begin) / 2;
        Time::from_nanos(self.begin.nanos().saturating_add(half_ns))
    }
}

/// Whether a phase is too short to be intended and has no value.
pub(super) fn says_nothing(values: &FeatureValues) -> bool {
    values.window_secs < SHORTEST_SECS && values.reasons.iter().all(|reason| *reason != Reason::Ok)
}
