//! The course of a session: when it began, and what was going on when.

use teampulse_core::phases::{Phase, Phases};
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Stream, Subject};
use teampulse_core::time::Time;

/// When a session began, and the phases of everyone in it.
#[derive(Debug, Default)]
pub(super) struct Course {
    began: Option<Time>,
    now: Time,
    phases: Phases,
}

/// A time of somebody without a change: within one phase, or between two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Section<'a> {
    /// The phase that it is; `None` between phases.
    pub(super) phase: Option<&'a str>,
    /// When it begins.
    pub(super) begin: Time,
    /// When it ends, as far as that is known.
    pub(super) end: Option<Time>,
}

impl Course {
    /// Takes in what came next. A session begins with the first that is known of it.
    pub(super) fn take(&mut self, record: &Record) {
        let sample = &record.sample;
        self.began.get_or_insert(sample.log_time);
        self.now = sample.log_time;
        self.phases.join(sample.stream, &record.stream);
        self.phases.push(sample);
    }

    /// When the session began.
    pub(super) fn began(&self) -> Time {
        self.began.unwrap_or(self.now)
    }

    /// The newest that is known of it.
    pub(super) fn now(&self) -> Time {
        self.now
    }

    /// How long after the session's begin a moment is [s].
    pub(super) fn secs(&self, at: Time) -> f64 {
        at.secs_since(self.began())
    }

    /// The phases of somebody.
    pub(super) fn phases_of(&self, subject: &Subject) -> &[Phase] {
        self.phases.of(subject)
    }

    /// What was going on for somebody at a moment.
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

/// Whom a stream is about, in a word: its id, `team` or `session`.
pub(super) fn word_of(stream: &Stream) -> &str {
    match stream.about {
        _ if !stream.id.is_empty() => &stream.id,
        About::Person => "person",
        About::Robot => "robot",
        About::Team => "team",
        About::Session => "session",
    }
}
