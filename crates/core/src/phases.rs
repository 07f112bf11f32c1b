//! Phases: the parts of a session that are compared with each other.

use std::collections::BTreeMap;

use crate::data::{Data, Event, EventKind};
use crate::sample::Sample;
use crate::session_streams::{END, session_events};
use crate::stream::{About, Origin, Shape, Stream, StreamId, Subject};
use crate::time::Time;

/// The phase that all others are compared with.
pub const BASELINE: &str = "baseline";

/// The name of a phase that was published with a blank name.
const UNNAMED: &str = "unnamed";

/// The most phases of one subject, to bound memory; no study has that many.
const MOST_PHASES: usize = 10_000;

/// A phase of a session, or of one subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// The phase's name.
    pub label: String,
    /// When the phase begins.
    pub begin: Time,
    /// When the phase ends or ended, if known.
    pub end: Option<Time>,
}

/// The phases of all subjects in a session, as published.
///
/// A phase begins when its event was measured. It ends after the length in its event, else at the start of the next
/// phase, named or not, else with the session. Once a subject has phases on its own stream, those apply to it; to all
/// other subjects the session's phases apply.
#[derive(Clone, Debug, Default)]
pub struct Phases {
    session: Vec<Phase>,
    own: BTreeMap<Subject, Vec<Phase>>,
    of_stream: BTreeMap<StreamId, Subject>,
    is_over: bool,
}

impl Phases {
    /// Whether a stream may contain phases: raw events of the session, of people and of robots.
    pub fn hears(stream: &Stream) -> bool {
        let of_session = stream.about == About::Session && stream.name == session_events().name;
        stream.origin == Origin::Raw
            && stream.shape == Shape::Event
            && (of_session || matches!(stream.about, About::Person | About::Robot))
    }

    /// Adds a stream, if it may contain phases.
    pub fn join(&mut self, id: StreamId, stream: &Stream) {
        if Phases::hears(stream) {
            self.of_stream.insert(id, stream.subject());
        }
    }

    /// Takes in a sample of any stream; returns whether phases have changed.
    pub fn push(&mut self, sample: &Sample) -> bool {
        let (Some(subject), Data::Event(event)) =
            (self.of_stream.get(&sample.stream), &sample.data)
        else {
            return false;
        };
        let of_session = subject.about == About::Session;
        match event.kind {
            EventKind::Phase if of_session => begin(&mut self.session, sample.measured, event),
            EventKind::Phase => {
                let of_session = self.session.last();
                let at = match self.own.get(subject) {
                    None => {
                        of_session.map_or(sample.measured, |last| last.begin.max(sample.measured))
                    }
                    Some(_) => sample.measured,
                };
                let known = self.own.entry(subject.clone());
                begin(known.or_insert_with(|| self.session.clone()), at, event)
            }
            EventKind::Clock if of_session && event.label == END => {
                self.end(sample.measured);
                true
            }
            _ => false,
        }
    }

    /// The phases of a subject in the order of their starts. More may follow, and the end of the last one may become
    /// known or move earlier; all others stay unchanged.
    pub fn of(&self, subject: &Subject) -> &[Phase] {
        self.own.get(subject).unwrap_or(&self.session)
    }

    /// Whether the session has ended, and all phases with it.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Ends the session, and all phases with it: on its closing event, or when a caller knows that there is none.
    pub fn end(&mut self, at: Time) {
        self.is_over = true;
        for phases in self.own.values_mut().chain([&mut self.session]) {
            cut(phases, at);
        }
    }
}

/// The name of a phase with this label: `None` if it only ends the previous one.
pub fn name_of(label: &str) -> Option<&str> {
    let is_blank = label.trim().is_empty();
    (!label.is_empty()).then_some(if is_blank { UNNAMED } else { label })
}

/// Begins a phase and ends the previous one; returns whether anything changed. A phase without a name only ends the
/// previous one.
fn begin(phases: &mut Vec<Phase>, at: Time, event: &Event) -> bool {
    let is_next = phases.last().is_none_or(|last| last.begin <= at);
    if !is_next || phases.len() == MOST_PHASES {
        return false;
    }
    cut(phases, at);
    let Some(label) = name_of(&event.label) else { return true };
    let length_ns = event.duration_secs * 1e9;
    let end = (length_ns > 0.0).then(|| at.nanos().saturating_add(length_ns.round() as i64));
    let label = label.to_owned();
    phases.push(Phase { label, begin: at, end: end.map(Time::from_nanos) });
    true
}

/// Ends the last phase at `at`, unless it has ended earlier.
fn cut(phases: &mut [Phase], at: Time) {
    if let Some(last) = phases.last_mut() {
        last.end = Some(last.end.map_or(at, |end| end.min(at)).max(last.begin));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::sample::Turn;

    const SESSION: StreamId = StreamId(0);
    const OWN: StreamId = StreamId(1);

    fn person() -> Subject {
        Subject { about: About::Person, id: "p001".into() }
    }

    fn phases() -> Phases {
        let mut phases = Phases::default();
        phases.join(SESSION, &session_events());
        phases.join(OWN, &Stream::raw("/humans/persons/p001/task/phases", person(), Shape::Event));
        phases
    }

    fn report(
        phases: &mut Phases,
        on: StreamId,
        secs: i32,
        label: &str,
        duration_secs: f64,
    ) -> bool {
        happen(phases, on, secs, Event { duration_secs, ..event(EventKind::Phase, label) })
    }

    fn event(kind: EventKind, label: &str) -> Event {
        Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs: 0.0 }
    }

    fn happen(phases: &mut Phases, on: StreamId, secs: i32, event: Event) -> bool {
        let at = Time::from_stamp(secs, 0);
        phases.push(&Sample {
            stream: on,
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Event(Arc::new(event)),
        })
    }

    fn reported(phases: &Phases, subject: &Subject) -> Vec<(String, f64, Option<f64>)> {
        let of = phases.of(subject).iter();
        of.map(|each| (each.label.clone(), each.begin.secs(), each.end.map(Time::secs))).collect()
    }

    #[test]
    fn a_phase_ends_after_its_length_or_with_the_next_or_with_the_session() {
        let mut phases = phases();
        report(&mut phases, SESSION, 0, "baseline", 60.0);
        report(&mut phases, SESSION, 90, "task", f64::NAN);
        report(&mut phases, SESSION, 150, "rest", 60.0);
        let until = |rest_secs| {
            [("baseline", 0.0, 60.0), ("task", 90.0, 150.0), ("rest", 150.0, rest_secs)]
                .map(|(label, begin, end)| (label.to_owned(), begin, Some(end)))
        };
        assert_eq!(reported(&phases, &person()), until(210.0));
        assert!(!phases.is_over());
        happen(&mut phases, SESSION, 200, event(EventKind::Clock, END));
        assert_eq!(reported(&phases, &person()), until(200.0));
        assert!(phases.is_over());
    }

    #[test]
    fn a_subject_with_own_phases_has_those_from_then_on() {
        let mut phases = phases();
        report(&mut phases, SESSION, 0, "baseline", 60.0);
        report(&mut phases, OWN, 10, "1-back", f64::NAN);
        report(&mut phases, SESSION, 60, "faults", f64::NAN);
        let [baseline, own] = [("baseline", 0.0, Some(10.0)), ("1-back", 10.0, None)]
            .map(|(label, begin, end)| (label.to_owned(), begin, end));
        assert_eq!(reported(&phases, &person()), [baseline, own]);
        assert_eq!(reported(&phases, &Subject::robot("robot1"))[1].0, "faults");
    }

    #[test]
    fn own_phases_replace_the_session_s_even_when_that_began_a_moment_later() {
        let mut phases = phases();
        report(&mut phases, SESSION, 3, "baseline", 60.0);
        assert!(report(&mut phases, OWN, 2, "1-back", f64::NAN));
        assert!(!report(&mut phases, OWN, 1, "2-back", f64::NAN));
        let events = reported(&phases, &person());
        assert_eq!(events[0], ("baseline".to_owned(), 3.0, Some(3.0)));
        assert_eq!(events[1], ("1-back".to_owned(), 3.0, None));
    }

    #[test]
    fn other_events_and_phases_before_the_last_one_change_nothing() {
        let mut phases = phases();
        assert!(report(&mut phases, SESSION, 10, "baseline", f64::NAN));
        assert!(!report(&mut phases, SESSION, 5, "task", f64::NAN));
        assert!(!happen(&mut phases, SESSION, 20, event(EventKind::Marker, "task")));
        assert!(!happen(&mut phases, OWN, 20, event(EventKind::Clock, END)));
        assert!(!report(&mut phases, StreamId(7), 20, "task", f64::NAN));
        assert_eq!(reported(&phases, &person()), [("baseline".to_owned(), 10.0, None)]);
    }

    #[test]
    fn a_phase_without_a_name_only_ends_the_one_before() {
        let mut phases = phases();
        report(&mut phases, SESSION, 10, "task", 60.0);
        assert!(report(&mut phases, SESSION, 30, "", 0.0));
        assert_eq!(reported(&phases, &person()), [("task".to_owned(), 10.0, Some(30.0))]);
    }

    #[test]
    fn endless_phases_are_taken_up_to_a_bound() {
        let mut phases = phases();
        let taken = (0..20_000).filter(|&secs| report(&mut phases, SESSION, secs, "x", f64::NAN));
        assert_eq!(taken.count(), MOST_PHASES);
    }
}
