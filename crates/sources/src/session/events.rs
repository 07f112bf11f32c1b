//! Events that other programs publish on ROS.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use async_trait::async_trait;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::session_streams::{SESSION_EVENTS, session_events};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::time::Time;
use teampulse_messages::cdr::Reader;
use teampulse_messages::convert::{self, DecodeError};
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Incident, Subscription};
use tokio::sync::broadcast::error::RecvError;

use super::commands::COMMANDS;
use super::{ScheduleHandle, happen};

const EVENT: &str = "teampulse_msgs/msg/Event";
/// The largest number of reasons for unreadable events that are reported, and the longest reason [characters].
const MOST_REASONS: usize = 100;
const LONGEST_REASON: usize = 300;
/// The longest text accepted as a marker [bytes].
const LARGEST_MARKER_BYTES: usize = 1 << 20;
/// The queue size of the subscription to events.
const DEPTH: u32 = 1000;

/// Events published by any ROS node on `/session/events`: a `teampulse_msgs/Event`, or a `std_msgs/String` whose text
/// is the label of a marker.
///
/// Events of the kind `clock` are ignored: with them a session reports about its own clock and its end, so those of
/// another session, or of a recording that is played, do not apply to this one. Events of the kind `command` are
/// ignored, too.
pub struct RosEvents {
    bus: Arc<dyn Bus>,
    /// The schedule of the study's phases.
    schedule: ScheduleHandle,
}

impl RosEvents {
    /// Creates the source of events from a bus.
    pub fn new(bus: Arc<dyn Bus>) -> RosEvents {
        RosEvents { bus, schedule: ScheduleHandle::default() }
    }

    /// Makes the schedule of the study follow the phases among the events.
    #[must_use]
    pub fn with_schedule(mut self, schedule: ScheduleHandle) -> RosEvents {
        self.schedule = schedule;
        self
    }

    fn subscribe(
        &self,
        outlet: &Outlet,
        type_name: &str,
        read: Read,
    ) -> Result<Subscription, BusError> {
        let (outlet, refusals) =
            (outlet.clone(), Refusals::new(SESSION_EVENTS, "the event is ignored"));
        let schedule = self.schedule.clone();
        let deliver = Arc::new(move |arrival: Arrival| {
            let (stamp, event) = match read(&arrival.bytes) {
                Ok(read) => read,
                Err(reason) => return refusals.report(&outlet, &reason),
            };
            if event.kind == EventKind::Phase {
                schedule.begin(&event.label);
            }
            let stream = outlet.declare(session_events());
            let source_time = stamp.map(|stamp| outlet.clock().session_from_stamp(stamp));
            let data = Data::Event(Arc::new(event));
            outlet.offer(Reading { index: None, stream, device_time: None, source_time, data });
        });
        self.bus.subscribe(SESSION_EVENTS, type_name, Asked::Adaptive { depth: DEPTH }, deliver)
    }
}

#[async_trait]
impl Source for RosEvents {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let gone =
            |error: BusError| SourceError::Gone { message: error.to_string(), hint: String::new() };
        let _events = self.subscribe(outlet, EVENT, event).map_err(gone)?;
        let _markers = self.subscribe(outlet, "std_msgs/msg/String", marker).map_err(gone)?;
        let mut incidents = self.bus.incidents();
        let mut reported = BTreeSet::new();
        loop {
            tokio::select! {
                incident = incidents.recv() => match incident {
                    Ok(Incident::IncompatibleQos { topic, policy, ours: false }) => {
                        let label = format!("{topic}: a subscriber requests more {policy} than offered");
                        if reported.insert(label.clone()) {
                            happen(outlet, EventKind::Fault, &label, 0.0);
                        }
                    }
                    Err(RecvError::Closed) => break outlet.closed().await,
                    Ok(_) | Err(RecvError::Lagged(_)) => {}
                },
                () = outlet.closed() => break,
            }
        }
        Ok(())
    }
}

/// Reports why messages on a topic can't be read, each reason once. The reports are faults of the session, so that they
/// appear on the screen and in the bag.
pub(super) struct Refusals {
    topic: &'static str,
    consequence: &'static str,
    known: Mutex<BTreeSet<String>>,
}

impl Refusals {
    pub(super) fn new(topic: &'static str, consequence: &'static str) -> Refusals {
        Refusals { topic, consequence, known: Mutex::default() }
    }

    /// Reports a reason, which fits after "failed to".
    pub(super) fn report(&self, outlet: &Outlet, reason: &str) {
        let reason: String = reason.chars().take(LONGEST_REASON).collect();
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() < MOST_REASONS && known.insert(reason.clone()) {
            let label = format!("{}: failed to {reason}; {}", self.topic, self.consequence);
            happen(outlet, EventKind::Fault, &label, 0.0);
        }
    }
}

/// Reads an event, with its stamp if it has one.
type Read = fn(&[u8]) -> Result<(Option<Time>, Event), String>;

fn event(cdr: &[u8]) -> Result<(Option<Time>, Event), String> {
    let decoded = convert::decode(EVENT, cdr).map_err(|error| error.to_string())?;
    let Data::Event(event) = decoded.data else {
        return Err(DecodeError::Type(EVENT.into()).to_string());
    };
    if event.kind == EventKind::Clock {
        return Err(format!("use `{}`, an event of another session's clock", event.label));
    }
    if event.kind == EventKind::Command {
        return Err(format!("use `{}` as a command: commands are sent to {COMMANDS}", event.label));
    }
    let stamp = (decoded.stamp != Time::EPOCH).then_some(decoded.stamp);
    Ok((stamp, Event::clone(&event)))
}

fn marker(cdr: &[u8]) -> Result<(Option<Time>, Event), String> {
    if cdr.len() > LARGEST_MARKER_BYTES {
        return Err(format!("read a marker of {} bytes: expected a few words", cdr.len()));
    }
    let label = Reader::new(cdr).and_then(|mut text| text.read::<String>());
    let label = label.map_err(|error| DecodeError::from(error).to_string())?;
    Ok((None, Event { kind: EventKind::Marker, label, value: f64::NAN, duration_secs: 0.0 }))
}
