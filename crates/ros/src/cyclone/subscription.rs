//! Our subscriptions: each has a reader, which is replaced when the offered QoS changes.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use teampulse_core::qos::Qos;
use teampulse_core::time::Time;
use tokio::sync::broadcast;

use super::domain::Participant;
use super::duplicates::Duplicates;
use super::names;
use super::reader::{Reader, ReaderEvent};
use super::site::Site;
use super::type_server::shipped_hash;
use crate::bus::{Asked, Deliver, Incident};
use crate::graph::{Endpoint, Graph};
use crate::offer;

/// How long a replaced reader is kept, so that nothing is lost until publishers have matched the new one.
const OVERLAP: Duration = Duration::from_secs(2);

/// A subscription to one topic.
pub(super) struct Listening {
    /// Declared before `participant`, which the readers use, to be dropped first.
    readers: Mutex<Readers>,
    participant: Arc<Participant>,
    topic: String,
    type_name: String,
    asked: Asked,
    events: Arc<ReaderEvents>,
}

/// The handler of a subscription's reader events.
struct ReaderEvents {
    topic: String,
    adaptive: bool,
    deliver: Deliver,
    incidents: broadcast::Sender<Incident>,
    duplicates: Mutex<Duplicates>,
    deadlines_missed: AtomicU64,
}

#[derive(Default)]
struct Readers {
    current: Option<(Qos, Reader)>,
    retired: Vec<(Time, Reader)>,
    closed: bool,
}

impl Listening {
    /// Subscribes to a ROS topic and type, with the QoS that the graph suggests.
    pub(super) fn begin(
        site: &Site,
        (topic, type_name): (&str, &str),
        asked: Asked,
        deliver: Deliver,
    ) -> Result<Listening, String> {
        let events = Arc::new(ReaderEvents {
            topic: topic.to_owned(),
            adaptive: matches!(asked, Asked::Adaptive { .. }),
            deliver,
            incidents: site.incidents.clone(),
            duplicates: Mutex::default(),
            deadlines_missed: AtomicU64::new(0),
        });
        let (topic, type_name) = (topic.to_owned(), type_name.to_owned());
        let (readers, participant) = (Mutex::default(), Arc::clone(&site.participant));
        let listening = Listening { readers, participant, topic, type_name, asked, events };
        let graph = Arc::clone(&site.graph.borrow());
        listening.adapt(&graph, Time::EPOCH)?;
        Ok(listening)
    }

    /// The ROS topic.
    pub(super) fn topic(&self) -> &str {
        &self.topic
    }

    /// Replaces the reader if the offered QoS requires it, and removes old readers. Returns whether no old reader is
    /// left.
    pub(super) fn adapt(&self, graph: &Graph, now: Time) -> Result<bool, String> {
        let mut readers = self.lock();
        readers.retired.retain(|(until, _)| *until > now);
        let offers: Vec<&Endpoint> = graph
            .publishers(&self.topic)
            .filter(|offer| offer.type_name == self.type_name && !offer.own)
            .collect();
        let wanted = self.wanted(&offers, readers.current.as_ref().map(|(qos, _)| qos));
        let fits = readers.current.as_ref().is_some_and(|(qos, _)| *qos == wanted);
        if fits || readers.closed {
            return Ok(readers.retired.is_empty());
        }
        let reader = self.open(&wanted, &offers)?;
        if let Some((_, old)) = readers.current.replace((wanted, reader)) {
            readers.retired.push((now + OVERLAP, old));
        }
        Ok(readers.retired.is_empty())
    }

    /// Closes the subscription; nothing is delivered after it returns.
    pub(super) fn close(&self) {
        let mut readers = self.lock();
        *readers = Readers { closed: true, ..Readers::default() };
    }

    /// The QoS to request. Without offers, the last choice is kept, but without a deadline, as nobody offers one.
    fn wanted(&self, offers: &[&Endpoint], current: Option<&Qos>) -> Qos {
        match (&self.asked, current) {
            (Asked::Exactly(qos), _) => qos.clone(),
            (Asked::Adaptive { .. }, Some(current)) if offers.is_empty() => {
                Qos { deadline: None, ..current.clone() }
            }
            (Asked::Adaptive { depth }, _) => {
                offer::suiting_all(offers.iter().map(|offer| &offer.qos), *depth)
            }
        }
    }

    fn open(&self, qos: &Qos, offers: &[&Endpoint]) -> Result<Reader, String> {
        let (topic, type_name) = (names::dds_topic(&self.topic), names::dds_type(&self.type_name));
        // Without an offer, the hash of the shipped definition is used, as standard tools warn if there is none.
        let offered = offers.iter().find(|offer| !offer.type_hash.is_empty());
        let shipped = || shipped_hash(&self.type_name);
        let user_data = offered.map_or_else(shipped, |offer| names::user_data(&offer.type_hash));
        let events = Arc::clone(&self.events);
        let report = Box::new(move |event| events.hear(event));
        Reader::open(&self.participant, (&topic, &type_name), qos, &user_data, report)
    }

    fn lock(&self) -> MutexGuard<'_, Readers> {
        self.readers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ReaderEvents {
    fn hear(&self, event: ReaderEvent) {
        match event {
            ReaderEvent::Arrived(arrival) => {
                let mut duplicates = self.duplicates.lock().unwrap_or_else(PoisonError::into_inner);
                let is_new = duplicates.first_time(arrival.publisher, arrival.sequence);
                drop(duplicates);
                if is_new {
                    (self.deliver)(arrival);
                }
            }
            // The reader is about to be replaced by a reader that requests less.
            ReaderEvent::Incompatible(_) if self.adaptive => {}
            ReaderEvent::Incompatible(policy) => {
                let topic = self.topic.clone();
                self.report(Incident::IncompatibleQos { topic, policy, ours: true });
            }
            ReaderEvent::DeadlinesMissed(missed) => {
                let total = self.deadlines_missed.fetch_add(missed, Ordering::Relaxed) + missed;
                self.report(Incident::DeadlineMissed { topic: self.topic.clone(), total });
            }
        }
    }

    fn report(&self, incident: Incident) {
        // Without a listener the event is dropped.
        self.incidents.send(incident).ok();
    }
}
