//! The health of every stream on `/diagnostics`, for standard ROS tools.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::data::Data;
use teampulse_core::qos::Qos;
use teampulse_core::sink::{Batch, Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{Shape, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::catalogue;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use teampulse_messages::standard::std_msgs::Header;

use crate::bus::{Bus, Publisher};
use crate::privacy::PrivacyFilter;
use crate::sink::Publish;

/// The standard topic of ROS diagnostics.
const TOPIC: &str = "/diagnostics";
/// The longest wait for statuses at a time; nothing happens when it ends.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long statuses gather before they are published.
const GATHER: Duration = Duration::from_millis(50);

/// Publishes the health of every stream, including its clock, as one `diagnostic_msgs/DiagnosticArray` a second. The
/// health of people's streams is published only if the streams themselves are.
pub struct DiagnosticsSink {
    bus: Arc<dyn Bus>,
    publish: Publish,
}

impl DiagnosticsSink {
    /// Creates a sink on this bus; `publish` states which streams are published there.
    pub fn new(bus: Arc<dyn Bus>, publish: Publish) -> DiagnosticsSink {
        DiagnosticsSink { bus, publish }
    }
}

impl Sink for DiagnosticsSink {
    fn name(&self) -> &'static str {
        "diagnostics"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(|stream| stream.shape == Shape::Status))
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let schema = catalogue::shipped(DiagnosticArray::NAME).expect("the type is shipped");
        let publisher = self.bus.publish(TOPIC, &schema, &Qos::reliable(10))?;
        let mut privacy = PrivacyFilter::new(self.publish);
        loop {
            match inbox.receive_gathered(GATHER, PATIENCE) {
                Received::Batch(batch) => {
                    privacy.learn(inbox.streams());
                    arrays(&batch, inbox.streams(), &privacy)
                        .for_each(|array| send(&*publisher, &array));
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

fn send(publisher: &dyn Publisher, array: &DiagnosticArray) {
    if let Err(refused) = publisher.publish(&array.encode()) {
        tracing::error!("failed to {refused}");
    }
}

/// The statuses of a batch, one array for each second.
fn arrays(
    batch: &Batch,
    streams: &Streams,
    privacy: &PrivacyFilter,
) -> impl Iterator<Item = DiagnosticArray> {
    let statuses = batch.iter().filter_map(|record| match &record.sample.data {
        Data::Status(status) if privacy.publishes_health_of(status) => {
            let stream = streams.find(status.topic());
            let subject = stream.map_or_else(Subject::session, |(_, stream)| stream.subject());
            Some((record.sample.measured, diagnostic(status, subject)))
        }
        _ => None,
    });
    let mut arrays: Vec<DiagnosticArray> = Vec::new();
    for (at, status) in statuses {
        match arrays.last_mut().filter(|array| array.header.stamp == at) {
            Some(array) => array.status.push(status),
            None => arrays.push(begun(at, status)),
        }
    }
    arrays.into_iter()
}

fn begun(at: Time, status: DiagnosticStatus) -> DiagnosticArray {
    DiagnosticArray { header: Header { stamp: at, ..Header::default() }, status: vec![status] }
}

fn diagnostic(status: &StreamStatus, subject: Subject) -> DiagnosticStatus {
    let level = match status.state {
        State::Ok => DiagnosticStatus::OK,
        State::Degraded => DiagnosticStatus::WARN,
        State::Dead => DiagnosticStatus::ERROR,
        State::Never | State::Stale => DiagnosticStatus::STALE,
    };
    let reason = if status.reason.is_empty() { "ok" } else { &status.reason };
    DiagnosticStatus {
        level,
        name: format!("teampulse: {}", status.name),
        message: reason.to_owned(),
        hardware_id: subject.id,
        values: values(status),
    }
}

/// The measurements of a status; unknown values are marked as such.
fn values(status: &StreamStatus) -> Vec<KeyValue> {
    let number = |value: f64| if value.is_nan() { "unknown".into() } else { value.to_string() };
    let lost = status.lost_source.map_or("unknown".into(), |lost| lost.to_string());
    let values = [
        ("rate [Hz]", number(status.rate_hz)),
        ("age [s]", number(status.age_secs)),
        ("received", status.received.to_string()),
        ("lost on the way", lost),
        ("lost in our queue", status.lost_queue.to_string()),
        ("late", status.late.to_string()),
        ("duplicates", status.duplicates.to_string()),
        ("clock epoch", status.epoch.to_string()),
        ("clock offset [s]", number(status.offset_secs)),
        ("clock skew [ppm]", number(status.skew_ppm)),
        ("jitter [s]", number(status.jitter_secs)),
        ("standard uncertainty of its times [s]", number(status.sigma_secs)),
        ("latency [s]", number(status.latency_secs)),
    ];
    values.map(|(key, value)| KeyValue { key: key.into(), value }).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(state: State, reason: &str) -> StreamStatus {
        StreamStatus {
            name: "/robot1/odom".into(),
            state,
            reason: reason.into(),
            rate_hz: 20.0,
            age_secs: 0.1,
            received: 5,
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock: 4,
            epoch: 0,
            offset_secs: 1.5,
            skew_ppm: f64::NAN,
            jitter_secs: f64::NAN,
            sigma_secs: 0.002,
            latency_secs: f64::NAN,
        }
    }

    #[test]
    fn what_is_unknown_is_never_reported_as_a_number() {
        let degraded = status(State::Degraded, "its clock is off");
        let diagnosed = diagnostic(&degraded, Subject::robot("robot1"));
        assert_eq!(
            (diagnosed.level, &*diagnosed.message),
            (DiagnosticStatus::WARN, "its clock is off")
        );
        assert_eq!(
            (&*diagnosed.name, &*diagnosed.hardware_id),
            ("teampulse: /robot1/odom", "robot1")
        );
        let value = |key: &str| {
            let found = diagnosed.values.iter().find(|each| each.key == key);
            found.map(|each| each.value.as_str())
        };
        assert_eq!(value("clock offset [s]"), Some("1.5"));
        assert_eq!(value("lost on the way"), Some("unknown"));
        assert_eq!(value("clock skew [ppm]"), Some("unknown"));
    }

    #[test]
    fn a_dead_stream_is_an_error_and_a_silent_one_stale() {
        let level = |state| diagnostic(&status(state, ""), Subject::session()).level;
        assert_eq!(level(State::Ok), DiagnosticStatus::OK);
        assert_eq!(level(State::Stale), DiagnosticStatus::STALE);
        assert_eq!(level(State::Dead), DiagnosticStatus::ERROR);
    }
}
