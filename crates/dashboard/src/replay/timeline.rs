//! The events of a whole recording, read once, independently of the position.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use teampulse_core::computers::UNTOLD;
use teampulse_core::data::{Data, Event};
use teampulse_core::sample::Record;
use teampulse_core::status::State;
use teampulse_core::stream::{About, Origin, Shape, Stream};

use crate::convert;
use crate::hub::{Hub, message};
use crate::replay::Recording;
use crate::wire::{Absence, FromServer, Gap, Timeline};

/// The maximum number of events in a timeline. Events that are shown as they occur have higher numbers.
pub(crate) const MOST_EVENTS: usize = 20_000;

/// Reads a recording and sends its timeline to all viewers, unless the replay ends first.
pub(super) fn read(recording: &dyn Recording, hub: &Hub, is_over: &AtomicBool) {
    let first = hub.began();
    let streams = recording.streams();
    let raw = streams.all().into_iter().filter(|(_, stream)| stream.origin == Origin::Raw);
    let subjects = raw.map(|(_, stream)| (stream.name.clone(), Subject::of(&stream))).collect();
    let mut scan = Scan { hub, subjects, ..Scan::new(hub) };
    for record in recording.records(first, &is_notable) {
        if is_over.load(Ordering::Acquire) {
            return;
        }
        scan.take(&record);
    }
    let timeline = scan.finish();
    let text = message(&FromServer::Timeline(timeline.clone()));
    hub.keep_timeline(timeline);
    for client in hub.clients() {
        client.outbox.urgent(text.clone());
    }
}

/// Whether a stream holds events or the health of other streams.
fn is_notable(stream: &Stream) -> bool {
    matches!(stream.shape, Shape::Event | Shape::Status)
}

/// Whether an event is shown on a timeline; events of a body are not, nor are reports on clocks, which occur every
/// second.
fn is_shown(stream: &Stream, event: &Event) -> bool {
    !convert::is_minor(event) && !UNTOLD.contains(&stream.name.as_str())
}

/// The subject of a stream.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Subject {
    about: &'static str,
    id: String,
}

impl Subject {
    fn of(stream: &Stream) -> Option<Subject> {
        let about = match stream.about {
            About::Person => "person",
            About::Robot => "robot",
            _ => return None,
        };
        Some(Subject { about, id: stream.id.clone() })
    }
}

/// The times at which a subject's streams have data, and the gaps.
#[derive(Debug, Default)]
struct Presence {
    known: BTreeSet<String>,
    silent: BTreeSet<String>,
    since: Option<f64>,
    gaps: Vec<Gap>,
}

impl Presence {
    fn take(&mut self, stream: &str, is_silent: bool, t: f64) {
        self.known.insert(stream.to_owned());
        if is_silent {
            self.silent.insert(stream.to_owned());
        } else {
            self.silent.remove(stream);
        }
        let is_absent = self.silent.len() == self.known.len();
        match self.since {
            None if is_absent => self.since = Some(t),
            Some(from) if !is_absent => {
                self.gaps.push(Gap { from, to: t });
                self.since = None;
            }
            _ => {}
        }
    }
}

/// The results of the scan so far.
struct Scan<'a> {
    hub: &'a Hub,
    subjects: BTreeMap<String, Option<Subject>>,
    presences: BTreeMap<Subject, Presence>,
    timeline: Timeline,
}

impl<'a> Scan<'a> {
    fn new(hub: &'a Hub) -> Scan<'a> {
        let timeline = Timeline { events: Vec::new(), left_out: 0, absences: Vec::new() };
        Scan { hub, subjects: BTreeMap::new(), presences: BTreeMap::new(), timeline }
    }

    fn take(&mut self, record: &Record) {
        let t = self.hub.secs(record.sample.measured);
        match &record.sample.data {
            Data::Event(event) if is_shown(&record.stream, event) => {
                if self.timeline.events.len() == MOST_EVENTS {
                    self.timeline.left_out += 1;
                    return;
                }
                let number = self.timeline.events.len() as u64;
                let event =
                    convert::event(number, record.sample.stream.0, t, &record.stream, event);
                self.timeline.events.push(event);
            }
            Data::Status(status) => {
                let Some(Some(subject)) = self.subjects.get(&status.name) else { return };
                let is_silent = match status.state {
                    State::Never => return,
                    State::Ok | State::Degraded => false,
                    State::Stale | State::Dead => true,
                };
                self.presences.entry(subject.clone()).or_default().take(&status.name, is_silent, t);
            }
            _ => {}
        }
    }

    fn finish(mut self) -> Timeline {
        let end = self.hub.playback().map_or(0.0, |playback| playback.length);
        for (Subject { about, id }, mut presence) in self.presences {
            presence.gaps.extend(presence.since.map(|from| Gap { from, to: end.max(from) }));
            let absence = Absence { subject: id, about, gaps: presence.gaps };
            self.timeline.absences.push(absence);
        }
        self.timeline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn somebody_is_absent_while_all_streams_are_silent() {
        let mut presence = Presence::default();
        for (stream, is_silent, t) in [
            ("/r1/odom", false, 0.0),
            ("/r1/battery", false, 1.0),
            ("/r1/odom", true, 10.0),
            ("/r1/battery", true, 12.0),
            ("/r1/battery", true, 30.0),
            ("/r1/odom", false, 40.0),
            ("/r1/odom", true, 50.0),
        ] {
            presence.take(stream, is_silent, t);
        }
        assert_eq!(presence.gaps, [Gap { from: 12.0, to: 40.0 }]);
        assert_eq!(presence.since, Some(50.0));
    }
}
