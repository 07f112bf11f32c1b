//! The numbers that the alerts of the study watch.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::alerts::FAMILY;
use teampulse_core::qos::Qos;
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;

use super::KEPT_ALERTS;
use super::alerts::{Alerts, Topic};
use super::watched_number::WatchedNumber;
use crate::people::estimates;
use crate::thresholds::Threshold;

/// The time after which an alert that watches nothing is reported [s].
const WATCHED_SECS: f64 = 30.0;

/// The numbers that the alerts of the study watch.
pub(super) struct Watching {
    alerts: Arc<[Threshold]>,
    watches: BTreeMap<StreamId, Vec<WatchedNumber>>,
    /// Whether each alert has ever watched a stream.
    has_stream: Vec<bool>,
    /// When watching began; alerts that watch nothing are reported [`WATCHED_SECS`] later.
    due: Option<Time>,
    is_reported: bool,
}

impl Watching {
    pub(super) fn new(alerts: Arc<[Threshold]>) -> Watching {
        let has_stream = vec![false; alerts.len()];
        Watching { alerts, watches: BTreeMap::new(), has_stream, due: None, is_reported: false }
    }

    /// Adds a stream, or updates a redeclared one.
    pub(super) fn join(&mut self, id: StreamId, stream: &Stream) {
        let numbered = self.alerts.iter().enumerate();
        let mut watches: Vec<WatchedNumber> =
            numbered.filter_map(|alert| WatchedNumber::of(alert, id, stream)).collect();
        for before in self.watches.remove(&id).into_iter().flatten() {
            let of_same = watches.iter().position(|watch| watch.is_same(&before));
            match of_same.map(|place| watches.remove(place)) {
                Some(watch) => watches.push(watch.continuing(&before)),
                None => watches.push(before),
            }
        }
        for watch in &watches {
            self.has_stream[watch.number()] = true;
        }
        if !watches.is_empty() {
            self.watches.insert(id, watches);
        }
    }

    /// The alerts that have watched nothing for a while, in words; reported once.
    pub(super) fn idle(&mut self, now: Time) -> Vec<String> {
        let began = *self.due.get_or_insert(now);
        if now.secs_since(began) < WATCHED_SECS { Vec::new() } else { self.idle_so_far() }
    }

    /// The alerts that have watched nothing so far, in words; reported once, here or after a while.
    pub(super) fn idle_so_far(&mut self) -> Vec<String> {
        if std::mem::replace(&mut self.is_reported, true) {
            return Vec::new();
        }
        let idle = self.has_stream.iter().enumerate().filter(|(_, has_stream)| !**has_stream);
        // The pattern is left out: it may name a person, and this text is published.
        let words = |(place, _)| {
            let number = place + 1;
            format!(
                "alert {number} of the study watches nothing: no stream so far matches its name and number"
            )
        };
        idle.map(words).collect()
    }

    /// Whether the study has no alerts.
    pub(super) fn is_empty(&self) -> bool {
        self.alerts.is_empty()
    }

    /// Where the alerts on a stream are reported.
    pub(super) fn topics_of(&self, id: StreamId) -> impl Iterator<Item = &Topic> {
        self.watches.get(&id).into_iter().flatten().map(WatchedNumber::topic)
    }

    /// Takes in a sample.
    pub(super) fn push(&mut self, sample: &Sample, alerts: &mut Alerts) {
        for watch in self.watches.get_mut(&sample.stream).into_iter().flatten() {
            watch.push(sample, alerts);
        }
    }

    /// Advances the time.
    pub(super) fn tick(&mut self, now: Time, alerts: &mut Alerts) {
        self.watches.values_mut().flatten().for_each(|watch| watch.tick(now, alerts));
    }

    /// Notes that nothing could arrive before `until`.
    pub(super) fn stood_still(&mut self, until: Time) {
        self.watches.values_mut().flatten().for_each(|watch| watch.stood_still(until));
    }
}

/// The stream of a person's alerts, the first of which follows from this input.
pub(super) fn stream_of(topic: &Topic, input: &Stream) -> Option<Stream> {
    let (person, family, leaf) = match topic {
        Topic::Team => return None,
        Topic::Person(person) => (person, FAMILY, "alerts"),
        Topic::Estimates(person) => (person, estimates::FAMILY, "estimates/alerts"),
    };
    let name = format!("/humans/persons/{person}/{leaf}");
    Some(Stream {
        signal: Signal::Event,
        inputs: vec![input.name.clone()],
        method: "a number that stays beyond the limit of one of the study's [[alerts]] for its `for_secs`; unknown while \
                 the number is missing"
            .to_owned(),
        doc: "When the person needs someone, when that is no longer known, and when it is over.".to_owned(),
        qos: vec![Qos::latched(KEPT_ALERTS)],
        ..Stream::concluded(name, Subject::person(person.as_str()), family, Shape::Event)
    })
}
