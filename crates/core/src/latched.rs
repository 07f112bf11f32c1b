//! State that was published once and still applies: when a recording continues in another bag, that bag begins with it.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::computers::ClockReport;
use crate::data::{Data, Event, EventKind};
use crate::loss::Loss;
use crate::phases::Phases;
use crate::publishers::PublishedBy;
use crate::sample::Record;
use crate::stopped::Stopped;
use crate::stream::{About, Stream, StreamId};
use crate::time::Time;

/// The most events that are kept, to bound memory; no session has that many topics.
const MOST: usize = 100_000;

/// The newest event of each kind of state: the phase of the session and of each person and robot, which computer's
/// clock stamps a stream, which publishers a topic has, whether its losses can be counted.
#[derive(Clone, Debug, Default)]
pub struct Latched(BTreeMap<(Rank, StreamId, String), Record>);

/// An event that still applies, in the form in which it can be published again at a later time.
#[derive(Clone, Debug, PartialEq)]
pub struct StandingEvent {
    /// The id of the event's stream.
    pub id: StreamId,
    /// The event's stream.
    pub stream: Arc<Stream>,
    /// The event.
    pub event: Event,
    /// The device's clock at that time [ns], if it stamped the event.
    pub device_time: Option<i64>,
    /// The publisher's clock at that time, if it stamped the event: a replay corrects it like the first stamp.
    pub source_time: Option<Time>,
}

/// The order of publication. A person's own phases come before those of the session, which would otherwise
/// apply to the person, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Origin,
    OwnPhase,
    Phase,
}

impl Latched {
    /// Takes in an event. Of two events about the same state the newer one applies, in whichever order they arrive.
    pub fn take(&mut self, record: &Record) {
        let Data::Event(event) = &record.sample.data else { return };
        let Some((rank, about)) = about(record, event) else { return };
        let key = (rank, record.sample.stream, about);
        let is_room = self.0.len() < MOST;
        let log_time = record.sample.log_time;
        match self.0.get(&key) {
            Some(known) if known.sample.log_time > log_time => {}
            None if !is_room => {}
            _ => drop(self.0.insert(key, record.clone())),
        }
    }

    /// The state at a time, as events to publish then, in order; a phase has its remaining length.
    pub fn at(&self, at: Time) -> Vec<StandingEvent> {
        let valid = self.0.iter().filter(|(_, record)| record.sample.log_time <= at);
        let valid = valid.filter_map(|((rank, id, _), record)| {
            let Data::Event(event) = &record.sample.data else { return None };
            let (id, stream, sample) = (*id, Arc::clone(&record.stream), &record.sample);
            if *rank == Rank::Origin {
                let event = countable(&record.stream, event);
                return Some(StandingEvent {
                    id,
                    stream,
                    event,
                    device_time: None,
                    source_time: None,
                });
            }
            let since_ns = at.nanos_since(sample.measured);
            let event = rest(event, at.secs_since(sample.measured));
            let device_time = sample.device_time.map(|ticks| ticks.saturating_add(since_ns));
            let later = |stamp: Time| Time::from_nanos(stamp.nanos().saturating_add(since_ns));
            let source_time = sample.source_time.map(later);
            Some(StandingEvent { id, stream, event, device_time, source_time })
        });
        valid.collect()
    }
}

/// The key of an event that applies until another event has the same key; `None` for any other event.
fn about(record: &Record, event: &Event) -> Option<(Rank, String)> {
    let Record { stream, sample, .. } = record;
    let of_session = stream.about == About::Session;
    let is_phase = event.kind == EventKind::Phase && Phases::hears(stream);
    if is_phase {
        let rank = if of_session { Rank::Phase } else { Rank::OwnPhase };
        return Some((rank, String::new()));
    }
    if Loss::of_stream(stream) == Some(Loss::OnTheWay) {
        return Some((Rank::Origin, event.label.clone()));
    }
    let topic = match ClockReport::read(stream, &sample.data).filter(|_| of_session) {
        Some(ClockReport::StampedBy { stream, .. }) => stream,
        Some(ClockReport::Probed { .. }) => return None,
        None => match Stopped::read(stream, &sample.data) {
            Some(stopped) => stopped.stream,
            None => PublishedBy::read(stream, &sample.data)?.stream,
        },
    };
    Some((Rank::Origin, topic))
}

/// An event as it can be published again. A count of losses becomes 0, as none has occurred since; only whether losses
/// can be counted still applies.
fn countable(stream: &Stream, event: &Event) -> Event {
    let is_count = Loss::of_stream(stream).is_some() && event.value.is_finite();
    Event { value: if is_count { 0.0 } else { event.value }, ..event.clone() }
}

/// A phase as it can be published this long after it began [s]: with its remaining length, or without a name if it is
/// over.
fn rest(event: &Event, since_secs: f64) -> Event {
    let is_over = event.duration_secs > 0.0 && event.duration_secs <= since_secs;
    if is_over {
        return Event { label: String::new(), duration_secs: 0.0, ..event.clone() };
    }
    let has_length = event.duration_secs > 0.0;
    let left_secs = event.duration_secs - since_secs.max(0.0);
    let duration_secs = if has_length { left_secs } else { event.duration_secs };
    Event { duration_secs, ..event.clone() }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::computers::STAMPED_BY;
    use crate::sample::{Sample, Turn};
    use crate::session_streams::session_events;
    use crate::stream::{Shape, Subject};

    fn person() -> Stream {
        let subject = Subject { about: About::Person, id: "p001".into() };
        Stream::raw("/humans/persons/p001/task/phases", subject, Shape::Event)
    }

    fn stamped_by() -> Stream {
        Stream::raw(STAMPED_BY, Subject::session(), Shape::Event)
    }

    fn reported(stream: &Stream, id: u32, secs: i32, event: Event) -> Record {
        let at = Time::from_stamp(secs, 0);
        let sample = Sample {
            stream: StreamId(id),
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Event(Arc::new(event)),
        };
        Record { stream: Arc::new(stream.clone()), sample, cdr: Bytes::new() }
    }

    fn event(kind: EventKind, label: &str, duration_secs: f64) -> Event {
        Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs }
    }

    fn phase(label: &str, duration_secs: f64) -> Event {
        event(EventKind::Phase, label, duration_secs)
    }

    fn at(latched: &Latched, secs: i32) -> Vec<(u32, String, f64)> {
        let valid = latched.at(Time::from_stamp(secs, 0)).into_iter();
        valid.map(|each| (each.id.0, each.event.label, each.event.duration_secs)).collect()
    }

    #[test]
    fn a_phase_that_goes_on_has_its_remaining_length() {
        let mut latched = Latched::default();
        latched.take(&reported(&session_events(), 0, 10, phase("baseline", 60.0)));
        assert_eq!(at(&latched, 5), [], "it has not begun");
        assert_eq!(at(&latched, 30), [(0, "baseline".into(), 40.0)]);
        assert_eq!(at(&latched, 70), [(0, String::new(), 0.0)]);
        latched.take(&reported(&session_events(), 0, 80, phase("task", f64::NAN)));
        let [(0, label, left_secs)] = &at(&latched, 90)[..] else { panic!() };
        assert!(label == "task" && left_secs.is_nan());
    }

    #[test]
    fn a_phase_that_goes_on_is_stamped_by_the_clock_that_stamped_it() {
        let mut latched = Latched::default();
        let mut record = reported(&person(), 7, 10, phase("1-back", 20.0));
        // A device that has counted for 1000 s, behind a computer that is an hour ahead.
        record.sample.device_time = Some(1_000_000_000_000);
        record.sample.source_time = Some(Time::from_stamp(3610, 0));
        latched.take(&record);
        let [standing] = &latched.at(Time::from_stamp(14, 0))[..] else { panic!() };
        assert_eq!(standing.device_time, Some(1_004_000_000_000));
        assert_eq!(standing.source_time, Some(Time::from_stamp(3614, 0)));
        assert!((standing.event.duration_secs - 16.0).abs() < 1e-9);
        let mut latched = Latched::default();
        latched.take(&reported(&person(), 7, 10, phase("1-back", 20.0)));
        let [standing] = &latched.at(Time::from_stamp(14, 0))[..] else { panic!() };
        assert_eq!((standing.device_time, standing.source_time), (None, None));
    }

    #[test]
    fn the_newest_event_is_valid_in_whichever_order_it_is_taken() {
        let mut latched = Latched::default();
        latched.take(&reported(&session_events(), 0, 20, phase("task", 60.0)));
        latched.take(&reported(&session_events(), 0, 10, phase("baseline", 60.0)));
        assert_eq!(at(&latched, 30), [(0, "task".into(), 50.0)]);
    }

    #[test]
    fn a_stream_whose_losses_can_be_counted_has_lost_nothing_yet() {
        let mut latched = Latched::default();
        let of = |secs, value| {
            let lost = Event { value, ..event(EventKind::Fault, "/r1/odom", 0.0) };
            reported(&Loss::OnTheWay.stream(), 9, secs, lost)
        };
        let value = |latched: &Latched| latched.at(Time::from_stamp(30, 0))[0].event.value;
        latched.take(&of(10, 3.0));
        assert!(value(&latched).abs() < 1e-9);
        latched.take(&of(20, f64::NAN));
        assert!(value(&latched).is_nan(), "they can't be counted any more");
    }

    #[test]
    fn a_subject_s_phases_come_before_the_session_s_and_clocks_before_both() {
        let mut latched = Latched::default();
        latched.take(&reported(&session_events(), 0, 10, phase("baseline", 60.0)));
        latched.take(&reported(&person(), 7, 10, phase("1-back", 20.0)));
        for (secs, label) in [(10, "/r1/odom a"), (11, "/r1/odom b"), (12, "/r2/odom a")] {
            let values_of = event(EventKind::Clock, label, 0.0);
            latched.take(&reported(&stamped_by(), 9, secs, values_of));
        }
        latched.take(&reported(&session_events(), 0, 12, event(EventKind::Marker, "x", 0.0)));
        let expected = [
            (9, "/r1/odom b".to_owned(), 0.0),
            (9, "/r2/odom a".to_owned(), 0.0),
            (7, "1-back".to_owned(), 10.0),
            (0, "baseline".to_owned(), 50.0),
        ];
        assert_eq!(at(&latched, 20), expected);
    }
}
