//! What `check` receives: every raw stream with its latest status, and the publishers of phases for single people or
//! robots.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use teampulse_core::data::{Data, EventKind};
use teampulse_core::phases::Phases;
use teampulse_core::session_streams::session_events;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{About, Origin, Shape, Stream, StreamId};

use super::worn::{self, Newest};

/// Everything that was received.
#[derive(Debug, Default)]
pub struct Heard {
    /// Every raw stream with its latest status, found by the name in the status.
    pub streams: Vec<(Arc<Stream>, StreamStatus)>,
    /// The people and robots that have their own phases, each with the stream that publishes them.
    pub own_phases: BTreeMap<String, String>,
    /// The newest values that wearables report about their batteries and their contact with the skin.
    pub worn: Vec<Newest>,
    /// The distinct faults.
    pub faults: Vec<String>,
}

/// A sink that keeps the latest status of every raw stream.
#[derive(Clone, Default)]
pub struct Listener(Arc<Mutex<Heard>>);

impl Listener {
    /// Returns what was received so far, and clears it.
    pub fn heard(&self) -> Heard {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Sink for Listener {
    fn name(&self) -> &'static str {
        "check"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(move |stream| {
            let is_of_phases = is_subject(stream) && Phases::hears(stream);
            let is_of_session = stream.name == session_events().name;
            stream.shape == Shape::Status || is_of_session || is_of_phases || worn::wants(stream)
        }))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let mut newest = BTreeMap::new();
        let mut own_phases = BTreeMap::new();
        let mut worn = BTreeMap::new();
        let mut faults = Vec::new();
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    for record in batch.iter() {
                        match &record.sample.data {
                            Data::Status(status) => {
                                newest.insert(status.name.clone(), StreamStatus::clone(status));
                            }
                            Data::Event(event)
                                if event.kind == EventKind::Phase && is_subject(&record.stream) =>
                            {
                                let Stream { id, name, .. } = &*record.stream;
                                own_phases.insert(id.clone(), name.clone());
                            }
                            Data::Event(event) if event.kind == EventKind::Fault => {
                                let label = event.label.clone();
                                if !faults.contains(&label) {
                                    faults.push(label);
                                }
                            }
                            Data::Sample(values) if worn::wants(&record.stream) => {
                                let newest = (Arc::clone(&record.stream), values.to_vec());
                                worn.insert(record.stream.name.clone(), newest);
                            }
                            _ => {}
                        }
                    }
                }
                Received::Silence => {}
                Received::Closed => {
                    let streams = with_statuses(inbox.streams().all(), newest);
                    let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
                    let worn = worn.into_values().collect();
                    *heard = Heard { streams, own_phases, worn, faults };
                    return Ok(());
                }
            }
        }
    }
}

/// Whether a stream is about a person or a robot.
fn is_subject(stream: &Stream) -> bool {
    matches!(stream.about, About::Person | About::Robot)
}

/// Returns the raw streams that have a status, each with its newest description.
fn with_statuses(
    streams: Vec<(StreamId, Arc<Stream>)>,
    statuses: BTreeMap<String, StreamStatus>,
) -> Vec<(Arc<Stream>, StreamStatus)> {
    let mut named = HashMap::new();
    for (_, stream) in streams.into_iter().filter(|(_, stream)| stream.origin == Origin::Raw) {
        if let Shape::Message(schema) = &stream.shape {
            // The name that a second type on the same topic is given.
            let second = format!("{} ({})", stream.name, schema.name);
            named.entry(second).or_insert_with(|| Arc::clone(&stream));
        }
        named.entry(stream.name.clone()).or_insert(stream);
    }
    let with_stream =
        |(name, status): (String, _)| named.get(&name).map(|stream| (Arc::clone(stream), status));
    statuses.into_iter().filter_map(with_stream).collect()
}
