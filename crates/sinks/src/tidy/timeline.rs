//! The timeline of a session: its start and its phases.

use std::collections::BTreeSet;

use teampulse_core::alerts::{Alert, holds_alerts};
use teampulse_core::data::{Event, EventKind};
use teampulse_core::phases::{Phase, Phases};
use teampulse_core::reports::{Isa, Rating};
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Stream, StreamId, Subject};
use teampulse_core::time::Time;

use super::file::on_one_line;

/// The shortest phase that counts as intended [s].
pub(super) const SHORTEST_SECS: f64 = 1.0;

/// Why a session may have no recorded end.
const CUT_OFF: &str =
    "The session was cut off: its end was not recorded; phases end with the last record.";

/// A self-report refers to a phase that ended less than this long ago [ns] rather than to the next one, as for the
/// feature `estimates`.
const JUST_ENDED_NS: i64 = 10_000_000_000;

/// The start of a session, and the phases of everyone in it.
#[derive(Debug)]
pub(super) struct Timeline {
    /// Whether the recording contains the end of the session, unless it was cut off.
    pub(super) has_end: bool,
    /// Whether the session was already running when the recording began.
    pub(super) has_joined: bool,
    began: Option<Time>,
    now: Time,
    phases: Phases,
    /// The ids of the people with streams or reports.
    people: BTreeSet<String>,
    /// The streams so far, and the people and robots to which they belong.
    streams: BTreeSet<StreamId>,
    subjects: BTreeSet<Subject>,
    cut_off: Option<String>,
}

/// The share of a section that values must cover to be those of the section.
const LEAST_COVERED: f64 = 0.95;

/// A stretch of a subject's time within one phase, or between two phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Section<'a> {
    /// The phase; `None` between phases.
    pub(super) phase: Option<&'a str>,
    /// The start of the section.
    pub(super) begin: Time,
    /// The end of the section, as far as it is known.
    pub(super) end: Option<Time>,
}

impl Section<'_> {
    /// Whether values over this time [s] are those of the whole section, which lasts until `now` if its end is not known.
    pub(super) fn is_covered_by(self, secs: f64, now: Time) -> bool {
        secs >= LEAST_COVERED * self.end.unwrap_or(now).secs_since(self.begin)
    }
}

impl Default for Timeline {
    fn default() -> Timeline {
        let (began, now, cut_off) = (None, Time::default(), None);
        let (phases, people, subjects) = (Phases::default(), BTreeSet::new(), BTreeSet::new());
        let streams = BTreeSet::new();
        Timeline {
            has_end: true,
            has_joined: false,
            began,
            now,
            phases,
            people,
            streams,
            subjects,
            cut_off,
        }
    }
}

impl Timeline {
    /// Takes the next record. A session begins with its first record.
    pub(super) fn take(&mut self, record: &Record) {
        let sample = &record.sample;
        self.began.get_or_insert(sample.log_time);
        self.now = sample.log_time;
        self.phases.join(sample.stream, &record.stream);
        self.phases.push(sample);
        let stream = &record.stream;
        if stream.about == About::Person && !self.people.contains(&stream.id) {
            self.people.insert(stream.id.clone());
        }
        let is_somebody = matches!(stream.about, About::Person | About::Robot);
        if self.streams.insert(sample.stream) && is_somebody && !stream.id.is_empty() {
            self.subjects.insert(stream.subject());
        }
    }

    /// Ends the timeline; a session without a recorded end ended with its last record.
    pub(super) fn finish(&mut self) {
        if !self.phases.is_over() {
            if self.has_end {
                self.cut_off.get_or_insert_with(|| CUT_OFF.to_owned());
            }
            self.phases.end(self.now);
        }
    }

    /// Ends the timeline with the bag.
    pub(super) fn end_with_bag(&mut self, why: &str) {
        self.cut_off = Some(format!(
            "The bag ended before the session did, and these files with it: {}; phases end there, too.",
            on_one_line(why)
        ));
    }

    /// Ends the timeline early, for a reason that fits after "failed to".
    pub(super) fn end_early(&mut self, reason: &str) {
        self.cut_off = Some(format!(
            "The session ended early: it failed to {}; phases end there, too.",
            on_one_line(reason)
        ));
    }

    /// The remark on a session without a recorded end.
    pub(super) fn cut_off(&self) -> Option<&str> {
        self.cut_off.as_deref()
    }

    /// The phases that did not end before the recording was cut off, by subject and start.
    pub(super) fn cut_phases(&self) -> BTreeSet<(Subject, Time)> {
        let last = |subject: &Subject| {
            let last = self.phases.of(subject).last()?;
            (last.end == Some(self.now)).then(|| (subject.clone(), last.begin))
        };
        let cut = self.subjects.iter().filter(|_| self.cut_off.is_some());
        cut.filter_map(last).collect()
    }

    /// The start of the session.
    pub(super) fn began(&self) -> Time {
        self.began.unwrap_or(self.now)
    }

    /// The newest time of the session.
    pub(super) fn now(&self) -> Time {
        self.now
    }

    /// The time since the session's start [s].
    pub(super) fn secs(&self, at: Time) -> f64 {
        positive_zero(at.secs_since(self.began()), 1e-3)
    }

    /// The time since the session's start as text, to a tenth of a second.
    pub(super) fn tenths(&self, at: Time) -> String {
        format!("{:.1}", positive_zero(self.secs(at), 0.1))
    }

    /// Returns the subject of an event: for a self-report among the session's events, the person that it names or the
    /// only person present; for an alert, the robot or the person that it names.
    pub(super) fn whom(&self, stream: &Stream, event: &Event) -> Subject {
        if let Some(alert) = Alert::read(&event.label).filter(|_| holds_alerts(stream)) {
            let named = self.subjects.iter().find(|subject| subject.id == alert.who);
            return named.cloned().unwrap_or_else(|| stream.subject());
        }
        let rating = Rating::read(event).filter(|_| stream.about == About::Session);
        let named = rating.map(|rating| rating.person);
        let id = match named {
            Some("") if self.people.len() == 1 => self.people.first(),
            Some(id) => self.people.get(id),
            None => None,
        };
        let person = |id: &String| Subject { about: About::Person, id: id.clone() };
        id.map_or_else(|| stream.subject(), person)
    }

    /// The phases of a subject.
    pub(super) fn phases_of(&self, subject: &Subject) -> &[Phase] {
        self.phases.of(subject)
    }

    /// Returns the length of the phase with this name that was announced at this time [s]; `None` if no such phase
    /// began, or if it has not ended.
    pub(super) fn length_secs(
        &self,
        subject: &Subject,
        label: &str,
        announced: Time,
    ) -> Option<f64> {
        let phases = self.phases.of(subject);
        let since = &phases[phases.partition_point(|phase| phase.begin < announced)..];
        let begin = since.first()?.begin;
        // A subject's own phase follows the session's phase that it replaces.
        let replacing = since.iter().take_while(|phase| phase.begin == begin).last()?;
        let end = replacing.end.filter(|_| replacing.label == label)?;
        Some(end.secs_since(announced))
    }

    /// The phase of an event: the current one or, for a self-report, the phase to which it refers.
    pub(super) fn phase_of(&self, subject: &Subject, event: &Event, at: Time) -> Option<&str> {
        let just_ended = self.just_ended(subject, at).filter(|_| is_self_report(event));
        just_ended.or_else(|| self.section(subject, at).phase)
    }

    /// A subject's phase that has just ended.
    fn just_ended(&self, subject: &Subject, at: Time) -> Option<&str> {
        let phases = self.phases.of(subject);
        let has_just_ended = |phase: &&Phase| {
            let after_ns = phase.end.map(|end| at.nanos_since(end));
            after_ns.is_some_and(|after_ns| (0..JUST_ENDED_NS).contains(&after_ns))
        };
        let begun = &phases[..phases.partition_point(|phase| phase.begin <= at)];
        let newest = &begun[begun.len().saturating_sub(2)..];
        newest.iter().find(has_just_ended).map(|phase| phase.label.as_str())
    }

    /// A subject's phase, or pause between phases, at a time.
    pub(super) fn section(&self, subject: &Subject, at: Time) -> Section<'_> {
        let phases = self.phases.of(subject);
        let next = phases.partition_point(|phase| phase.begin <= at);
        let next_begin = phases.get(next).map(|phase| phase.begin);
        match next.checked_sub(1).map(|last| &phases[last]) {
            Some(last) if last.end.is_none_or(|end| at < end) => Section {
                phase: Some(&last.label),
                begin: last.begin,
                end: last.end.or(next_begin),
            },
            last => {
                let begin = last.and_then(|last| last.end).unwrap_or(self.began());
                Section { phase: None, begin, end: next_begin }
            }
        }
    }
}

/// Whether an event is a rating, rather than a note: one with a number, or of the Instantaneous Self-Assessment.
pub(super) fn is_self_report(event: &Event) -> bool {
    event.kind == EventKind::Report && (!event.value.is_nan() || Isa::read(event).is_some())
}

/// The subject in one word: the id, `team` or `session`.
pub(super) fn word_of(subject: &Subject) -> &str {
    match subject.about {
        _ if !subject.id.is_empty() => &subject.id,
        About::Person => "person",
        About::Robot => "robot",
        About::Team => "team",
        About::Session => "session",
    }
}

/// Replaces a time that would be written as `-0` in steps of this size.
fn positive_zero(secs: f64, step: f64) -> f64 {
    if secs < 0.0 && secs >= -step / 2.0 { 0.0 } else { secs }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_time_is_a_negative_zero() {
        let mut timeline = Timeline::default();
        let began = Time::from_nanos(1_700_000_000_000_000_000);
        timeline.began = Some(began);
        let after = Time::from_nanos(began.nanos() + 1_234_567);
        assert_eq!(format!("{:.9}", timeline.secs(after)), "0.001234567");
        let before = Time::from_nanos(began.nanos() - 400_000);
        assert_eq!(
            format!("{:.3} {}", timeline.secs(before), timeline.tenths(before)),
            "0.000 0.0"
        );
        let sooner = Time::from_nanos(began.nanos() - 60_000_000);
        assert_eq!(
            format!("{:.3} {}", timeline.secs(sooner), timeline.tenths(sooner)),
            "-0.060 -0.1"
        );
    }
}
