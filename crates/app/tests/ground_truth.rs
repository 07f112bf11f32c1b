//! What a bag contains about a person, against the truth of that person's body: through the drivers, the time filter
//! and the bag.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use teampulse_bag::{Bag, BagSink, Options};
use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::{ClockSettings, Clocks};
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::{Data, EventKind};
use teampulse_core::registry::Settings;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::Source;
use teampulse_core::stream::Stream;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_emulators::body::{Body, Traits};
use teampulse_emulators::devices::{
    BodyWearer, H10, H10Settings, Myo, Peripheral, Shimmer, ShimmerSettings, Strap, StrapSettings,
    Wearer,
};
use teampulse_emulators::task::{Operator, Plan, Skill, Task};
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_messages::convert::{decode, encode};
use teampulse_ros::buses::Buses;
use teampulse_sources::claims::Claims;
use teampulse_sources::emulated::bluetooth::{EmulatedBluetooth, EmulatedDevice};
use teampulse_sources::emulated::serve_shimmer;
use teampulse_sources::serial::Pty;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::{SOURCES, SourceContext};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The number of beats that the straps are recorded for; by the fiftieth, the delay of a strap without a clock is
/// known.
const BEATS: usize = 60;
/// Before this, beats of the H10 do not count: its delay is only learned after some packets.
const SETTLED_SECS: f64 = 10.0;
const H10_ADDRESS: &str = "A0:9E:1A:00:00:01";
const STRAP_ADDRESS: &str = "A0:9E:1A:00:00:02";
const MYO_ADDRESS: &str = "A0:9E:1A:00:00:03";
/// The clock of an H10 when it is switched on, which was never set: 2019-01-01 [ns since 2000-01-01].
const H10_BEGAN_NS: i64 = 599_616_000_000_000_000;
/// A clock is judged by the least delayed packet of each span of this length [s].
const BIN_SECS: f64 = 2.0;
/// The period of a Myo's EMG samples [s].
const EMG_SECS: f64 = 0.005;

fn body() -> BodyWearer {
    let body = Body::new(&Traits::of_seed(7), 7);
    BodyWearer::new(Operator::new(body, Task::new(Plan::default(), Skill::of_seed(7), 7)))
}

/// A sink that counts the intervals between beats.
struct Counter(Arc<AtomicUsize>);

impl Sink for Counter {
    fn name(&self) -> &'static str {
        "counter"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let is_beat = |record: &&Record| {
            record.stream.name == "/humans/persons/p002/heart_rate_strap/rr_interval"
        };
        loop {
            match inbox.receive(Duration::from_secs(1)) {
                Received::Batch(batch) => {
                    self.0.fetch_add(batch.iter().filter(is_beat).count(), Ordering::Relaxed);
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

fn source(kind: &str, settings: &str, context: &SourceContext) -> (String, Box<dyn Source>) {
    let entry = SOURCES.iter().find(|entry| entry.kind == kind).expect("is a source");
    let table = DeTable::parse(settings).expect("is TOML").into_inner();
    let table = Spanned::new(0..settings.len(), DeValue::Table(table));
    let built = (entry.build)(Settings::new(table), context);
    (kind.to_owned(), built.unwrap_or_else(|error| panic!("{}: {error}", error.path)))
}

/// An emulated `BlueZ` with two straps and an armband on one body.
async fn bluez(worn: &BodyWearer, switched_on: Stopwatch) -> EmulatedBluetooth {
    let device = |address: &str, peripheral: Box<dyn Peripheral>| EmulatedDevice {
        address: address.into(),
        peripheral,
        wearer: Box::new(worn.clone()),
        incidents: Vec::new(),
    };
    let devices = vec![
        device(H10_ADDRESS, Box::new(H10::new(H10Settings::default()))),
        device(STRAP_ADDRESS, Box::new(Strap::new(StrapSettings::default()))),
        device(MYO_ADDRESS, Box::<Myo>::default()),
    ];
    let bluez = EmulatedBluetooth::start(devices, switched_on).await;
    bluez.expect("dbus-daemon, which `make test` installs")
}

/// A session that reads all of them, and a Shimmer3, into a bag.
fn session(bluez: &EmulatedBluetooth, port: &str, sinks: Vec<Box<dyn Sink>>) -> Session {
    let clock = Clock::host();
    let context = SourceContext {
        clock: clock.clone(),
        buses: Arc::new(Buses::apart()),
        claims: Claims::default(),
        bluetooth: Bluetooth::at(bluez.bus_address()),
    };
    let worn = |kind: &str, person: &str, key: &str, place: &str| {
        source(kind, &format!("person = \"{person}\"\n{key} = \"{place}\""), &context)
    };
    // Calibrated: the emulated devices are not late.
    let calibrated = || ClockSettings { latency_secs: Some(0.0), ..ClockSettings::default() };
    let latencies = ["polar_h10", "heart_rate_strap", "myo", "shimmer3"];
    let latencies = latencies.map(|device| (device.to_owned(), calibrated()));
    let heart = FEATURES.iter().find(|entry| entry.kind == "heart").expect("is a feature");
    let heart = (heart.build)(Settings::empty(), &FeatureContext::default()).expect("its defaults");
    Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::new(latencies.into()),
        streams: Streams::default(),
        sources: vec![
            worn("polar", "p001", "address", H10_ADDRESS),
            worn("heart_rate", "p002", "address", STRAP_ADDRESS),
            worn("myo", "p001", "address", MYO_ADDRESS),
            worn("shimmer3", "p001", "port", port),
        ],
        features: vec![("heart", heart.into())],
        sinks,
        workers: Vec::new(),
        encode,
        commands: Commands::new(CommandSettings::default()),
    }
}

/// Records what four devices measure of one body into a bag; returns when they were switched on.
async fn record(folder: &Path) -> Time {
    let (worn, switched_on) = (body(), Stopwatch::start());
    let bluez = bluez(&worn, switched_on).await;
    let pty = Pty::open(None).expect("a pseudoterminal");
    let mut shimmer = Shimmer::new(ShimmerSettings::default());
    let mut at_fingers = worn.clone();
    let bag = BagSink { folder: folder.into(), study: String::new(), options: Options::default() };
    let beats = Arc::<AtomicUsize>::default();
    let counter = Counter(Arc::clone(&beats));
    let session = session(&bluez, pty.path(), vec![Box::new(bag), Box::new(counter)]);
    // The latest of some readings, as another program may run in the middle of one.
    let began = (0..100).map(|_| session.clock.now() - switched_on.elapsed()).max();
    let began = began.expect("there are some");
    let enough = async {
        let began = Stopwatch::start();
        while beats.load(Ordering::Relaxed) < BEATS && began.elapsed() < Duration::from_secs(100) {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let outcome = tokio::select! {
        outcome = session.run(enough) => outcome,
        ended = serve_shimmer(&pty, &mut shimmer, &mut at_fingers, switched_on) => panic!("{ended:?}"),
    };
    assert!(outcome.sources.is_empty() && outcome.sinks.is_empty(), "{outcome:?}");
    assert_eq!(outcome.dropped, 0);
    began
}

/// A bag recorded from devices, and when they were switched on.
struct Recorded {
    bag: Bag,
    began: Time,
}

/// A message of the bag.
struct Found {
    /// When it was measured and when it arrived, since the devices were switched on [s].
    secs: f64,
    arrived_secs: f64,
    /// The time on the device's own clock [ns].
    device_ns: Option<i64>,
    index: Option<u64>,
    data: Data,
}

impl Recorded {
    /// The messages of a topic.
    fn of(&self, topic: &str) -> (&Stream, Vec<Found>) {
        let streams = self.bag.streams();
        let place = streams.iter().position(|each| each.stream.name == topic);
        let place = place.unwrap_or_else(|| panic!("{topic} is not in the bag"));
        let messages = self.bag.messages(None).map(|message| message.expect("is whole"));
        let found = messages.filter(|message| message.stream == place).map(|message| {
            let decoded = decode(&message.schema.name, &message.cdr).expect("is one of ours");
            Found {
                secs: decoded.stamp.secs_since(self.began),
                arrived_secs: message.log_time.secs_since(self.began),
                device_ns: decoded.device_time,
                index: decoded.index,
                data: decoded.data,
            }
        });
        (&streams[place].stream, found.collect())
    }

    /// The beats that were found in the ECG [s].
    fn beats(&self) -> Vec<f64> {
        let (_, events) = self.of("/humans/persons/p001/polar_h10/ecg/beats");
        let is_beat = |found: &Found| matches!(&found.data, Data::Event(event) if event.kind == EventKind::Beat);
        events.into_iter().filter(is_beat).map(|found| found.secs).collect()
    }

    /// The minimum delay with which this machine sent frames of the H10's ECG, in the worst span [s].
    ///
    /// The emulated H10 stamps a frame with the moment at which it is due, and this machine sends it when it gets to
    /// it. A clock that is only known from its packets can't be known better than by the least delayed one.
    fn late_secs(&self) -> f64 {
        let (_, frames) = self.of("/humans/persons/p001/polar_h10/ecg");
        let mut least: BTreeMap<u64, f64> = BTreeMap::new();
        for frame in &frames {
            let Data::Wave(wave) = &frame.data else { panic!("not a wave") };
            let device_ns = frame.device_ns.expect("an H10 has a clock");
            let steps = wave.samples.len() as f64 - 1.0;
            let due_secs = ((device_ns - H10_BEGAN_NS) as f64 + steps * wave.period_ns) / 1e9;
            let late_secs = frame.arrived_secs - due_secs;
            let least = least.entry((due_secs / BIN_SECS) as u64).or_insert(late_secs);
            *least = least.min(late_secs);
        }
        least.into_values().fold(0.0, f64::max)
    }
}

/// The difference from each time to the nearest true one [s].
fn errors(secs: impl IntoIterator<Item = f64>, truth: &[f64]) -> Vec<f64> {
    let error = |secs: f64| {
        let errors = truth.iter().map(|truth_secs| secs - truth_secs);
        errors.min_by(|one, other| one.abs().total_cmp(&other.abs())).unwrap_or(f64::NAN)
    };
    secs.into_iter().map(error).collect()
}

fn worst(errors: &[f64]) -> f64 {
    assert!(!errors.is_empty());
    errors.iter().fold(0.0, |worst, error| worst.max(error.abs()))
}

fn beats_are_those_of_the_body(recorded: &Recorded, truth: &[f64]) {
    let found: Vec<f64> =
        recorded.beats().into_iter().filter(|secs| *secs > SETTLED_SECS).collect();
    let errors = errors(found.iter().copied(), truth);
    let late_secs = recorded.late_secs();
    eprintln!(
        "H10: {} beats in the bag within {:.1} ms of the body's (bar 5); this machine was late with each frame by up to {:.1} ms",
        found.len(),
        1e3 * worst(&errors),
        1e3 * late_secs
    );
    assert!(found.len() > 30, "{found:?}");
    let is_near = |error: &f64| (-0.005..0.005 + late_secs).contains(error);
    assert!(errors.iter().all(is_near), "{errors:?}");
    let span = |secs: &&f64| (found[0] - 0.1..found[found.len() - 1] + 0.1).contains(*secs);
    assert_eq!(found.len(), truth.iter().filter(span).count(), "one was missed or made up");
}

fn intervals_alone_show_the_beats(recorded: &Recorded, truth: &[f64]) {
    // By how much a measurement, which is sent at a full second, came later than on a machine that has time for it.
    let (_, measurements) = recorded.of("/humans/persons/p002/heart_rate_strap/heart_rate");
    let late_secs = |found: &Found| (found.arrived_secs.rem_euclid(1.0) - 0.010).max(0.0);
    let late_secs = measurements.iter().map(late_secs).fold(0.0, f64::max);
    let (_, intervals) = recorded.of("/humans/persons/p002/heart_rate_strap/rr_interval");
    let errors = errors(intervals.iter().skip(50).map(|found| found.secs), truth);
    eprintln!(
        "a strap without a clock: beats in the bag within {:.0} ms of the body's after 50 of them (bar 30); this machine was late by up to {:.0} ms more than usual",
        1e3 * worst(&errors),
        1e3 * late_secs
    );
    assert!(worst(&errors) < 0.030 + late_secs, "{errors:?}");
}

fn conductance_is_that_of_the_body(recorded: &Recorded) {
    let (stream, samples) = recorded.of("/humans/persons/p001/shimmer3/eda");
    let place = stream.channels.iter().position(|channel| channel.name == "conductance");
    let place = place.expect("is a channel");
    assert_eq!(stream.channels[place].unit, "uS");
    let mut truth = body();
    let deviation = |found: &Found| {
        let Data::Sample(values) = &found.data else { panic!("not a sample") };
        let measured_us = values[place] * stream.channels[place].scale;
        (measured_us / truth.conductance_us(found.secs) - 1.0).abs()
    };
    let deviations: Vec<f64> = samples.iter().map(deviation).collect();
    eprintln!(
        "Shimmer3: {} samples in the bag within {:.2} % of the skin's conductance (bar 1)",
        samples.len(),
        100.0 * worst(&deviations)
    );
    assert!(samples.len() > 1000 && worst(&deviations) < 0.01);
    let steps = samples.windows(2).map(|pair| pair[1].index.zip(pair[0].index));
    assert!(steps.flatten().all(|(next, one)| next == one + 1), "a sample is missing");
}

fn muscles_are_bit_for_bit(recorded: &Recorded) {
    let (_, waves) = recorded.of("/humans/persons/p001/myo/emg");
    let samples: Vec<[f64; 8]> = waves
        .iter()
        .flat_map(|found| match &found.data {
            Data::Wave(wave) => wave.samples.as_chunks::<8>().0.to_vec(),
            other => panic!("{other:?}"),
        })
        .collect();
    let mut body = body();
    let until_secs = waves.last().expect("there are some").arrived_secs;
    let measured = (1..).map(|number| f64::from(number) * EMG_SECS);
    let measured = measured.take_while(|secs| *secs <= until_secs);
    let truth: Vec<[f64; 8]> = measured.map(|secs| body.muscles(secs)).collect();
    // The Myo measured before it was connected to, too.
    let first = truth.windows(20).position(|few| few == &samples[..20]).expect("are the body's");
    assert_eq!(samples, truth[first..first + samples.len()], "from sample {first} on");
    eprintln!("Myo: {} samples of 8 muscles in the bag bit for bit", samples.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn what_the_body_had_is_in_the_bag() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder: PathBuf = folder.path().join("bag");
    let began = record(&folder).await;
    let recorded = Recorded { bag: Bag::open(&folder).expect("a bag"), began };
    let mut body = body();
    let truth: Vec<f64> =
        (0..130).flat_map(|secs| body.beats(f64::from(secs), f64::from(secs + 1))).collect();
    beats_are_those_of_the_body(&recorded, &truth);
    intervals_alone_show_the_beats(&recorded, &truth);
    conductance_is_that_of_the_body(&recorded);
    muscles_are_bit_for_bit(&recorded);
}
