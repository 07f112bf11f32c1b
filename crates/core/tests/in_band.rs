//! In-band reports on publishers, simulated time and messages kept for late joiners: streams are judged by them, live
//! and in a replay.

mod session;

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::qos::Qos;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::session_streams::session_events;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{Schema, Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use session::{Keeper, Recording, derived, encode};

const TOPIC: &str = "/r1/map";

/// What happens, by the second at which it does.
enum Coming {
    /// A message that was stamped at a second.
    Message { stamp_secs: f64 },
    /// A report on the publishers.
    Publishers(Vec<String>),
    /// A report that the stream was stopped on purpose, or goes on.
    Stopped(bool),
    /// An event of the session.
    Event(&'static str),
    /// teampulse itself was suspended for this long [s].
    Standstill(f64),
}

/// Plays a script on one stream of messages.
struct Script(Stream, Vec<(f64, Coming)>);

fn at(secs: f64) -> Time {
    Time::from_stamp(1_700_000_000, 0) + Duration::from_nanos((secs * 1e9) as u64)
}

#[async_trait]
impl Source for Script {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        for (secs, coming) in self.1.drain(..) {
            let id = outlet.declare_at(self.0.clone(), at(secs));
            let (stream, source_time, data) = match coming {
                Coming::Message { stamp_secs } => {
                    let bytes = stamp_secs.to_le_bytes().to_vec();
                    (id, Some(at(stamp_secs)), Data::Message(bytes.into()))
                }
                Coming::Publishers(names) => {
                    outlet.clock().set(at(secs));
                    outlet.published_by(id, &names);
                    continue;
                }
                Coming::Stopped(is_stopped) => {
                    outlet.clock().set(at(secs));
                    if is_stopped {
                        outlet.stopped(id);
                    } else {
                        outlet.started(id);
                    }
                    continue;
                }
                Coming::Event(label) => {
                    let (kind, label) = (EventKind::Clock, label.to_owned());
                    let event = Event { kind, label, value: 1.0, duration_secs: 0.0 };
                    let stream = outlet.declare_at(session_events(), at(secs));
                    (stream, None, Data::Event(Arc::new(event)))
                }
                Coming::Standstill(duration_secs) => {
                    let label = "teampulse itself stood still for a while".to_owned();
                    let (kind, value) = (EventKind::Fault, f64::NAN);
                    let event = Event { kind, label, value, duration_secs };
                    let stream = outlet.declare_at(session_events(), at(secs));
                    (stream, None, Data::Event(Arc::new(event)))
                }
            };
            let reading = Reading { index: None, stream, device_time: None, source_time, data };
            if outlet.send(reading, at(secs)).await.is_err() {
                break;
            }
        }
        Ok(())
    }
}

async fn keep(clocks: Clocks, source: impl Source + 'static) -> Vec<Record> {
    let kept = Arc::default();
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks,
        streams: Streams::default(),
        sources: vec![("test".into(), Box::new(source))],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await;
    let mut kept = kept.lock().expect("nobody panicked");
    std::mem::take(&mut *kept)
}

fn messages(qos: Qos) -> Stream {
    let name = "test_msgs/msg/Any".into();
    let (encoding, text, hash) = ("ros2msg".into(), String::new(), String::new());
    let shape = Shape::Message(Arc::new(Schema { name, encoding, text, hash }));
    Stream { qos: vec![qos], ..Stream::raw(TOPIC, Subject::robot("r1"), shape) }
}

fn statuses(records: &[Record]) -> Vec<&StreamStatus> {
    let statuses = records.iter().filter_map(|record| match &record.sample.data {
        Data::Status(status) => Some(&**status),
        _ => None,
    });
    statuses.filter(|status| status.name == TOPIC).collect()
}

/// Runs a script, then a replay of the recording; both must give the same results.
async fn twice(stream: Stream, script: Vec<(f64, Coming)>) -> Vec<Record> {
    let records = keep(Clocks::default(), Script(stream, script)).await;
    let again = keep(Clocks::default(), Recording(records.clone())).await;
    assert_eq!(derived(&records), derived(&again));
    records
}

/// One message a second, stamped when sent.
fn live(secs: std::ops::Range<u32>) -> impl Iterator<Item = (f64, Coming)> {
    secs.map(|secs| (f64::from(secs), Coming::Message { stamp_secs: f64::from(secs) - 0.002 }))
}

#[tokio::test]
async fn messages_kept_for_late_joiners_are_neither_a_rate_nor_a_wrong_clock() {
    let kept = |began: f64, secs: std::ops::Range<u32>| {
        let message = move |k: u32| Coming::Message { stamp_secs: f64::from(k) };
        secs.enumerate().map(move |(place, k)| (began + place as f64 * 1e-3, message(k)))
    };
    // Joined at 500 s; again at 540 s, by another publisher with what it has kept.
    let script = kept(500.0, 100..130).chain(kept(540.0, 200..220)).chain(live(560..562));
    let records = twice(messages(Qos::latched(100)), script.collect()).await;
    let found = statuses(&records);
    assert!(found.len() > 50);
    for status in &found {
        assert!(status.received > 50 || status.rate_hz == 0.0, "{status:?}");
        assert!(matches!(status.state, State::Ok | State::Never), "{status:?}");
        assert_eq!((status.late, status.duplicates), (0, 0));
    }
    assert_eq!(found.last().expect("a status").received, 51, "all of it was recorded");
    assert!(!records.iter().any(|record| record.stream.name == "/teampulse/clocks"));
}

#[tokio::test]
async fn a_slow_clock_is_found_on_a_latched_topic_all_the_same() {
    let slow = (0..400)
        .map(|k| f64::from(k) * 0.1)
        .map(|secs| (100.0 + secs, Coming::Message { stamp_secs: 95.0 + secs }));
    let records = twice(messages(Qos::latched(100)), slow.collect()).await;
    assert!(statuses(&records).last().expect("a status").reason.contains("s off"));
}

#[tokio::test]
async fn two_publishers_are_reported_as_long_as_there_are_two() {
    let two = Coming::Publishers(vec!["laptop1".into(), "laptop2".into()]);
    let script = live(0..6)
        .chain([(5.5, two)])
        .chain(live(6..10))
        .chain([(9.5, Coming::Publishers(vec!["laptop2".into()]))])
        .chain(live(10..13));
    let stream = messages(Qos::reliable(1)).with_channels(&[("x", "m")]);
    let records = twice(stream, script.collect()).await;
    let reasons: Vec<&str> = statuses(&records).iter().map(|each| &*each.reason).collect();
    let said = reasons.iter().filter(|reason| **reason == "2 publishers: laptop1 and laptop2");
    assert_eq!(said.count(), 4, "{reasons:?}");
    assert_eq!(reasons.last(), Some(&""));
}

#[tokio::test]
async fn a_standstill_of_the_session_is_no_silence_of_a_stream() {
    let of = |silence: Option<(f64, Coming)>| {
        let script = live(0..20).chain(silence).chain(live(80..85));
        twice(messages(Qos::reliable(1)), script.collect())
    };
    let was_dead = |records: &[Record]| {
        statuses(records).iter().any(|status| matches!(status.state, State::Stale | State::Dead))
    };
    assert!(was_dead(&of(None).await));
    assert!(!was_dead(&of(Some((19.5, Coming::Standstill(60.4)))).await));
}

#[tokio::test]
async fn a_stream_that_was_stopped_on_purpose_is_not_silent_until_it_goes_on() {
    let stopped_until = |secs: f64| {
        let stop = [(19.5, Coming::Stopped(true)), (secs, Coming::Stopped(false))];
        twice(messages(Qos::reliable(1)), live(0..20).chain(stop).chain(live(80..85)).collect())
    };
    let silent = |records: &[Record]| {
        let silent = |status: &&&StreamStatus| matches!(status.state, State::Stale | State::Dead);
        statuses(records).iter().filter(silent).count()
    };
    let records = stopped_until(79.5).await;
    assert_eq!(silent(&records), 0);
    let reasons: Vec<&str> = statuses(&records).iter().map(|each| &*each.reason).collect();
    assert!(reasons.iter().filter(|each| **each == "stopped on purpose").count() > 55);
    assert_eq!(reasons.last(), Some(&""));
    assert!(silent(&stopped_until(50.0).await) > 20, "it was started and sends nothing");
}

#[tokio::test]
async fn simulated_time_that_breaks_is_a_new_epoch() {
    let script = live(0..3).chain([(3.5, Coming::Event("/clock jumped back by 40.000 s"))]);
    let script = Script(messages(Qos::reliable(1)), script.chain(live(4..7)).collect());
    let records = keep(Clocks::default(), Simulated(script)).await;
    let again = keep(Clocks::default(), Recording(records.clone())).await;
    assert_eq!(derived(&records), derived(&again));
    let epochs: Vec<u32> = statuses(&records).iter().map(|status| status.epoch).collect();
    assert_eq!((epochs[0], epochs.last()), (0, Some(&1)), "{epochs:?}");
}

/// The same, stamped by simulated time.
struct Simulated(Script);

#[async_trait]
impl Source for Simulated {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let id = outlet.declare_at(self.0.0.clone(), at(0.0));
        outlet.stamped_by(id, teampulse_core::clocks::SIMULATED_TIME);
        self.0.run(outlet).await
    }
}
