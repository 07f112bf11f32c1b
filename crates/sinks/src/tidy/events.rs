//! Events in BIDS format.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use teampulse_core::alerts::{Alert, Stage, Why, holds_alerts};
use teampulse_core::command::{Accepted, Command};
use teampulse_core::computers::UNTOLD;
use teampulse_core::data::{Event, EventKind};
use teampulse_core::loss::Loss;
use teampulse_core::phases::name_of;
use teampulse_core::reports::Noting;
use teampulse_core::sample::{Record, Turn};
use teampulse_core::stream::{About, Origin, Stream, Subject};
use teampulse_core::time::Time;

use super::file::{TextFile, Unwritten, on_one_line};
use super::sidecar::Column;
use super::timeline::{Timeline, word_of};
use crate::text::harmless;

/// The name of the file.
pub(super) const NAME: &str = "events.tsv";
/// The name of the file that describes its columns.
pub(super) const SIDECAR: &str = "events.json";
/// The type of a marker that nobody set, or a note that nobody wrote.
pub(super) const NOTICE: &str = "notice";
/// The columns; BIDS defines the first three and the last.
pub(super) const COLUMNS: [(&str, Column); 10] = [
    ("onset", Column::united("Onset, since the start of the session.", "s")),
    ("duration", Column::united("Duration; 0 for an instant.", "s")),
    ("trial_type", Column::of("The kind of event.")),
    ("value", Column::of("The value of the event; its meaning is given with the kinds.")),
    (
        "label",
        Column::of(
            "The name of the phase, or the text of the marker, report or fault. A label that begins like a formula (= + - @) is preceded by an apostrophe, so that no spreadsheet evaluates it.",
        ),
    ),
    ("subject", Column::of("The subject: a person's pseudonym, a robot, the team or the session.")),
    ("stream", Column::of("The stream in the bag that contains the event.")),
    (
        "phase",
        Column::of(
            "The current phase of the subject. A self-report in the first 10 s after the end of a phase is about that phase, as people rate what they have just done.",
        ),
    ),
    ("time", Column::of("Onset, as a time of day in UTC (ISO 8601).")),
    ("channel", Column::of("The channel in which the event was found, if a signal has several.")),
];
/// Two phases with the same name count as the same if their starts and ends differ by less than this [s].
const SAME_SECS: f64 = 1.0;
/// How long an event waits for earlier ones, so that rows are in order of onset [ns].
const WAIT_NS: i64 = 10_000_000_000;

/// A row for each event: its onset [s since the session's start], its duration [s], its type, and its
/// subject. Missing values are `n/a`, as in BIDS. A phase has its announced length until the session is over, then its
/// actual length.
#[derive(Debug)]
pub(super) struct Events {
    file: TextFile,
    /// Waiting rows, by onset and then by arrival.
    waiting: BTreeMap<(Time, u64), Row>,
    taken: u64,
    /// The number of lines written, and the phases among them.
    lines: usize,
    phases: BTreeMap<usize, Row>,
    /// The newest onset written, and whether an earlier one arrived after it.
    newest: Time,
    is_mixed_up: bool,
}

/// An event with its subject.
#[derive(Debug)]
struct Row {
    stream: Arc<Stream>,
    event: Arc<Event>,
    onset: Time,
}

impl Events {
    pub(super) fn create(folder: &Path) -> Result<Events, Unwritten> {
        let mut file = TextFile::create(folder.join(NAME))?;
        file.push(COLUMNS.map(|(name, _)| name).join("\t"))?;
        let newest = Time::from_nanos(i64::MIN);
        let (waiting, phases) = (BTreeMap::new(), BTreeMap::new());
        Ok(Events { file, waiting, taken: 0, lines: 1, phases, newest, is_mixed_up: false })
    }

    pub(super) fn take(
        &mut self,
        record: &Record,
        event: &Arc<Event>,
        timeline: &Timeline,
    ) -> Result<(), Unwritten> {
        if record.sample.turn != Turn::Duplicate && is_listed(&record.stream, event) {
            let (stream, event) = (Arc::clone(&record.stream), Arc::clone(event));
            let onset = record.sample.measured;
            self.taken += 1;
            self.waiting.insert((onset, self.taken), Row { stream, event, onset });
        }
        let due = Time::from_nanos(timeline.now().nanos().saturating_sub(WAIT_NS));
        self.write_until(due, timeline)
    }

    /// Writes waiting rows and the lengths of phases, and sorts rows that arrived too late.
    pub(super) fn finish(mut self, timeline: &Timeline) -> Result<(), Unwritten> {
        self.write_until(Time::from_nanos(i64::MAX), timeline)?;
        self.flush()?;
        let text = |row: &Row| (!row.repeats_the_session(timeline)).then(|| row.text(timeline));
        let phases = self.phases.iter().map(|(line, row)| (*line, text(row)));
        let phases: BTreeMap<usize, Option<String>> = phases.collect();
        let is_right = phases.is_empty() && !self.is_mixed_up;
        if is_right { Ok(()) } else { self.file.revise(&phases, onset_secs) }
    }

    pub(super) fn flush(&mut self) -> Result<(), Unwritten> {
        self.file.flush()
    }

    fn write_until(&mut self, due: Time, timeline: &Timeline) -> Result<(), Unwritten> {
        while let Some(first) = self.waiting.first_entry().filter(|first| first.key().0 <= due) {
            let row = first.remove();
            self.is_mixed_up |= row.onset < self.newest;
            self.newest = self.newest.max(row.onset);
            self.file.push(row.text(timeline))?;
            if row.event.kind == EventKind::Phase {
                self.phases.insert(self.lines, row);
            }
            self.lines += 1;
        }
        Ok(())
    }
}

impl Row {
    fn text(&self, timeline: &Timeline) -> String {
        let Row { stream, event, onset } = self;
        let (onset_secs, duration) = (timeline.secs(*onset), self.duration(timeline));
        let Event { kind, label, value, .. } = event.as_ref();
        let is_notice = is_notice(stream, event);
        let what = if is_notice { NOTICE.to_owned() } else { kind.to_string() };
        // For a burst of one of several channels, the channel is the label.
        let channel = if *kind == EventKind::Burst { word(label) } else { absent() };
        let value = number(ended_secs(stream, event).unwrap_or(*value));
        let label = word(self.name());
        let whom = timeline.whom(stream, event);
        let (subject, name) = (word(word_of(&whom)), &stream.name);
        let phase = timeline.phase_of(&whom, event, *onset).map_or_else(absent, word);
        format!(
            "{onset_secs:.3}\t{duration}\t{what}\t{value}\t{label}\t{subject}\t{name}\t{phase}\t{onset}\t{channel}"
        )
    }

    /// The label of the event; for a phase its usual name.
    fn name(&self) -> &str {
        let Event { kind, label, .. } = self.event.as_ref();
        let of_phase = (*kind == EventKind::Phase).then(|| name_of(label)).flatten();
        of_phase.unwrap_or(label)
    }

    /// Whether this is a phase of a person or a robot that equals the session's.
    fn repeats_the_session(&self, timeline: &Timeline) -> bool {
        let (of_session, subject) = (Subject::session(), self.stream.subject());
        let is_near = |a: Time, b: Time| a.secs_since(b).abs() < SAME_SECS;
        let own = timeline.phases_of(&subject).iter().filter(|own| is_near(own.begin, self.onset));
        subject.about != About::Session
            && own.filter(|own| own.label == self.name()).any(|own| {
                timeline.phases_of(&of_session).iter().any(|phase| {
                    let ends_too = own.end.zip(phase.end).is_none_or(|(a, b)| is_near(a, b));
                    phase.label == own.label && is_near(phase.begin, own.begin) && ends_too
                })
            })
    }

    /// The duration of the event. For a phase it is the known or announced duration, and missing if neither exists.
    fn duration(&self, timeline: &Timeline) -> String {
        let Event { kind, duration_secs, .. } = self.event.as_ref();
        if ended_secs(&self.stream, &self.event).is_some() {
            return number(0.0);
        }
        if *kind != EventKind::Phase {
            return number(*duration_secs);
        }
        let own_secs = Some(*duration_secs).filter(|secs| *secs > 0.0);
        let known_secs = timeline.length_secs(&self.stream.subject(), self.name(), self.onset);
        // Announced lengths are whole numbers, measured ones have milliseconds.
        known_secs.or(own_secs).map_or_else(absent, |secs| number((secs * 1e3).round() / 1e3))
    }
}

/// The duration of a state whose end an event reports [s]. It is the value of the row and not its duration, as a row
/// that covered the state would need the opposite label.
fn ended_secs(stream: &Stream, event: &Event) -> Option<f64> {
    Some(event.duration_secs).filter(|secs| is_notice(stream, event) && *secs > 0.0)
}

/// Whether nobody set this marker or wrote this note: it is a notice about a conclusion, or a note of the session
/// itself.
fn is_notice(stream: &Stream, event: &Event) -> bool {
    let is_concluded = stream.origin == Origin::Derived && stream.about != About::Session;
    event.kind == EventKind::Marker && is_concluded || Noting::of(event).is_some()
}

/// Whether an event has a row. Beats are in the interval files. Reports on clocks, which come every second, and reports
/// on whether losses can be counted, are omitted.
fn is_listed(stream: &Stream, event: &Event) -> bool {
    let is_counted = event.value.is_finite() && event.value > 0.0;
    let is_news = is_counted || Loss::of_stream(stream).is_none();
    let is_own = !UNTOLD.contains(&stream.name.as_str()) && !repeats_a_robot(stream, event);
    // A phase without a name only ends the previous one, whose length shows that.
    let is_end = event.kind == EventKind::Phase && name_of(&event.label).is_none();
    // A marker that was set by command has a separate row.
    let is_mark = matches!(Accepted::read(event), Some(Accepted { command: Command::Mark(_), .. }));
    event.kind != EventKind::Beat && is_own && is_news && !is_end && !is_mark
}

/// Whether an alert repeats the robot's own events: that it is offline, a sensor is stuck, or its diagnostics report an
/// error. An answer to an alert is not repeated elsewhere.
fn repeats_a_robot(stream: &Stream, event: &Event) -> bool {
    let alert = Some(&event.label).filter(|_| holds_alerts(stream));
    alert
        .and_then(|label| Alert::read(label))
        .is_some_and(|alert| alert.stage != Stage::Answered && !matches!(alert.why, Why::Limit(_)))
}

/// Reads the onset of a row [s]; the header sorts before all rows.
fn onset_secs(row: &str) -> f64 {
    let onset = row.split('\t').next().and_then(|onset| onset.parse().ok());
    onset.unwrap_or(f64::NEG_INFINITY)
}

fn absent() -> String {
    "n/a".to_owned()
}

fn number(value: f64) -> String {
    // Never a negative zero.
    if value.is_finite() { (value + 0.0).to_string() } else { absent() }
}

/// Formats a text as a cell.
fn word(text: &str) -> String {
    let text = on_one_line(text);
    if text.trim().is_empty() { absent() } else { harmless(&text).into_owned() }
}
