//! The memory that a single message costs a live session, from the bus through sources, features and sinks: the largest
//! permitted messages, and malicious ones.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

#[path = "live/memory.rs"]
mod memory;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::qos::Qos;
use teampulse_core::registry::{Component, Settings};
use teampulse_core::session::{Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::Source;
use teampulse_core::stream::Schema;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_messages::catalogue::shipped;
use teampulse_messages::cdr::Writer;
use teampulse_messages::convert::{MOST_CHANNELS, encode};
use teampulse_messages::standard::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use teampulse_messages::standard::nav_msgs::Odometry;
use teampulse_messages::standard::sensor_msgs::BatteryState;
use teampulse_messages::standard::std_msgs::Header;
use teampulse_messages::standard::{Message, teampulse_msgs as msgs};
use teampulse_ros::bus::{Bus, Publisher};
use teampulse_ros::buses::Buses;
use teampulse_ros::memory::MemoryBus;
use teampulse_sinks::{Bag, SinkContext, Tidy};
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::robots::Robots;
use teampulse_sources::ros_people::RosPeople;
use teampulse_sources::session::RosEvents;
use teampulse_sources::topics::Topics;
use teampulse_sources::wearables::bluetooth::Bluetooth;

/// The most memory for one message [B].
const MOST_BYTES: i64 = 300_000_000;
/// The largest message of ours that is read [B].
const LARGEST: usize = 16 << 20;
const ECG: &str = "/humans/persons/p001/own/ecg";

/// Ends the wait once it has seen the marker that is sent after the message.
struct Seen(Arc<AtomicBool>);

impl Sink for Seen {
    fn name(&self) -> &'static str {
        "seen"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        loop {
            match inbox.receive(Duration::from_millis(50)) {
                Received::Batch(batch) => {
                    if batch.iter().any(|record| is_last(&record.sample.data)) {
                        self.0.store(true, Ordering::Relaxed);
                    }
                }
                Received::Silence => {}
                Received::Closed => return Ok(()),
            }
        }
    }
}

fn is_last(data: &Data) -> bool {
    let Data::Event(event) = data else { return false };
    event.kind == EventKind::Marker && event.label == "last"
}

/// A message of a type on a topic.
struct Sent {
    topic: &'static str,
    type_name: &'static str,
    bytes: Bytes,
}

fn publisher_of(bus: &MemoryBus, topic: &str, type_name: &str) -> Box<dyn Publisher> {
    let unknown = || Schema {
        name: type_name.into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    let schema = shipped(type_name).map_or_else(unknown, |known| (*known).clone());
    bus.publish(topic, &schema, &Qos::reliable(10)).unwrap()
}

async fn subscribed(publisher: &dyn Publisher) {
    while publisher.subscribers() == 0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

fn built<S: Component<dyn Source, SourceContext>>(
    settings: &str,
    context: &SourceContext,
) -> (String, Box<dyn Source>) {
    ("test".into(), toml::from_str::<S>(settings).unwrap().build(context).unwrap())
}

/// One session at a time, as the memory of all threads is counted together.
static ALONE: tokio::sync::Mutex<()> = tokio::sync::Mutex::const_new(());

/// The most memory that a session takes while it processes these messages, beyond what it used before [B].
async fn most_of(messages: Vec<Sent>) -> i64 {
    let folder = tempfile::tempdir().unwrap();
    let monitor = MemoryBus::new("/teampulse");
    let robot = monitor.join("/robot1/driver");
    let bus: Arc<dyn Bus> = monitor;
    let clock = Clock::host();
    let context = SourceContext {
        clock: clock.clone(),
        buses: Arc::new(Buses::holding([(0, Arc::clone(&bus))])),
        claims: Claims::default(),
        bluetooth: Bluetooth::default(),
    };
    let sources = vec![
        built::<RosPeople>("", &context),
        built::<Robots>("namespace = \"/robot*\"", &context),
        built::<Topics>("names = [\"/**\"]", &context),
        ("events".into(), Box::new(RosEvents::new(bus)) as Box<dyn Source>),
    ];
    let features = FEATURES.iter().map(|entry| {
        let feature = (entry.build)(Settings::empty(), &FeatureContext::default());
        (entry.kind, Arc::from(feature.unwrap()))
    });
    let context = SinkContext::new(folder.path().join("bag"), "test", clock.clone());
    let seen = Arc::new(AtomicBool::new(false));
    let sinks: Vec<Box<dyn Sink>> = vec![
        Bag::default().build(&context).unwrap(),
        Tidy::default().build(&context).unwrap(),
        Box::new(Seen(Arc::clone(&seen))),
    ];
    let session = Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources,
        features: features.collect(),
        sinks,
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let before = memory::begin();
    let work = async {
        let mut publishers = BTreeMap::new();
        for Sent { topic, type_name, bytes } in &messages {
            let publisher = publishers.entry((*topic, *type_name));
            let publisher = publisher.or_insert_with(|| publisher_of(&robot, topic, type_name));
            subscribed(&**publisher).await;
            publisher.publish(bytes).unwrap();
        }
        let events = publisher_of(&robot, "/session/events", "std_msgs/msg/String");
        subscribed(&*events).await;
        let mut last = Writer::new();
        last.text("last");
        events.publish(&last.finish()).unwrap();
        while !seen.load(Ordering::Relaxed) {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let outcome = session.run(work).await;
    assert!(outcome.pump.is_none() && outcome.features.is_empty(), "{outcome:?}");
    memory::most() - before
}

fn wave(channels: u32, samples: usize, period_ns: f64) -> Bytes {
    let samples = vec![0.5; samples];
    msgs::Wave { period_ns, channels, samples, ..msgs::Wave::default() }.encode()
}

fn description(channels: usize, text: usize, inputs: usize) -> Bytes {
    let name = |number: usize| format!("{}{number}", "x".repeat(text));
    msgs::StreamDescription {
        name: ECG.into(),
        r#type: msgs::Wave::NAME.into(),
        signal: "eeg".into(),
        id: "p001".into(),
        channels: (0..channels).map(name).collect(),
        units: vec!["uV".into(); channels],
        inputs: vec![String::new(); inputs],
        rate_hz: 250.0,
        scales: Vec::new(),
        doc: "d".repeat(text * 1000),
        ..msgs::StreamDescription::default()
    }
    .encode()
}

/// A message of one string.
fn string(bytes: usize) -> Bytes {
    let mut message = Writer::new();
    message.text(&"é\u{1b}".repeat(bytes / 3));
    message.finish()
}

const STREAMS: (&str, &str) = ("/teampulse/streams", msgs::StreamDescription::NAME);

fn sent((topic, type_name): (&'static str, &'static str), bytes: Bytes) -> Sent {
    Sent { topic, type_name, bytes }
}

/// A crafted message, and its name.
type Crafted = (&'static str, Vec<Sent>);

/// Messages of our own types, which are decoded.
fn of_people() -> Vec<Crafted> {
    let ecg = (ECG, msgs::Wave::NAME);
    let eda = ("/humans/persons/p001/own/eda", msgs::Sample::NAME);
    let events = ("/session/events", msgs::Event::NAME);
    let values = vec![0.5; LARGEST / 8 - 100];
    let sample = msgs::Sample { values, ..msgs::Sample::default() };
    let (kind, label) = ("marker".into(), "é\u{1b}".repeat(LARGEST / 3 - 100));
    let event = msgs::Event { kind, label, ..msgs::Event::default() };
    let largest = vec![
        sent(STREAMS, description(MOST_CHANNELS, 4000, 16 * MOST_CHANNELS)),
        sent(ecg, wave(MOST_CHANNELS as u32, MOST_CHANNELS * 500, 4e6)),
    ];
    vec![
        ("a description of a million channels", vec![sent(STREAMS, description(1_000_000, 0, 0))]),
        ("a description of two million inputs", vec![sent(STREAMS, description(1, 0, 2_000_000))]),
        ("the largest description that is permitted, and its waves", largest),
        ("a wave of two million numbers", vec![sent(ecg, wave(1, LARGEST / 8 - 100, 1e6))]),
        ("a wave of as many channels as numbers", vec![sent(ecg, wave(1 << 20, 1 << 20, 1e6))]),
        ("a wave of which each sample is an hour", vec![sent(ecg, wave(1, 1000, 3.6e12))]),
        ("a sample of two million numbers", vec![sent(eda, sample.encode())]),
        ("an event with a label of 16 MiB", vec![sent(events, event.encode())]),
    ]
}

/// Messages of other types.
fn of_robots() -> Vec<Crafted> {
    let marker = ("/session/events", "std_msgs/msg/String");
    let image = ("/camera/front/image", "sensor_msgs/msg/Image");
    let diagnostics = ("/robot1/diagnostics", DiagnosticArray::NAME);
    let battery = ("/robot1/battery_state", BatteryState::NAME);
    let status = DiagnosticStatus { level: 2, ..DiagnosticStatus::default() };
    let statuses =
        DiagnosticArray { status: vec![status; 1_000_000], ..DiagnosticArray::default() };
    let cells = BatteryState { cell_voltage: vec![3.7; 10_000_000], ..BatteryState::default() };
    vec![
        ("a marker of 200 MB", vec![sent(marker, string(200_000_000))]),
        ("an image of 64 MiB", vec![sent(image, string(64 << 20))]),
        ("an image of 250 MB", vec![sent(image, string(250_000_000))]),
        ("diagnostics of a million parts", vec![sent(diagnostics, statuses.encode())]),
        ("a battery of ten million cells", vec![sent(battery, cells.encode())]),
    ]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_single_message_takes_bounded_memory() {
    let _alone = ALONE.lock().await;
    let mut too_much = Vec::new();
    for (what, messages) in of_people().into_iter().chain(of_robots()) {
        let most = most_of(messages).await;
        if most >= MOST_BYTES {
            too_much.push(format!("{what}: {} MB", most / 1_000_000));
        }
    }
    assert!(too_much.is_empty(), "{too_much:?}");
}

/// Pseudorandom numbers, the same in every run.
struct Chance(u64);

impl Chance {
    /// A number below a count.
    fn of(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % count.max(1) as u64) as usize
    }

    /// A message that was changed in a few places: bits, counts, its length, its byte order.
    fn changed(&mut self, message: &[u8]) -> Bytes {
        let mut bytes = message.to_vec();
        for _ in 0..=self.of(3) {
            let place = self.of(bytes.len());
            match self.of(6) {
                0 => bytes.truncate(place),
                1 => bytes.resize(bytes.len() + self.of(100), 0xff),
                2 => {
                    let counts = [0, 1, 0xffff, 1 << 20, u32::MAX / 8, u32::MAX];
                    let count = counts[self.of(counts.len())].to_le_bytes();
                    let place = place / 4 * 4;
                    bytes.iter_mut().skip(place).zip(count).for_each(|(byte, new)| *byte = new);
                }
                3 => bytes.iter_mut().skip(1).take(1).for_each(|byte| *byte ^= 1),
                4 => bytes.iter_mut().skip(place).take(8).for_each(|byte| *byte = 0xff),
                _ => {
                    let bit = 1 << self.of(8);
                    bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= bit);
                }
            }
        }
        bytes.into()
    }
}

/// One message of each type that a session reads.
fn whole() -> Vec<Sent> {
    let header =
        |name: &str| Header { stamp: Time::from_stamp(1_700_000_000, 0), frame_id: name.into() };
    let diagnostics = DiagnosticStatus {
        name: "motor".into(),
        message: "hot".into(),
        values: vec![KeyValue { key: "temperature".into(), value: "90".into() }],
        ..DiagnosticStatus::default()
    };
    let mut marker = Writer::new();
    marker.text("a marker");
    let event =
        msgs::Event { kind: "phase".into(), label: "task".into(), ..msgs::Event::default() };
    vec![
        sent(STREAMS, description(4, 3, 2)),
        sent((ECG, msgs::Wave::NAME), wave(4, 100, 4e6)),
        sent(
            ("/humans/persons/p001/own/eda", msgs::Sample::NAME),
            msgs::Sample { values: vec![2.0], ..msgs::Sample::default() }.encode(),
        ),
        sent(("/humans/persons/p001/task/events", msgs::Event::NAME), event.encode()),
        sent(("/session/events", msgs::Event::NAME), event.encode()),
        sent(("/session/events", "std_msgs/msg/String"), marker.finish()),
        sent(
            ("/robot1/battery_state", BatteryState::NAME),
            BatteryState {
                header: header("base"),
                cell_voltage: vec![3.7; 3],
                ..BatteryState::default()
            }
            .encode(),
        ),
        sent(
            ("/robot1/diagnostics", DiagnosticArray::NAME),
            DiagnosticArray { header: header(""), status: vec![diagnostics; 2] }.encode(),
        ),
        sent(
            ("/robot1/odom", Odometry::NAME),
            Odometry { header: header("odom"), ..Odometry::default() }.encode(),
        ),
    ]
}

/// `MALFORMED=60000` tries more of them.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn malformed_messages_neither_panic_nor_fill_the_memory() {
    let _alone = ALONE.lock().await;
    let count = option_env!("MALFORMED").and_then(|count| count.parse().ok()).unwrap_or(2000);
    let (mut chance, whole) = (Chance(0x2545_f491_4f6c_dd1d), whole());
    let messages = (0..count).map(|_| {
        let Sent { topic, type_name, bytes } = &whole[chance.of(whole.len())];
        Sent { topic, type_name, bytes: chance.changed(bytes) }
    });
    let most = most_of(messages.collect()).await;
    assert!(most < MOST_BYTES, "{} MB", most / 1_000_000);
}
