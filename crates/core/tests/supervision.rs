//! Components that panic, stall or never return are dropped and named, and the session goes on.

mod session;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use proptest::prelude::*;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::fault::{FAULTS, is_lasting};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::outlet::Outlet;
use teampulse_core::pump::Encode;
use teampulse_core::sample::{Record, Sample};
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::session_streams::END;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Origin, Shape, Stream, StreamId, Subject};
use teampulse_core::streams::Streams;

use session::{Keeper, Recording, derived, encode};

/// The number of readings of each source.
const READINGS: u64 = 300;
/// The reading at which something panics.
const MIDWAY: u64 = 150;

/// Hands over numbers, and panics at one of them if asked to.
struct Numbers {
    id: &'static str,
    panics_at: Option<u64>,
}

#[async_trait]
impl Source for Numbers {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let name = format!("/{}/number", self.id);
        let stream = Stream::raw(name, Subject::robot(self.id), Shape::Sample);
        let stream = outlet.declare(stream.with_channels(&[("number", "1")]));
        for k in 0..READINGS {
            assert_ne!(self.panics_at, Some(k), "reading {k} is one too many");
            let data = Data::Sample(Arc::new([k as f64]));
            outlet.offer(Reading {
                index: None,
                stream,
                device_time: None,
                source_time: None,
                data,
            });
            tokio::task::yield_now().await;
        }
        Ok(())
    }
}

/// Where a feature panics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    Nowhere,
    Accepting,
    Starting,
    Joining,
    /// The reading with this number.
    Pushing(u64),
    Ticking,
}

/// Doubles numbers of robots, and panics at some point for one of them.
struct Doubling(At);

struct Doubles {
    at: At,
    pushed: u64,
    output: Option<OutputId>,
}

fn is_unlucky(stream: &Stream) -> bool {
    stream.id == "r1"
}

impl Feature for Doubling {
    fn accepts(&self, stream: &Stream) -> bool {
        let is_input = stream.name.ends_with("/number");
        let panics = self.0 == At::Accepting && is_input && is_unlucky(stream);
        assert!(!panics, "in accepts");
        is_input
    }

    fn scope(&self) -> Scope {
        Scope::Stream
    }

    fn start(&self, stream: &Stream) -> Box<dyn Extractor> {
        let at = if is_unlucky(stream) { self.0 } else { At::Nowhere };
        assert_ne!(at, At::Starting, "in start");
        Box::new(Doubles { at, pushed: 0, output: None })
    }
}

impl Extractor for Doubles {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        let doubles = Stream::derived(stream, "doubles", Shape::Sample);
        self.output = Some(out.declare(doubles));
        assert_ne!(self.at, At::Joining, "in join");
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        let Data::Sample(numbers) = &sample.data else { return };
        let output = self.output.expect("a stream joins before its samples");
        out.emit(output, sample.measured, Data::Sample(Arc::new([numbers[0] * 2.0])));
        self.pushed += 1;
        assert_ne!(self.at, At::Pushing(self.pushed), "in push");
    }

    fn tick(&mut self, _: teampulse_core::time::Time, _: &mut Outputs) {
        assert_ne!(self.at, At::Ticking, "in tick");
    }
}

/// A sink that panics once it has received this many records.
struct Clumsy {
    delivery: Delivery,
    after: u64,
}

impl Sink for Clumsy {
    fn name(&self) -> &'static str {
        "clumsy"
    }

    fn delivery(&self) -> Delivery {
        self.delivery
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let mut received = 0;
        while received < self.after {
            if let Received::Batch(batch) = inbox.receive(Duration::from_secs(1)) {
                received += batch.len() as u64;
            }
        }
        panic!("dropped it");
    }
}

#[derive(Default)]
struct Parts {
    sources: Vec<Box<dyn Source>>,
    feature: Option<At>,
    sinks: Vec<Box<dyn Sink>>,
    encode: Option<Encode>,
}

/// Runs a session until two robots have published all their numbers and the awaited records have been kept.
async fn keep(parts: Parts, is_over: fn(&[Record]) -> bool) -> (Vec<Record>, Outcome) {
    let kept = Arc::<Mutex<Vec<Record>>>::default();
    let mut sinks = parts.sinks;
    sinks.push(Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO }));
    let mut sources: Vec<(String, Box<dyn Source>)> = vec![
        ("r1".into(), Box::new(Numbers { id: "r1", panics_at: None })),
        ("r2".into(), Box::new(Numbers { id: "r2", panics_at: None })),
        ("silence".into(), Box::new(Silence)),
    ];
    sources.extend(parts.sources.into_iter().map(|source| ("unlucky".to_owned(), source)));
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources,
        features: parts
            .feature
            .map(|at| ("doubling", Arc::new(Doubling(at)) as _))
            .into_iter()
            .collect(),
        sinks,
        workers: Vec::new(),
        encode: parts.encode.unwrap_or(encode),
        commands: Commands::default(),
    };
    let seen = Arc::clone(&kept);
    let over = async move {
        while !is_over(&seen.lock().expect("nobody panicked")) {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    };
    let outcome = session.run(over).await;
    let kept = std::mem::take(&mut *kept.lock().expect("nobody panicked"));
    (kept, outcome)
}

/// Hands over nothing until the session is over.
struct Silence;

#[async_trait]
impl Source for Silence {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        outlet.closed().await;
        Ok(())
    }
}

fn of<'a>(records: &'a [Record], name: &str) -> Vec<&'a Record> {
    records.iter().filter(|record| record.stream.name == name).collect()
}

fn event(record: &Record) -> Option<&Event> {
    match &record.sample.data {
        Data::Event(event) => Some(event),
        _ => None,
    }
}

fn lasting_faults(records: &[Record]) -> Vec<String> {
    let lasting = records
        .iter()
        .filter_map(|record| event(record).filter(|event| is_lasting(&record.stream, event)));
    lasting.map(|event| event.label.clone()).collect()
}

fn has_all(records: &[Record]) -> bool {
    let count = |id| of(records, id).len() as u64;
    count("/r1/number") == READINGS && count("/r2/number") == READINGS
}

fn ended_well(records: &[Record]) -> bool {
    records.iter().filter_map(event).any(|e| e.kind == EventKind::Clock && e.label == END)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_feature_that_panics_is_left_out_and_named_and_all_others_go_on() {
    let places = [
        (At::Accepting, "in accepts"),
        (At::Starting, "in start"),
        (At::Joining, "in join"),
        (At::Pushing(MIDWAY), "in push"),
        (At::Ticking, "in tick"),
    ];
    for (at, message) in places {
        let over = |records: &[Record]| has_all(records) && !lasting_faults(records).is_empty();
        let parts = Parts { feature: Some(at), ..Parts::default() };
        let (records, outcome) = keep(parts, over).await;
        assert!(has_all(&records) && ended_well(&records), "{at:?}");
        let faults = lasting_faults(&records);
        assert_eq!(faults.len(), 1, "{at:?}: {faults:?}");
        assert!(faults[0].contains("feature doubling of /r1/number panicked"), "{faults:?}");
        assert!(faults[0].contains(message), "{faults:?}");
        assert_eq!(of(&records, FAULTS)[0].stream.origin, Origin::Derived);
        assert_eq!(outcome.features.len(), 1);
        assert!(outcome.sinks.is_empty() && outcome.sources.is_empty() && outcome.pump.is_none());
        let others = of(&records, "/r2/number/doubles").len() as u64;
        let whole = at == At::Accepting || at == At::Starting;
        assert!(whole || others == READINGS, "{at:?}: {others}");
        let own = of(&records, "/r1/number/doubles").len() as u64;
        assert!(own < READINGS || at == At::Ticking);
        if at == At::Pushing(MIDWAY) {
            assert_eq!(own, MIDWAY - 1, "what was given before the panic stays");
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_replay_panics_where_its_run_did() {
    let parts = Parts { feature: Some(At::Pushing(MIDWAY)), ..Parts::default() };
    let (run, _) = keep(parts, has_all).await;
    let kept = Arc::<Mutex<Vec<Record>>>::default();
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("recording".into(), Box::new(Recording(run.clone())))],
        features: vec![("doubling", Arc::new(Doubling(At::Pushing(MIDWAY))))],
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let outcome = session.run(std::future::pending()).await;
    let replay = std::mem::take(&mut *kept.lock().unwrap());
    assert_eq!(outcome.features.len(), 1);
    assert!(derived(&replay) == derived(&run));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_source_that_panics_has_failed_and_the_others_go_on() {
    let unlucky = Numbers { id: "r3", panics_at: Some(MIDWAY) };
    let parts = Parts { sources: vec![Box::new(unlucky)], ..Parts::default() };
    let over = |records: &[Record]| has_all(records) && !lasting_faults(records).is_empty();
    let (records, outcome) = keep(parts, over).await;
    assert!(ended_well(&records));
    assert_eq!(of(&records, "/r3/number").len() as u64, MIDWAY, "what it gave before is kept");
    let [fault] = &lasting_faults(&records)[..] else { panic!() };
    assert!(fault.starts_with("unlucky: failed to continue: it panicked: "), "{fault}");
    assert!(fault.ends_with("reading 150 is one too many"), "{fault}");
    let [(name, SourceError::Fatal { hint, .. })] = &outcome.sources[..] else { panic!() };
    assert_eq!(name, "unlucky");
    assert!(hint.contains("report it"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_sink_that_panics_has_lost_what_it_should_keep_and_the_others_go_on() {
    for delivery in [Delivery::Lossless, Delivery::Fresh] {
        let parts =
            Parts { sinks: vec![Box::new(Clumsy { delivery, after: 1 })], ..Parts::default() };
        let over = |records: &[Record]| has_all(records) && !lasting_faults(records).is_empty();
        let (records, outcome) = keep(parts, over).await;
        assert!(ended_well(&records));
        assert_eq!(
            lasting_faults(&records),
            ["clumsy: failed to continue: it panicked: dropped it"]
        );
        let [("clumsy", error)] = &outcome.sinks[..] else { panic!("{outcome:?}") };
        let is_lost = matches!(error, SinkError::Lost { .. });
        assert_eq!(is_lost, delivery == Delivery::Lossless, "{error:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pump_that_panics_ends_the_session_at_once_and_each_sink_knows() {
    fn fragile(sample: &Sample) -> Bytes {
        let is_last = matches!(&sample.data, Data::Sample(numbers) if numbers[0] as u64 == MIDWAY);
        assert!(!is_last, "no room for it");
        encode(sample)
    }
    let parts = Parts { encode: Some(fragile), ..Parts::default() };
    // Nobody asks for the end: it comes by itself.
    let (records, outcome) = keep(parts, |_| false).await;
    assert!(!of(&records, "/r1/number").is_empty(), "what came before is kept");
    assert_eq!(outcome.pump.expect("it panicked").message, "no room for it");
    let [("keeper", SinkError::Lost { message, .. })] = &outcome.sinks[..] else { panic!() };
    assert_eq!(message, "continue: the pump panicked: no room for it");
}

/// The component that panics, at a random time in a session.
#[derive(Clone, Copy, Debug)]
enum Unlucky {
    Source,
    Feature,
    Sink(Delivery),
    Pump,
}

/// The number that can't be encoded: the pump panics at it.
static UNENCODABLE: AtomicU64 = AtomicU64::new(u64::MAX);

fn encode_but_one(sample: &Sample) -> Bytes {
    let unencodable = UNENCODABLE.load(Ordering::Relaxed);
    let is_one = matches!(&sample.data, Data::Sample(numbers) if numbers[0] as u64 == unencodable);
    assert!(!is_one, "no room for it");
    encode(sample)
}

fn panic_at(unlucky: Unlucky, moment: u64) -> Parts {
    let mut parts = Parts::default();
    match unlucky {
        Unlucky::Source => {
            parts.sources.push(Box::new(Numbers { id: "r3", panics_at: Some(moment) }));
        }
        Unlucky::Feature => parts.feature = Some(At::Pushing(moment + 1)),
        Unlucky::Sink(delivery) => parts.sinks.push(Box::new(Clumsy { delivery, after: moment })),
        Unlucky::Pump => {
            UNENCODABLE.store(moment, Ordering::Relaxed);
            parts.encode = Some(encode_but_one);
        }
    }
    parts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn what_panics_is_named_whenever_it_does_and_nothing_of_the_others_is_lost(
        unlucky in prop_oneof![
            Just(Unlucky::Source),
            Just(Unlucky::Feature),
            Just(Unlucky::Sink(Delivery::Lossless)),
            Just(Unlucky::Sink(Delivery::Fresh)),
            Just(Unlucky::Pump),
        ],
        moment in 0..READINGS,
    ) {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .expect("a runtime");
        let over = |records: &[Record]| has_all(records) && !lasting_faults(records).is_empty();
        let (records, outcome) = runtime.block_on(keep(panic_at(unlucky, moment), over));
        let count = |name| of(&records, name).len() as u64;
        if let Unlucky::Pump = unlucky {
            prop_assert_eq!(outcome.pump.expect("it panicked").message, "no room for it");
            prop_assert!(count("/r1/number").max(count("/r2/number")) >= moment);
            return Ok(());
        }
        prop_assert!(has_all(&records) && ended_well(&records));
        prop_assert_eq!(lasting_faults(&records).len(), 1);
        let named = [outcome.sources.len(), outcome.features.len(), outcome.sinks.len()];
        let (expected, kept, of_it) = match unlucky {
            Unlucky::Source => ([1, 0, 0], "/r3/number", moment),
            Unlucky::Feature => ([0, 1, 0], "/r1/number/doubles", moment),
            _ => ([0, 0, 1], "/r1/number", READINGS),
        };
        prop_assert_eq!(named, expected);
        prop_assert_eq!(count(kept), of_it, "what came before the panic is kept");
    }
}

/// A sink that takes nothing until it is released.
struct Stubborn(Arc<(Mutex<bool>, Condvar)>);

impl Sink for Stubborn {
    fn name(&self) -> &'static str {
        "stubborn"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, _: Inbox) -> Result<(), SinkError> {
        let (let_go, changed) = &*self.0;
        let held = let_go.lock().expect("nobody panicked");
        drop(changed.wait_while(held, |let_go| !*let_go).expect("nobody panicked"));
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn in_a_hurry_a_sink_that_does_not_end_is_abandoned_and_named() {
    let held = Arc::<(Mutex<bool>, Condvar)>::default();
    let kept = Arc::<Mutex<Vec<Record>>>::default();
    let sinks: Vec<Box<dyn Sink>> = vec![
        Box::new(Stubborn(Arc::clone(&held))),
        Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO }),
    ];
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("r1".into(), Box::new(Numbers { id: "r1", panics_at: None }))],
        features: Vec::new(),
        sinks,
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let outcome = session.run_until(std::future::pending(), std::future::ready(())).await;
    let [("stubborn", SinkError::Lost { message, hint })] = &outcome.sinks[..] else { panic!() };
    assert!(message.starts_with("end in time"), "{message}");
    assert!(hint.contains("recover"), "{hint}");
    let records = std::mem::take(&mut *kept.lock().unwrap());
    assert_eq!(of(&records, "/r1/number").len() as u64, READINGS);
    assert!(ended_well(&records), "the others end whole");
    *held.0.lock().unwrap() = true;
    held.1.notify_all();
}

/// A source that ignores the end of the session.
struct Deaf;

#[async_trait]
impl Source for Deaf {
    async fn run(&mut self, _: &Outlet) -> Result<(), SourceError> {
        std::future::pending().await
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_source_that_does_not_end_is_abandoned_and_named() {
    let kept = Arc::<Mutex<Vec<Record>>>::default();
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("deaf".into(), Box::new(Deaf))],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause: Duration::ZERO })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let outcome = session.run_until(std::future::ready(()), std::future::ready(())).await;
    assert_eq!(outcome.undone, ["deaf: it did not stop"]);
    assert!(ended_well(&kept.lock().unwrap()));
}
