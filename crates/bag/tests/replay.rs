//! A replay equals the run that it came from.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

mod session;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use proptest::prelude::*;
use session::{at, battery, ecg, text, wave};
use teampulse_bag::{Bag, BagSink, BagSource, BagWriter, Options, Pace, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::qos::Qos;
use teampulse_core::sample::Record;
use teampulse_core::session::{self as core_session, Outcome, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{About, Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::convert::encode;
use tempfile::tempdir;

/// Readings of a robot and a person; the type of the robot's messages becomes known during the session.
struct Script;

#[async_trait]
impl Source for Script {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let mut unknown = battery();
        if let Shape::Message(schema) = &mut unknown.shape {
            Arc::make_mut(schema).text.clear();
        }
        let silent = Stream { name: "/r1/silent".into(), ..battery() };
        let note = outlet.declare_at(unknown, at(0));
        let strap = outlet.declare_at(ecg(), at(5));
        outlet.declare_at(silent, at(7));
        for k in 0..3000 {
            let arrival = at(10_000_000 * (k / 2));
            if k == 1000 {
                outlet.declare_at(battery(), arrival);
            }
            let source_time = (k % 4 == 0).then(|| Time::from_nanos(arrival.nanos() - 5000));
            let reading = if k % 2 == 0 {
                let data = text(&format!("{k}"));
                Reading { index: None, stream: note, device_time: None, source_time, data }
            } else {
                let device_time = Some(k * 7_692_307);
                Reading {
                    index: None,
                    stream: strap,
                    device_time,
                    source_time: None,
                    data: wave(k as f64),
                }
            };
            if outlet.send(reading, arrival).await.is_err() {
                return Ok(());
            }
        }
        Ok(())
    }
}

/// The same, and then a silence until the session is killed.
struct Silenced;

#[async_trait]
impl Source for Silenced {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        Script.run(outlet).await?;
        outlet.pass(at(SILENT_UNTIL_NANOS));
        Ok(())
    }
}

const SILENT_UNTIL_NANOS: i64 = 34_560_000_000;

/// The same, with a silence of half an hour before the last reading.
struct Resumed;

#[async_trait]
impl Source for Resumed {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        Script.run(outlet).await?;
        let stream = outlet.declare_at(battery(), at(SILENT_UNTIL_NANOS));
        let (device_time, source_time, index) = (None, None, None);
        let reading = Reading { index, stream, device_time, source_time, data: text("back") };
        let sent = outlet.send(reading, at(1_800_000_000_000)).await;
        assert_eq!(sent, Ok(()), "a recording that is read goes on");
        Ok(())
    }
}

/// Keeps everything it receives.
#[derive(Clone, Default)]
struct Kept(Arc<Mutex<Vec<Record>>>);

impl Sink for Kept {
    fn name(&self) -> &'static str {
        "kept"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => self.0.lock().unwrap().extend(batch.iter().cloned()),
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

async fn run(source: Box<dyn Source>, sink: Box<dyn Sink>) -> Outcome {
    let session = Session {
        clock: Clock::settable(),
        pace: core_session::Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("source".into(), source)],
        features: Vec::new(),
        sinks: vec![sink],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await
}

async fn record(folder: PathBuf, source: Box<dyn Source>, options: Options) {
    let sink = BagSink { folder, study: "[session]".into(), options };
    let outcome = run(source, Box::new(sink)).await;
    assert!(outcome.sources.is_empty() && outcome.sinks.is_empty(), "{outcome:?}");
}

fn source(bag: &Path, selection: Selection) -> BagSource {
    BagSource::new(Arc::new(Bag::open(bag).unwrap()), selection)
}

/// Each message of a bag as text, without those that repeat descriptions in each file.
fn reported(path: &Path) -> Vec<String> {
    let bag = Bag::open(path).unwrap();
    let messages = bag.messages(None).map(|message| {
        let message = message.unwrap();
        let stream = &bag.streams()[message.stream].stream;
        let is_repeated =
            stream.shape == Shape::Description && message.log_time != message.publish_time;
        (!is_repeated).then(|| {
            let name = &stream.name;
            let sequence = message.sequence;
            let (log, publish) = (message.log_time, message.publish_time);
            let schema = &message.schema;
            format!("{name} {sequence} {log:?} {publish:?} {schema:?} {:?}", message.cdr)
        })
    });
    messages.flatten().collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_replay_equals_the_run_it_came_from() {
    let folder = tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let split = Options { split_secs: Some(4.0), ..Options::default() };
    record(first.clone(), Box::new(Script), split).await;
    let replayed = source(&first, Selection::Raw);
    record(second.clone(), Box::new(replayed), Options::default()).await;
    let (run, replay) = (reported(&first), reported(&second));
    assert!(run.len() > 3000);
    for (run, replay) in run.iter().zip(&replay) {
        assert_eq!(run, replay);
    }
    assert_eq!(run.len(), replay.len());
    let study = Bag::open(&first).unwrap().attachment("study.toml").unwrap();
    assert_eq!(study.as_deref(), Some(&b"[session]"[..]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_replay_goes_on_through_the_silence_before_a_kill() {
    let folder = tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    record(first.clone(), Box::new(Silenced), Options::default()).await;
    let replayed = source(&first, Selection::Raw);
    record(second.clone(), Box::new(replayed), Options::default()).await;
    let last = Bag::open(&first).unwrap().bounds().unwrap().1;
    assert!(at(SILENT_UNTIL_NANOS).secs_since(last) < 1.0, "a silent session reports its health");
    assert_eq!(reported(&first), reported(&second));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_playback_may_begin_in_the_middle_and_repeat() {
    let folder = tempdir().unwrap();
    let bag = folder.path().join("bag");
    record(bag.clone(), Box::new(Script), Options::default()).await;
    let kept = Kept::default();
    let source =
        source(&bag, Selection::Raw).starting(at(14_000_000_000)).repeated(3).paced(Pace::new(1e9));
    run(Box::new(source), Box::new(kept.clone())).await;
    let records = kept.0.lock().unwrap();
    let notes: Vec<&Record> =
        records.iter().filter(|record| record.stream.name == "/r1/note").collect();
    assert_eq!(notes.len(), 3 * 100);
    assert!(notes.is_sorted_by_key(|record| record.sample.log_time));
    let once_nanos = notes[100].sample.log_time.nanos_since(notes[0].sample.log_time);
    assert!((990_000_000..1_000_000_000).contains(&once_nanos), "{once_nanos}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_held_playback_ends_with_its_session() {
    let folder = tempdir().unwrap();
    let bag = folder.path().join("bag");
    record(bag.clone(), Box::new(Script), Options::default()).await;
    let pace = Pace::new(1.0);
    pace.set_paused(true);
    let source = source(&bag, Selection::Raw).paced(pace);
    let session = Session {
        clock: Clock::settable(),
        pace: core_session::Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("source".into(), Box::new(source))],
        features: Vec::new(),
        sinks: Vec::new(),
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let outcome = session.run(std::future::ready(())).await;
    assert!(outcome.sources.is_empty());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bad_chunk_is_passed_over_and_noted() {
    let folder = tempdir().unwrap();
    let bag = folder.path().join("bag");
    let split = Options { split_secs: Some(4.0), ..Options::default() };
    record(bag.clone(), Box::new(Script), split).await;
    let all = reported(&bag).len();
    let file = bag.join("bag_1.mcap");
    let mut bytes = std::fs::read(&file).unwrap();
    let inside = bytes.len() / 4;
    bytes[inside..inside + 100].fill(0);
    std::fs::write(&file, &bytes).unwrap();
    let kept = Kept::default();
    let source = source(&bag, Selection::RawAndDerived);
    let unread = source.unread();
    assert!(unread.is_empty());
    let outcome = run(Box::new(source), Box::new(kept.clone())).await;
    assert!(outcome.sources.is_empty() && outcome.sinks.is_empty(), "{outcome:?}");
    assert!(!unread.is_empty());
    let records = kept.0.lock().unwrap().len();
    assert!(records > 0 && records < all, "{records} of {all}");
}

/// Readings with arbitrary stamps, on streams with clocks of all kinds.
#[derive(Clone, Debug)]
struct Odd(Vec<(usize, i64, OddTime, OddTime)>);

/// A stamp.
#[derive(Clone, Copy, Debug)]
enum OddTime {
    None,
    Near(i64),
    Any(i64),
}

impl OddTime {
    fn nanos(self, arrival: Time) -> Option<i64> {
        match self {
            OddTime::None => None,
            OddTime::Near(off_nanos) => Some(arrival.nanos().saturating_add(off_nanos)),
            OddTime::Any(nanos) => Some(nanos),
        }
    }
}

fn odd_times() -> impl Strategy<Value = OddTime> {
    let off = prop::sample::select(vec![0_i64, 1, -1, 900, -5_000, 40_000, -90_000, 2_000_000_000]);
    prop_oneof![
        2 => Just(OddTime::None),
        4 => off.prop_map(|micros| OddTime::Near(micros * 1000)),
        1 => any::<i64>().prop_map(OddTime::Any),
        2 => prop::sample::select(vec![0, 1, -1, -5_000_000_000, i64::MIN, i64::MAX, 4_102_444_800_000_000_000])
            .prop_map(OddTime::Any),
    ]
}

fn odd() -> impl Strategy<Value = Odd> {
    let step = prop_oneof![8 => 1_000_i64..90_000_000, 1 => 0_i64..4_000_000_000];
    prop::collection::vec((0_usize..5, step, odd_times(), odd_times()), 1..200).prop_map(Odd)
}

#[async_trait]
impl Source for Odd {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let person = || Subject { about: About::Person, id: "p1".into() };
        let plain = |name: &str| {
            let name = format!("/humans/persons/p1/{name}");
            Stream::raw(name, person(), Shape::Sample).with_channels(&[("x", "1")])
        };
        let kept = Stream {
            qos: vec![Qos::latched(10)],
            ..Stream::raw("/humans/persons/p1/task/events", person(), Shape::Event)
        };
        let counted = Stream { device: "watch".into(), rate_hz: 10.0, ..plain("watch/x") };
        let device = Stream { device: "strap".into(), rate_hz: 130.0, ..ecg() };
        let streams = [battery(), plain("x"), kept, counted, device];
        let ids = streams.map(|stream| outlet.declare_at(stream, at(0)));
        let mut now = at(0);
        for (place, step, stamp, device) in self.0.clone() {
            now = Time::from_nanos(now.nanos() + step);
            let event = Event {
                kind: EventKind::Marker,
                label: "x".into(),
                value: 0.0,
                duration_secs: 0.0,
            };
            let data = match place {
                0 => text("anything"),
                2 => Data::Event(Arc::new(event)),
                4 => wave(1.0),
                _ => Data::Sample([1.0].into()),
            };
            let device_time = device.nanos(now).filter(|nanos| place == 4 && *nanos != i64::MIN);
            let source_time = stamp.nanos(now).map(Time::from_nanos);
            let reading =
                Reading { index: None, stream: ids[place], device_time, source_time, data };
            if outlet.send(reading, now).await.is_err() {
                return Ok(());
            }
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_replay_equals_the_run_whatever_the_stamps_are(odd in odd()) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let folder = tempdir().unwrap();
        let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
        runtime.block_on(async {
            record(first.clone(), Box::new(odd), Options::default()).await;
            let replayed = source(&first, Selection::Raw);
            record(second.clone(), Box::new(replayed), Options::default()).await;
        });
        let (run, replay) = (reported(&first), reported(&second));
        for (run, replay) in run.iter().zip(&replay) {
            prop_assert_eq!(run, replay);
        }
        prop_assert_eq!(run.len(), replay.len());
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_silence_of_half_an_hour_that_was_watched_is_the_same_in_a_replay() {
    let folder = tempdir().unwrap();
    let (first, again) = (folder.path().join("first"), folder.path().join("again"));
    record(first.clone(), Box::new(Resumed), Options::default()).await;
    record(again.clone(), Box::new(source(&first, Selection::Raw)), Options::default()).await;
    let (first, again) = (reported(&first), reported(&again));
    assert!(first.iter().filter(|line| line.starts_with("/teampulse/status")).count() > 3600);
    assert!(first == again, "{} and {} messages", first.len(), again.len());
}

/// How many messages a replay of a bag writes when one message of the robot has a different log time.
async fn replayed_with(change_nanos: i64) -> usize {
    let folder = tempdir().unwrap();
    let (first, again) = (folder.path().join("first"), folder.path().join("again"));
    let mut records = session::session(300);
    let place = records.len() - 30;
    let of_robot = records[place..].iter_mut().find(|record| record.stream.name == "/r1/note");
    let sample = &mut of_robot.unwrap().sample;
    sample.log_time = Time::from_nanos(sample.log_time.nanos() + change_nanos);
    let mut writer = BagWriter::create(&first, &Options::default()).unwrap();
    for record in &records {
        writer.write(record).unwrap();
    }
    writer.finish().unwrap();
    record(again.clone(), Box::new(source(&first, Selection::Raw)), Options::default()).await;
    reported(&again).len()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flipped_log_time_is_a_pause_and_no_day_of_statuses() {
    let usual = replayed_with(0).await;
    for bit in 33..47 {
        for change_nanos in [1_i64 << bit, -(1 << bit)] {
            let messages = replayed_with(change_nanos).await;
            // Two streams, a status a second, for the ten minutes that may be a silence.
            assert!(messages <= usual + 2 * 600 + 10, "{messages} for {change_nanos} ns");
        }
    }
}
