//! Workers process records at their own pace: their results have the time of their input, and the session
//! goes on even if they fail.

mod session;

use std::future::{pending, ready};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::Record;
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::sink::Wants;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_core::worker::{Fed, Feed, Worker, WorkerCounts, WorkerError};

use session::{Keeper, Recording, derived, encode};

const CAMERA: &str = "/r1/camera";
const FACE: &str = "/r1/face";
const FRAMES: usize = 20;

type Kept = Arc<Mutex<Vec<Record>>>;

fn count(kept: &Kept, name: &str) -> usize {
    let kept = kept.lock().expect("nobody panicked");
    kept.iter().filter(|record| record.stream.name == name).count()
}

async fn until(condition: impl Fn() -> bool) {
    while !condition() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

fn number(stream: teampulse_core::stream::StreamId, at: Time, value: f64) -> Reading {
    let data = Data::Sample(Arc::new([value]));
    Reading { index: None, stream, device_time: None, source_time: Some(at), data }
}

/// One frame per second of session time; the second arrives while the worker processes the first.
struct Camera {
    kept: Kept,
    looks: Receiver<()>,
    release: SyncSender<()>,
}

#[async_trait]
impl Source for Camera {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = Stream::raw(CAMERA, Subject::robot("r1"), Shape::Sample);
        let stream = outlet.declare(stream.with_channels(&[("frame", "1")]));
        for k in 0..FRAMES {
            let at = Time::from_stamp(100 + k as i32, 0);
            outlet.clock().set(at);
            outlet.offer(number(stream, at, k as f64));
            until(|| count(&self.kept, CAMERA) > k).await;
            if k == 0 {
                while self.looks.try_recv().is_err() {
                    tokio::time::sleep(Duration::from_millis(1)).await;
                }
            }
        }
        self.release.send(()).expect("the worker waits");
        until(|| count(&self.kept, FACE) == 2).await;
        Ok(())
    }
}

/// Takes as long for its first frame as the test allows.
struct Slow {
    looks: SyncSender<()>,
    released: Receiver<()>,
}

impl Worker for Slow {
    fn wants(&self) -> Wants {
        Wants::Only(Box::new(|stream| stream.name == CAMERA))
    }

    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError> {
        let mut face = Stream::raw(FACE, Subject::robot("r1"), Shape::Sample);
        face.inputs = vec![CAMERA.to_owned()];
        let face = outlet.declare(face.with_channels(&[("smile", "1")]));
        let mut is_first = true;
        loop {
            let records = match feed.next(Duration::from_secs(1)) {
                Fed::Records(records) => records,
                Fed::Silence | Fed::Command(_) => continue,
                Fed::Closed => return Ok(()),
            };
            if std::mem::take(&mut is_first) {
                self.looks.send(()).expect("the camera waits");
                self.released.recv().expect("the camera releases it");
            }
            for record in records {
                let Data::Sample(frame) = &record.sample.data else { continue };
                outlet.offer(number(face, record.sample.measured, frame[0]));
            }
        }
    }
}

fn session(
    pace: Pace,
    kept: &Kept,
    sources: Vec<Box<dyn Source>>,
    workers: Vec<Box<dyn Worker>>,
) -> Session {
    Session {
        clock: Clock::settable(),
        pace,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: sources.into_iter().map(|source| ("test".to_owned(), source)).collect(),
        features: Vec::new(),
        sinks: vec![Box::new(Keeper { kept: Arc::clone(kept), pause: Duration::ZERO })],
        workers: workers.into_iter().map(|worker| ("model".to_owned(), worker)).collect(),
        encode,
        commands: Commands::default(),
    }
}

/// When each frame, or each face, was measured [s], with its number.
fn measured(records: &[Record], name: &str) -> Vec<(f64, f64)> {
    let of_name = records.iter().filter(|record| record.stream.name == name);
    let each = of_name.filter_map(|record| match &record.sample.data {
        Data::Sample(numbers) => Some((record.sample.measured.secs(), numbers[0])),
        _ => None,
    });
    each.collect()
}

fn taken(kept: &Kept) -> Vec<Record> {
    std::mem::take(&mut *kept.lock().expect("nobody panicked"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_worker_skips_to_the_newest_and_stamps_with_the_time_of_its_input() {
    let (looks, looked) = sync_channel(10);
    let (release, released) = sync_channel(10);
    let kept = Kept::default();
    let camera = Camera { kept: Arc::clone(&kept), looks: looked, release };
    let slow = Slow { looks, released };
    let session_of = session(Pace::Live, &kept, vec![Box::new(camera)], vec![Box::new(slow)]);
    let outcome = session_of.run(pending()).await;
    let [worker] = &outcome.workers[..] else { panic!("{outcome:?}") };
    assert_eq!((worker.counts, &worker.error), (WorkerCounts { taken: 2, skipped: 18 }, &None));

    let first = taken(&kept);
    assert_eq!(measured(&first, CAMERA).len(), FRAMES);
    let last = (FRAMES - 1) as f64;
    assert_eq!(measured(&first, FACE), [(100.0, 0.0), (100.0 + last, last)]);

    // In a replay no worker runs, and its results are the same.
    let recording = Box::new(Recording(first.clone()));
    session(Pace::Recorded, &kept, vec![recording], Vec::new()).run(pending()).await;
    let again = taken(&kept);
    assert_eq!(measured(&again, FACE), measured(&first, FACE));
    assert_eq!(derived(&again), derived(&first));
}

/// Hands over numbers until the session is over.
struct Numbers;

#[async_trait]
impl Source for Numbers {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = outlet.declare(Stream::raw(CAMERA, Subject::robot("r1"), Shape::Sample));
        while !outlet.is_closed() {
            outlet.offer(number(stream, outlet.clock().now(), 0.0));
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        Ok(())
    }
}

/// What happens to a worker at its first record.
enum Fate {
    Panics,
    /// It fails, and works after a restart.
    Fails,
    /// It fails at each of them.
    AlwaysFails,
    NeverReturns,
}

struct Doomed {
    fate: Fate,
    runs: usize,
    worked: SyncSender<()>,
}

impl Worker for Doomed {
    fn wants(&self) -> Wants {
        Wants::Everything
    }

    fn run(&mut self, feed: &Feed, _: &Outlet) -> Result<(), WorkerError> {
        self.runs += 1;
        while !matches!(feed.next(Duration::from_secs(1)), Fed::Records(_)) {
            if feed.is_closed() {
                return Ok(());
            }
        }
        match self.fate {
            Fate::Panics => panic!("this frame is one too many"),
            Fate::Fails if self.runs == 1 => {
                let (message, hint) = ("read model.onnx".to_owned(), String::new());
                return Err(WorkerError { message, hint });
            }
            Fate::AlwaysFails => {
                if self.runs > 1 {
                    self.worked.send(()).expect("the test waits");
                }
                let (message, hint) = ("read model.onnx".to_owned(), String::new());
                return Err(WorkerError { message, hint });
            }
            Fate::Fails => self.worked.send(()).expect("the test waits"),
            Fate::NeverReturns => {
                self.worked.send(()).expect("the test waits");
                loop {
                    std::thread::park();
                }
            }
        }
        Ok(())
    }
}

/// Runs a session with a worker until it has worked, or a fault that lasts was recorded.
async fn doom(fate: Fate) -> (Outcome, Vec<String>) {
    let (worked, has_worked) = sync_channel(10);
    let kept = Kept::default();
    let never_returns = matches!(fate, Fate::NeverReturns);
    let doomed = Doomed { fate, runs: 0, worked };
    let mut session = session(Pace::Live, &kept, vec![Box::new(Numbers)], vec![Box::new(doomed)]);
    session.clock = Clock::host();
    let is_lasting = || {
        let kept = kept.lock().expect("nobody panicked");
        kept.iter().any(|record| {
            matches!(&record.sample.data, Data::Event(event)
            if event.kind == EventKind::Fault && event.duration_secs.is_nan())
        })
    };
    let over = async {
        until(|| has_worked.try_recv().is_ok() || is_lasting()).await;
    };
    // Only a worker that never returns is not waited for.
    let outcome = if never_returns {
        session.run_until(over, ready(())).await
    } else {
        session.run(over).await
    };
    let faults = taken(&kept).into_iter().filter_map(|record| match record.sample.data {
        Data::Event(event) if event.kind == EventKind::Fault => Some(event.label.clone()),
        _ => None,
    });
    (outcome, faults.collect())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_worker_that_panics_is_left_out_and_named() {
    let (outcome, faults) = doom(Fate::Panics).await;
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    assert!(fault.starts_with("model: failed to continue: it panicked: this frame"), "{fault}");
    let error = outcome.workers[0].error.as_ref().expect("an error");
    assert!(error.message.contains("it panicked"), "{error}");
    assert!(outcome.sinks.is_empty() && outcome.sources.is_empty() && outcome.pump.is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_worker_that_fails_is_run_again() {
    let (outcome, faults) = doom(Fate::Fails).await;
    assert_eq!(faults, ["model: failed to read model.onnx"]);
    assert_eq!(outcome.workers[0].error, None);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_worker_that_has_processed_nothing_ends_with_its_error() {
    let (outcome, faults) = doom(Fate::AlwaysFails).await;
    assert_eq!(faults[0], "model: failed to read model.onnx");
    let [worker] = &outcome.workers[..] else { panic!("{outcome:?}") };
    assert_eq!(worker.counts.taken, 0);
    assert_eq!(worker.error.as_ref().expect("an error").message, "read model.onnx");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_worker_that_never_returns_is_abandoned_and_named() {
    let (outcome, _) = doom(Fate::NeverReturns).await;
    let error = outcome.workers[0].error.as_ref().expect("an error");
    assert!(error.message.starts_with("stop in time"), "{error}");
    assert!(outcome.sinks.is_empty());
}
