//! A replay equals the run that it came from.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

#[expect(dead_code, reason = "each test takes what it needs")]
mod session;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use session::{at, battery, ecg, text, wave};
use teampulse_bag::{Bag, BagSink, BagSource, Options, Pace, Selection};
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::Record;
use teampulse_core::session::{self as core_session, Outcome, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Shape, Stream};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_messages::convert::encode;
use tempfile::tempdir;

/// Readings of a robot and a person, of which the robot's type becomes known on the way.
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
                Reading { stream: note, device_time: None, source_time, data }
            } else {
                let device_time = Some(k * 7_692_307);
                Reading { stream: strap, device_time, source_time: None, data: wave(k as f64) }
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

/// Keeps all that it is given.
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
        clock: Clock::told(),
        pace: core_session::Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("source".into(), source)],
        features: Vec::new(),
        sinks: vec![sink],
        encode,
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
fn told(path: &Path) -> Vec<String> {
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
    let (run, replay) = (told(&first), told(&second));
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
    assert!(at(SILENT_UNTIL_NANOS).secs_since(last) < 1.0, "a silent session tells its health");
    assert_eq!(told(&first), told(&second));
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
        clock: Clock::told(),
        pace: core_session::Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("source".into(), Box::new(source))],
        features: Vec::new(),
        sinks: Vec::new(),
        encode,
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
    let told = told(&bag).len();
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
    assert!(records > 0 && records < told, "{records} of {told}");
}
