//! The pump's contract, with sources and sinks made for it.

mod session;

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{About, Origin, Schema, Shape, Stream, StreamId, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use session::{Keeper, Recording, derived, encode};

/// Counts samples and ticks of a robot's raw streams, and reports both at every tenth sample.
struct Counting;

#[derive(Default)]
struct Counts {
    samples: u64,
    late: u64,
    ticks: u64,
    output: Option<OutputId>,
}

impl Feature for Counting {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.about == About::Robot && stream.origin == Origin::Raw
    }

    fn scope(&self) -> Scope {
        Scope::Subject
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Counts::default())
    }
}

impl Extractor for Counts {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        let mut counts = Stream::derived(stream, "counts", Shape::Sample);
        counts.name = format!("/{}/counts", stream.id);
        self.output.get_or_insert_with(|| out.declare(counts));
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        self.samples += 1;
        if self.samples.is_multiple_of(10) {
            let counts = [self.samples, self.late, self.ticks].map(|count| count as f64);
            let output = self.output.expect("a stream joins before its samples");
            out.emit(output, sample.measured, Data::Sample(Arc::new(counts)));
        }
    }

    fn push_late(&mut self, _: &Sample, _: &mut Outputs) {
        self.late += 1;
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.ticks += 1;
        if self.ticks.is_multiple_of(2) {
            let output = self.output.expect("a stream joins before any tick");
            out.emit(output, now, Data::Sample(Arc::new([self.ticks as f64])));
        }
    }
}

/// A robot that publishes at a set rate, sometimes late or twice.
struct Robot {
    id: &'static str,
    messages: u64,
    failures: u64,
}

fn robot_stream(id: &str) -> Stream {
    let schema = Schema {
        name: "test_msgs/msg/Any".into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    Stream::raw(format!("/{id}/any"), Subject::robot(id), Shape::Message(Arc::new(schema)))
}

#[async_trait]
impl Source for Robot {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        if self.failures > 0 {
            self.failures -= 1;
            return Err(SourceError::Gone { message: "find it".into(), hint: "plug it in".into() });
        }
        let stream = outlet.declare(robot_stream(self.id));
        for k in 0..self.messages {
            let stamp =
                outlet.clock().now() - Duration::from_micros(if k % 50 == 49 { 90_000 } else { 0 });
            let data = Data::Message(Bytes::copy_from_slice(&k.to_le_bytes()));
            let reading =
                Reading { index: None, stream, device_time: None, source_time: Some(stamp), data };
            if k % 70 == 69 {
                outlet.offer(reading.clone());
                outlet.lost(stream, 2);
            }
            outlet.offer(reading);
            if k % 5 == 0 {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
        Ok(())
    }
}

async fn keep(
    sources: Vec<Box<dyn Source>>,
    pace: Pace,
    pause: Duration,
) -> (Vec<Record>, Outcome) {
    let kept = Arc::default();
    let clock = if pace == Pace::Live { Clock::host() } else { Clock::settable() };
    let session = Session {
        clock,
        pace,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: sources.into_iter().map(|source| ("test".to_owned(), source)).collect(),
        features: vec![("counting", Arc::new(Counting))],
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let outcome = session.run(std::future::pending()).await;
    let kept = std::mem::take(&mut *kept.lock().expect("nobody panicked"));
    (kept, outcome)
}

async fn live() -> Vec<Record> {
    let robots = ["r1", "r2", "r3"].map(|id| Robot { id, messages: 700, failures: 0 });
    let sources = robots.into_iter().map(|robot| Box::new(robot) as Box<dyn Source>).collect();
    keep(sources, Pace::Live, Duration::ZERO).await.0
}

/// Two streams that another recorder has stamped with the same times.
struct Synchronous;

#[async_trait]
impl Source for Synchronous {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let streams: Vec<StreamId> = ["r1", "r2"]
            .map(|id| outlet.declare_at(robot_stream(id), Time::from_nanos(SECOND - 1)))
            .to_vec();
        for k in 1..=3 {
            for stream in &streams {
                let data = Data::Message(Bytes::from_static(&[0, 1, 0, 0]));
                let (stream, source_time) = (*stream, None);
                let reading = Reading { index: None, stream, device_time: None, source_time, data };
                if outlet.send(reading, Time::from_nanos(k * SECOND)).await.is_err() {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

const SECOND: i64 = 1_000_000_000;

#[tokio::test]
async fn equal_times_of_a_recording_stay_equal() {
    let (records, _) = keep(vec![Box::new(Synchronous)], Pace::Recorded, Duration::ZERO).await;
    let times = |records: &[Record]| -> Vec<(i64, i64)> {
        let messages = records.iter().filter(|each| matches!(each.sample.data, Data::Message(_)));
        let times = messages.map(|each| (each.sample.measured, each.sample.log_time));
        times.map(|(measured, log_time)| (measured.nanos(), log_time.nanos())).collect()
    };
    let expected = [1, 1, 2, 2, 3, 3].map(|secs| (secs * SECOND, secs * SECOND));
    assert_eq!(times(&records), expected);
    let again = Recording(records.clone());
    let (again, _) = keep(vec![Box::new(again)], Pace::Recorded, Duration::ZERO).await;
    assert_eq!(times(&again), expected);
    assert_eq!(derived(&records), derived(&again));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_replay_equals_the_run_it_came_from() {
    let run = live().await;
    assert!(derived(&run).len() > 200);
    for pause_ms in [0, 1, 3] {
        let again: Vec<Box<dyn Source>> = vec![Box::new(Recording(run.clone()))];
        let pause = Duration::from_millis(pause_ms);
        let (replay, _) = keep(again, Pace::Recorded, pause).await;
        assert!(derived(&replay) == derived(&run), "a pause of {pause_ms} ms changed the replay");
        assert_eq!(replay.len(), run.len());
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn raw_samples_have_rising_log_times_and_gaps_where_they_were_lost() {
    let run = live().await;
    let raw: Vec<&Record> =
        run.iter().filter(|record| record.stream.origin == Origin::Raw).collect();
    assert!(raw.windows(2).all(|pair| pair[0].sample.log_time < pair[1].sample.log_time));
    let of_one = raw.iter().filter(|record| record.stream.name == "/r1/any");
    let indices: Vec<u64> = of_one.map(|record| record.sample.index).collect();
    let gaps = indices.windows(2).filter(|pair| pair[1] == pair[0] + 3).count();
    assert_eq!((indices.len(), gaps), (710, 10));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn late_and_repeated_samples_are_kept_and_counted() {
    let run = live().await;
    let turns = |turn| {
        let of_one = run.iter().filter(|record| record.stream.name == "/r1/any");
        of_one.filter(|record| record.sample.turn == turn).count() as u64
    };
    assert_eq!((turns(Turn::Late), turns(Turn::Duplicate)), (14, 10));
    let health = run.iter().filter_map(|record| match &record.sample.data {
        Data::Status(status) if status.name == "/r1/any" => Some(status),
        _ => None,
    });
    if let Some(last) = health.last() {
        assert!(last.late <= 14 && last.duplicates <= 10);
    }
}

#[tokio::test(start_paused = true)]
async fn a_source_that_fails_is_run_again_and_its_failures_are_reported() {
    let robot = Robot { id: "r1", messages: 3, failures: 2 };
    let (records, outcome) = keep(vec![Box::new(robot)], Pace::Live, Duration::ZERO).await;
    let faults = records.iter().filter(|record| {
        matches!(&record.sample.data, Data::Event(event) if event.kind == EventKind::Fault
            && event.label == "test: failed to find it; plug it in")
    });
    assert_eq!(faults.count(), 2);
    assert_eq!(records.iter().filter(|record| record.stream.name == "/r1/any").count(), 3);
    assert!(outcome.sources.is_empty());
}

#[tokio::test]
async fn the_end_is_recorded_after_everything_raw() {
    let robot = Robot { id: "r1", messages: 3, failures: 0 };
    let (records, _) = keep(vec![Box::new(robot)], Pace::Live, Duration::ZERO).await;
    let end = Event { kind: EventKind::Clock, label: "end".into(), value: 0.0, duration_secs: 0.0 };
    let raw = records.iter().filter(|record| record.stream.origin == Origin::Raw);
    let last = raw.last().map(|record| &record.sample.data);
    assert!(
        matches!(last, Some(Data::Event(event)) if event.kind == end.kind && event.label == end.label)
    );
}

/// Hands over a reading, and the next one only after the first was delivered.
struct Paced(Arc<std::sync::Mutex<Vec<Record>>>);

#[async_trait]
impl Source for Paced {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = outlet.declare_at(robot_stream("r1"), Time::from_nanos(1));
        for k in 1..=3_i64 {
            let data = Data::Message(Bytes::copy_from_slice(&k.to_le_bytes()));
            let reading =
                Reading { index: None, stream, device_time: None, source_time: None, data };
            outlet.send(reading, Time::from_nanos(10 * k)).await.expect("the session goes on");
            let delivered = || {
                let kept = self.0.lock().expect("nobody panicked");
                kept.iter().filter(|record| record.stream.name == "/r1/any").count() as i64
            };
            while delivered() < k {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_that_is_played_slowly_is_delivered_as_it_comes() {
    let kept = Arc::default();
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("test".into(), Box::new(Paced(Arc::clone(&kept))))],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper { kept, pause: Duration::ZERO })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let ended = tokio::time::timeout(Duration::from_secs(30), session.run(std::future::pending()));
    assert!(ended.await.is_ok(), "readings are held back");
}

/// Takes a long time for each sample.
struct Slow;

impl Feature for Slow {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.about == About::Robot
    }

    fn scope(&self) -> Scope {
        Scope::Subject
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Slow)
    }
}

impl Extractor for Slow {
    fn join(&mut self, _: StreamId, _: &Stream, _: &mut Outputs) {}

    fn push(&mut self, _: &Sample, _: &mut Outputs) {
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Hands over more than features can take, all at once.
struct Flood(u64);

#[async_trait]
impl Source for Flood {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = outlet.declare(robot_stream("r1"));
        for k in 0..self.0 {
            let data = Data::Message(Bytes::copy_from_slice(&k.to_le_bytes()));
            outlet.offer(Reading {
                index: None,
                stream,
                device_time: None,
                source_time: None,
                data,
            });
        }
        Ok(())
    }
}

/// All features together would take a hundred minutes.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_session_ends_when_it_is_asked_to_and_counts_what_it_could_not_take() {
    let kept: Arc<std::sync::Mutex<Vec<Record>>> = Arc::default();
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("test".into(), Box::new(Flood(120_000)))],
        features: vec![("slow", Arc::new(Slow))],
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let outcome = session.run(std::future::ready(())).await;
    let kept = kept.lock().expect("nobody panicked");
    let taken = kept.iter().filter(|record| record.stream.name == "/r1/any").count() as u64;
    assert_eq!(taken + outcome.dropped, 120_000);
    let reported = kept.iter().filter(|record| record.stream.name == "/teampulse/lost_queue");
    assert_eq!(reported.count(), usize::from(outcome.dropped > 0));
    let labels = kept.iter().filter_map(|record| match &record.sample.data {
        Data::Event(event) => Some(event.label.as_str()),
        _ => None,
    });
    assert_eq!(labels.filter(|label| label.contains("no features were computed")).count(), 1);
    assert!(matches!(
        &kept.last().expect("the end is reported").sample.data,
        Data::Event(_) | Data::Status(_)
    ));
}

/// Hands over a reading, and one from hours later.
struct Leap;

#[async_trait]
impl Source for Leap {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = outlet.declare_at(robot_stream("r1"), Time::from_nanos(1));
        for at in [1, 20 * 3_600_000_000_000] {
            let data = Data::Message(Bytes::from_static(b"x"));
            let reading =
                Reading { index: None, stream, device_time: None, source_time: None, data };
            outlet.send(reading, Time::from_nanos(at)).await.expect("the session goes on");
        }
        Ok(())
    }
}

/// Notes how large the largest batch was, and how many records arrived.
struct Largest(Arc<std::sync::Mutex<(usize, usize)>>);

impl Sink for Largest {
    fn name(&self) -> &'static str {
        "largest"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    let mut noted = self.0.lock().expect("nobody panicked");
                    *noted = (noted.0.max(batch.len()), noted.1 + batch.len());
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_ticks_of_a_long_silence_are_handed_over_in_portions() {
    let noted = Arc::default();
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("test".into(), Box::new(Leap))],
        features: Vec::new(),
        sinks: vec![Box::new(Largest(Arc::clone(&noted)))],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await;
    let (largest, all) = *noted.lock().expect("nobody panicked");
    assert!(all > 72_000 && largest < 2100, "{largest} of {all}");
}
