//! The board: the latest state of every person, robot and stream.

mod watched;
mod watching;
mod troubles;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use teampulse_core::alerts::{Alert, holds_alerts};
use teampulse_core::counted::counted;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues};
use teampulse_core::phases::Phases;
use teampulse_core::sample::{Record, Sample};
use teampulse_core::session_streams::session_events;
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{About, Origin, Signal, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use super::estimates::{Estimates, is_estimate};
use super::event_text::event_text;
use super::faults::Faults;
use super::format::clock;
use super::natural::Name;
use super::person::{Detail, Person};
use super::robot::Figures;
use super::styled_line::{Style, StyledLine, first_columns};
use super::team::Team;
use watched::{Watched, full_line};

/// How many of the newest lines of the log are kept.
const LOG: usize = 2000;

/// The maximum width of a name [columns].
const NAME_COLUMNS: usize = 16;

/// The latest state of every person, robot and stream.
#[derive(Debug, Default)]
pub struct Board {
    /// The session's streams.
    known: Streams,
    streams: BTreeMap<Name, Watched>,
    phases: Phases,
    /// The subjects with separate phases, to which the session's phases do not apply.
    own_phases: BTreeSet<Subject>,
    team: Team,
    people: BTreeMap<Name, Person>,
    robots: BTreeMap<Name, Figures>,
    estimates: BTreeMap<String, Estimates>,
    faults: Faults,
    log: VecDeque<String>,
    began: Option<Time>,
    /// How long the session has been watched, by this machine's clock [s].
    watched_secs: f64,
    now: Time,
    /// Whether markers arrived, which have no separate stream.
    has_markers: bool,
}

/// The health of the streams of one subject.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Health {
    fine: usize,
    all: usize,
}

impl Board {
    /// Sets the streams in which the subject of a status is looked up.
    pub fn know(&mut self, streams: &Streams) {
        self.known = streams.clone();
    }

    /// Takes a record; returns lines for each changed state and each event.
    pub fn take(&mut self, record: &Record) -> Vec<String> {
        self.now = record.sample.log_time;
        self.began.get_or_insert(self.now);
        match &record.sample.data {
            Data::Status(status) => self.take_status(status).into_iter().collect(),
            Data::Event(event) => self.take_event(&record.stream, &record.sample, event),
            Data::Feature(values) => {
                self.take_figures(&record.stream, values, record.sample.measured);
                Vec::new()
            }
            _ => Vec::new(),
        }
    }

    /// Takes a log line that is not an event: a note on the study, a warning.
    pub fn note(&mut self, line: &str) {
        self.log.push_back(line.to_owned());
        if self.log.len() > LOG {
            self.log.pop_front();
        }
    }

    /// Marks all current faults as seen.
    pub fn see_faults(&mut self) {
        self.faults.see();
    }

    fn take_status(&mut self, status: &StreamStatus) -> Option<String> {
        let is_happening = self.is_happening(status);
        let name = Name(status.name.clone());
        let stream = self.streams.entry(name).or_insert_with(|| Watched::new(status));
        let is_news = stream.take(status, is_happening);
        is_news.then(|| format!("{} {}", clock_time(self.now), full_line(status)))
    }

    fn take_event(&mut self, stream: &Stream, sample: &Sample, event: &Event) -> Vec<String> {
        let own = self.take_phase(stream, sample, event);
        self.team.take_event(stream, event, self.now);
        self.has_markers |= event.kind == EventKind::Marker;
        if is_of_session(stream, event) {
            self.faults.take(&event.label, self.now);
        }
        let time = clock_time(self.now);
        let lines = event_text(stream, event).into_iter().chain(own);
        let lines: Vec<String> = lines.map(|line| format!("{time} {line}")).collect();
        for line in &lines {
            self.note(line);
        }
        lines
    }

    /// Takes a phase; returns a line if the session's phases no longer apply to its person or robot.
    fn take_phase(&mut self, stream: &Stream, sample: &Sample, event: &Event) -> Option<String> {
        self.phases.join(sample.stream, stream);
        self.phases.push(sample);
        let subject = stream.subject();
        let is_own = event.kind == EventKind::Phase
            && stream.origin == Origin::Raw
            && matches!(stream.about, About::Person | About::Robot);
        let has_two = is_own && !self.phases.of(&Subject::session()).is_empty();
        (has_two && self.own_phases.insert(subject)).then(|| {
            let id = &stream.id;
            format!("{id} has separate phases: the session's phases don't apply to {id}")
        })
    }

    fn take_figures(&mut self, stream: &Stream, values: &FeatureValues, at: Time) {
        self.team.take(stream, values);
        let id = || Name(stream.id.clone());
        match stream.about {
            _ if stream.id.is_empty() => {}
            About::Robot => self.robots.entry(id()).or_default().take(stream, values, at),
            About::Person if is_estimate(stream) => {
                self.estimates.entry(stream.id.clone()).or_default().take(stream, values);
            }
            About::Person => self.people.entry(id()).or_default().take(stream, values, at),
            About::Team | About::Session => {}
        }
    }

    /// The time of the session, and how long it has run [s].
    pub(super) fn now(&self) -> (Time, f64) {
        (self.now, self.elapsed_secs())
    }

    /// The current phase and how long it lasts: the phase of the only person, or else of the session. The session's
    /// phase is added if it differs, and then the next phase.
    pub(super) fn phase(&self, next: Option<&str>) -> StyledLine {
        let mut people = self.people.keys();
        let (subject, who) = match (people.next(), people.next()) {
            (Some(Name(id)), None) => {
                (Subject { about: About::Person, id: id.clone() }, format!("{id}  "))
            }
            (Some(_), Some(_)) => (Subject::session(), format!("{} people  ", self.people.len())),
            (None, _) => (Subject::session(), String::new()),
        };
        let mut line = StyledLine::of(Style::Plain, &who).with_line(self.phase_of(&subject));
        let label = |subject| self.phases.of(subject).last().map(|phase| phase.label.as_str());
        let is_other = label(&subject) != label(&Subject::session());
        if is_other && self.own_phases.contains(&subject) {
            let session = self.phase_of(&Subject::session());
            line = line.with(Style::Plain, "   session: ").with_line(session);
        }
        if let Some(next) = next {
            line.add(Style::Grey, &format!("   next {next}"));
        }
        line
    }

    fn phase_of(&self, subject: &Subject) -> StyledLine {
        let last = self.phases.of(subject).last();
        let is_over = |end: Time| end <= self.now;
        match last {
            None => StyledLine::of(Style::Grey, "no phase yet"),
            Some(phase) if phase.end.is_some_and(is_over) => {
                StyledLine::of(Style::Grey, &format!("no phase, {} is over", phase.label))
            }
            Some(phase) => {
                let lasts = match phase.end {
                    Some(end) => format!(", {} left", clock(end.secs_since(self.now).ceil())),
                    None => format!(" for {}", clock(self.now.secs_since(phase.begin))),
                };
                StyledLine::of(Style::Strong, &phase.label).with(Style::Plain, &lasts)
            }
        }
    }

    /// Who is present.
    pub(super) fn attendance(&self) -> StyledLine {
        StyledLine::of(Style::Plain, &self.team.line(self.robots.len()).unwrap_or_default())
    }

    /// Each person and robot with their figures, and how many of their streams are fine.
    pub(super) fn team_lines(&self, detail: Detail) -> Vec<StyledLine> {
        let mut lines = Vec::new();
        let mut health = self.health();
        let silent = |name: &str| {
            let stream = self.streams.get(&Name(name.to_owned()))?;
            let StreamStatus { state, age_secs, .. } = &stream.status;
            matches!(state, State::Stale | State::Dead).then_some(*age_secs)
        };
        for (id, person) in &self.people {
            let subject = Subject { about: About::Person, id: id.0.clone() };
            let mut line = StyledLine::of(Style::Strong, &id.0).with(Style::Plain, "  ");
            if self.people.len() > 1 {
                line = line.with_line(self.phase_of(&subject)).with(Style::Plain, "  ");
            }
            lines.push(line.with_line(streams(health.remove(&Some(id.clone())))));
            lines.extend(person.lines(self.now, &silent, detail));
        }
        let estimates = self.estimates.iter().map(|(id, estimates)| estimates.line(id));
        lines.extend(estimates.map(|line| StyledLine::of(Style::Plain, &line)));
        let width = self.robots.keys().map(|Name(id)| id.chars().count()).max().unwrap_or(0);
        let width = width.clamp(5, NAME_COLUMNS);
        for (id, figures) in &self.robots {
            let shown = first_columns(&id.0, width);
            let line = figures.line(shown, width, self.now);
            let own = health.remove(&Some(id.clone()));
            let is_offline = figures.is_offline();
            lines.push(if is_offline {
                line
            } else {
                line.up_to(width + 63).with_line(streams(own))
            });
        }
        if let Some(others) = health.remove(&None) {
            lines.push(StyledLine::of(Style::Strong, "other  ").with_line(streams(Some(others))));
        }
        lines
    }

    /// The health of the streams of each subject, and of the streams about nobody.
    fn health(&self) -> BTreeMap<Option<Name>, Health> {
        let mut health: BTreeMap<Option<Name>, Health> = BTreeMap::new();
        for status in self.statuses() {
            let of = health.entry(self.owner(status).0).or_default();
            of.all += 1;
            of.fine += usize::from(!self.is_trouble(status));
        }
        health
    }

    /// The log, the oldest line first.
    pub(super) fn log(&self) -> &VecDeque<String> {
        &self.log
    }

    fn statuses(&self) -> impl Iterator<Item = &StreamStatus> {
        self.streams.values().map(|stream| &stream.status)
    }

    fn is_trouble(&self, status: &StreamStatus) -> bool {
        let is_awaited = status.state == State::Never && self.is_happening(status);
        status.state != State::Ok && !is_awaited
    }

    fn stream(&self, status: &StreamStatus) -> Option<Arc<Stream>> {
        self.known.find(status.topic()).map(|(_, stream)| stream)
    }

    /// Whether a status is about a stream of events, for which silence is normal.
    fn is_happening(&self, status: &StreamStatus) -> bool {
        let is_one = |stream: Arc<Stream>| matches!(stream.signal, Signal::Event | Signal::Input);
        self.stream(status).is_some_and(is_one)
    }

    /// The person or robot of a stream, if on the board, and the stream's name within that namespace; otherwise the
    /// stream's full name.
    fn owner<'a>(&self, status: &'a StreamStatus) -> (Option<Name>, &'a str) {
        let subject = self.stream(status).map(|stream| stream.subject());
        let owned = subject.and_then(|subject| {
            let id = Name(subject.id.clone());
            let is_shown = match subject.about {
                About::Robot => self.robots.contains_key(&id),
                About::Person => self.people.contains_key(&id),
                About::Team | About::Session => false,
            };
            is_shown.then(|| (Some(id), subject.within(&status.name)))
        });
        owned.unwrap_or((None, &status.name))
    }

    /// The summary at the end of the session.
    pub fn summary(&self) -> Vec<String> {
        let total = |count: fn(&StreamStatus) -> u64| self.statuses().map(count).sum::<u64>();
        let unknown = self.statuses().filter(|each| each.lost_source.is_none()).count();
        let mut lines = vec![format!(
            "{:.0} s, {}, {}; lost on the way {}{}, in our queue {}; late {}, duplicate {}",
            self.elapsed_secs(),
            counted(self.streams.len(), "stream", "streams"),
            counted(total(|each| each.received), "message", "messages"),
            total(|each| each.lost_source.unwrap_or(0)),
            if unknown > 0 {
                format!(" (unknown for {})", counted(unknown, "stream", "streams"))
            } else {
                String::new()
            },
            total(|each| each.lost_queue),
            total(|each| each.late),
            total(|each| each.duplicates),
        )];
        if self.has_nothing() {
            lines.push("no stream ever appeared: nothing named in the study was present".into());
        }
        let faults = self.faults.all().iter();
        lines.extend(faults.map(|fault| format!("fault: {}", fault.words())));
        let needs = self.team.needs();
        lines.extend(needs.map(|need| format!("{} {}: {}", need.who, need.words(), need.why)));
        let troubled = self.statuses().filter(|status| self.is_trouble(status));
        lines.extend(troubled.map(|status| format!("  {}", full_line(status))));
        lines
    }

    /// Whether nothing that the study names has sent anything.
    fn has_nothing(&self) -> bool {
        self.streams.is_empty() && !self.has_markers
    }

    /// Sets how long the session has been watched, by this machine's clock [s].
    pub(super) fn watch(&mut self, secs: f64) {
        self.watched_secs = secs;
    }

    /// The duration of the session; if nothing reports its time, how long it was watched [s].
    fn elapsed_secs(&self) -> f64 {
        let recorded_secs = self.began.map_or(0.0, |began| self.now.secs_since(began));
        if self.streams.is_empty() { recorded_secs.max(self.watched_secs) } else { recorded_secs }
    }
}

/// How many streams are fine.
fn streams(health: Option<Health>) -> StyledLine {
    let Health { fine, all } = health.unwrap_or_default();
    if fine == all {
        StyledLine::of(Style::Grey, &format!("{all} ok"))
    } else {
        StyledLine::of(Style::Plain, &format!("{fine} of {all} ok"))
    }
}

/// The time of day in UTC.
pub(super) fn clock_time(time: Time) -> String {
    time.to_string()[11..19].to_owned()
}

/// Whether an event is a fault of the session itself: a fault among the session's own events, or about an alert of the
/// study that watches nothing.
fn is_of_session(stream: &Stream, event: &Event) -> bool {
    let is_of_alerts = || holds_alerts(stream) && Alert::read(&event.label).is_none();
    event.kind == EventKind::Fault && (stream.name == session_events().name || is_of_alerts())
}

#[cfg(test)]
pub(super) mod tests;
