//! What happened, in the manner of BIDS.

use std::collections::BTreeMap;
use std::path::Path;

use teampulse_core::computers::UNTOLD;
use teampulse_core::data::{Event, EventKind};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::stream::{Stream, Subject};
use teampulse_core::time::Time;

use super::course::{Course, word_of};
use super::file::{Lines, Unwritten};

/// The name of the file.
pub(super) const NAME: &str = "events.tsv";
/// Its columns; the first three are those of BIDS.
const COLUMNS: &str = "onset\tduration\ttrial_type\tvalue\tlabel\tsubject\tstream\tphase\ttime";
/// So long an event waits for earlier ones, so that the rows stand in the order of their onsets [ns].
const WAIT_NS: i64 = 10_000_000_000;

/// A row for each event: when it began [s since the session did], how long it lasted [s], what it was,
/// and whose. As in BIDS, what there is not is `n/a`.
#[derive(Debug)]
pub(super) struct Events {
    file: Lines,
    /// Rows that wait, in the order of their onsets and then of their coming.
    waiting: BTreeMap<(Time, u64), Row>,
    taken: u64,
    /// The newest onset that was written, and whether an earlier one came after it.
    newest: Time,
    is_mixed_up: bool,
}

#[derive(Debug)]
struct Row {
    subject: Subject,
    before_phase: String,
}

impl Events {
    pub(super) fn create(folder: &Path) -> Result<Events, Unwritten> {
        let mut file = Lines::create(folder.join(NAME))?;
        file.push(COLUMNS)?;
        let (waiting, newest) = (BTreeMap::new(), Time::from_nanos(i64::MIN));
        Ok(Events { file, waiting, taken: 0, newest, is_mixed_up: false })
    }

    pub(super) fn take(
        &mut self,
        record: &Record,
        event: &Event,
        course: &Course,
    ) -> Result<(), Unwritten> {
        if record.sample.turn != Turn::Duplicate && is_told(&record.stream, event) {
            let at = record.sample.measured;
            let row = Row {
                subject: record.stream.subject(),
                before_phase: before_phase(&record.stream, event, course.secs(at)),
            };
            self.taken += 1;
            self.waiting.insert((at, self.taken), row);
        }
        let due = Time::from_nanos(course.now().nanos().saturating_sub(WAIT_NS));
        self.write_until(due, course)
    }

    /// Writes what still waits, and puts in order what came later than any row waits.
    pub(super) fn finish(mut self, course: &Course) -> Result<(), Unwritten> {
        self.write_until(Time::from_nanos(i64::MAX), course)?;
        self.flush()?;
        if self.is_mixed_up { self.file.sort(onset_secs) } else { Ok(()) }
    }

    pub(super) fn flush(&mut self) -> Result<(), Unwritten> {
        self.file.flush()
    }

    fn write_until(&mut self, due: Time, course: &Course) -> Result<(), Unwritten> {
        while let Some(first) = self.waiting.first_entry().filter(|first| first.key().0 <= due) {
            let ((at, _), row) = first.remove_entry();
            self.is_mixed_up |= at < self.newest;
            self.newest = self.newest.max(at);
            let phase = course.section(&row.subject, at).phase.map_or_else(absent, word);
            self.file.push(format_args!("{}\t{phase}\t{at}", row.before_phase))?;
        }
        Ok(())
    }
}

/// Whether an event has a row. Beats stand in the files of intervals; what is told of clocks each
/// second, and that losses of a stream can be counted or not, says nothing to people.
fn is_told(stream: &Stream, event: &Event) -> bool {
    let is_counted = event.value.is_finite() && event.value > 0.0;
    let is_news = is_counted || !stream.name.starts_with("/teampulse/lost");
    event.kind != EventKind::Beat && !UNTOLD.contains(&stream.name.as_str()) && is_news
}

/// The onset that a row begins with [s]; the head comes before all.
fn onset_secs(row: &str) -> f64 {
    let onset = row.split('\t').next().and_then(|onset| onset.parse().ok());
    onset.unwrap_or(f64::NEG_INFINITY)
}

fn before_phase(stream: &Stream, event: &Event, onset_secs: f64) -> String {
    let Event { kind, label, value, duration_secs } = event;
    let duration = number(*duration_secs);
    // A phase of no length is one whose end is not yet known.
    let duration =
        if *kind == EventKind::Phase && *duration_secs <= 0.0 { absent() } else { duration };
    let (value, label) = (number(*value), word(label));
    let (subject, name) = (word(word_of(stream)), &stream.name);
    format!("{onset_secs:.3}\t{duration}\t{kind}\t{value}\t{label}\t{subject}\t{name}")
}

fn absent() -> String {
    "n/a".to_owned()
}

fn number(value: f64) -> String {
    if value.is_finite() { value.to_string() } else { absent() }
}

/// A text as a cell: on one line, without tabs.
fn word(text: &str) -> String {
    let text = text.replace(['\t', '\n', '\r'], " ");
    if text.trim().is_empty() { absent() } else { text }
}
