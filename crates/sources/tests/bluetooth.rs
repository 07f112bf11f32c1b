//! Bluetooth wearables: the drivers, `BlueZ` on a bus, emulated devices.

#![expect(clippy::float_cmp, reason = "these are exact")]

mod bluez;
mod keeper;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::{ClockSettings, Clocks};
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::Data;
use teampulse_core::outlet::Queue;
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::stream::Signal;
use teampulse_core::streams::Streams;
use teampulse_devices::gatt::Uuid;
use teampulse_devices::{heart_rate, polar};
use teampulse_emulators::devices::{Characteristic, H10, H10Settings, Sent, Wearer};
use teampulse_messages::convert::encode;
use teampulse_ros::buses::Buses;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::wearables::heart_rate::HeartRate;

use bluez::{Bluez, Device, Peripheral};
use keeper::Keeper;

/// The intervals of a heart that beats unevenly, in steps of 1/1024 s, so that a strap reports them exactly.
fn intervals() -> impl Iterator<Item = u32> {
    (0..).map(|beat: u32| 560 + beat.wrapping_mul(7919) % 300)
}

/// Its beats [s].
fn beats() -> impl Iterator<Item = f64> {
    intervals().scan(0, |steps, interval| {
        *steps += interval;
        Some(f64::from(*steps) / 1024.0)
    })
}

/// Wears that heart.
struct Heart;

impl Wearer for Heart {
    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let since = beats().skip_while(|secs| *secs <= after_secs);
        since.take_while(|secs| *secs <= until_secs).collect()
    }
}

/// An H10 that is worn.
struct Strap {
    h10: H10,
    wearer: Box<dyn Wearer + Send + Sync>,
}

const CHARACTERISTICS: [(Characteristic, Uuid); 6] = [
    (Characteristic::HeartRate, heart_rate::MEASUREMENT),
    (Characteristic::Battery, Uuid::short(0x2a19)),
    (Characteristic::Manufacturer, Uuid::short(0x2a29)),
    (Characteristic::Model, Uuid::short(0x2a24)),
    (Characteristic::Control, polar::CONTROL),
    (Characteristic::Data, polar::DATA),
];

fn characteristic(of: Uuid) -> Option<Characteristic> {
    CHARACTERISTICS
        .into_iter()
        .find(|(_, uuid)| *uuid == of)
        .map(|(characteristic, _)| characteristic)
}

impl Peripheral for Strap {
    fn characteristics(&self) -> Vec<Uuid> {
        CHARACTERISTICS.iter().map(|(_, uuid)| *uuid).collect()
    }

    fn subscribe(&mut self, of: Uuid) -> bool {
        characteristic(of).is_some_and(|of| self.h10.subscribe(of).is_ok())
    }

    fn read(&mut self, of: Uuid) -> Option<Vec<u8>> {
        self.h10.read(characteristic(of)?).ok()
    }

    fn write(&mut self, of: Uuid, value: &[u8]) -> bool {
        characteristic(of).is_some_and(|of| self.h10.write(of, value).is_ok())
    }

    fn until(&mut self, secs: f64) -> Vec<(Uuid, Vec<u8>)> {
        let sent = self.h10.until(secs, &mut *self.wearer);
        let value = |sent| match sent {
            Sent::Value(_, of, value) => {
                let uuid = CHARACTERISTICS.into_iter().find(|(each, _)| *each == of)?.1;
                Some((uuid, value))
            }
            Sent::LinkLost(_) => None,
        };
        sent.into_iter().filter_map(value).collect()
    }

    fn disconnect(&mut self) {
        self.h10.disconnect();
    }
}

fn strap(address: &'static str) -> Device {
    let h10 = H10::new(H10Settings::default());
    Device {
        address,
        name: "Polar H10 00000001",
        services: vec![heart_rate::SERVICE],
        peripheral: Box::new(Strap { h10, wearer: Box::new(Heart) }),
    }
}

const ADDRESS: &str = "A0:9E:1A:00:00:01";

fn context(address: &str) -> SourceContext {
    SourceContext {
        clock: Clock::host(),
        buses: Arc::new(Buses::apart()),
        claims: Claims::default(),
        bluetooth: Bluetooth::at(address),
    }
}

fn source<S>(settings: &str, context: &SourceContext) -> Box<dyn Source>
where
    S: Component<dyn Source, SourceContext> + serde::de::DeserializeOwned,
{
    let settings: S = toml::from_str(settings).expect("settings");
    settings.build(context).unwrap_or_else(|error| panic!("{}: {error}", error.path))
}

type Kept = Arc<Mutex<Vec<Record>>>;

/// Runs a session with a source until the records are as asked, and 60 s at most.
async fn session(
    source: Box<dyn Source>,
    clock: Clock,
    until: impl Fn(&[Record]) -> bool,
) -> Vec<Record> {
    let kept = Kept::default();
    let latency = ClockSettings { latency_secs: Some(0.0), ..ClockSettings::default() };
    let session = Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::new([("heart_rate_strap".to_owned(), latency)].into()),
        streams: Streams::default(),
        sources: vec![("strap".into(), source)],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(&kept)))],
        workers: Vec::new(),
        encode,
        commands: Commands::new(CommandSettings::default()),
    };
    let looks = Arc::clone(&kept);
    let enough = async move {
        let began = Stopwatch::start();
        while began.elapsed() < Duration::from_secs(60)
            && !until(&looks.lock().expect("nobody panicked"))
        {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let outcome = session.run(enough).await;
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    std::mem::take(&mut *kept.lock().expect("nobody panicked"))
}

fn of<'a>(records: &'a [Record], leaf: &str) -> Vec<&'a Record> {
    let is_leaf = |record: &&Record| {
        record.stream.name.starts_with("/humans/persons/p001/")
            && record.stream.name.rsplit('/').next() == Some(leaf)
    };
    records.iter().filter(is_leaf).collect()
}

fn values(records: &[&Record]) -> Vec<f64> {
    let first = |record: &&Record| match &record.sample.data {
        Data::Sample(values) => values[0],
        other => panic!("{other:?}"),
    };
    records.iter().map(first).collect()
}

fn faults(records: &[Record]) -> Vec<String> {
    let label = |record: &Record| match &record.sample.data {
        Data::Event(event) => Some(event.label.clone()),
        _ => None,
    };
    records.iter().filter_map(label).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_interval_of_a_strap_is_read_and_again_after_its_link_was_lost() {
    let bluez = Bluez::start(vec![strap(ADDRESS)]).await;
    let context = context(&bluez.address);
    let source = source::<HeartRate>(r#"person = "p001""#, &context);
    let course = Arc::clone(&bluez.courses[0]);
    let records = session(source, context.clock.clone(), |records| {
        let mut course = course.lock().expect("a course");
        let intervals = of(records, "rr_interval").len();
        course.drop |= intervals >= 5 && course.connections == 1;
        course.connections == 2 && intervals >= 16 && of(records, "link").len() == 3
    })
    .await;
    let truth: Vec<f64> = intervals().map(f64::from).take(100).collect();
    let read = values(&of(&records, "rr_interval"));
    // All before the link was lost, in their order; and all since.
    for part in [&read[..5], &read[read.len() - 5..]] {
        assert!(truth.windows(5).any(|all| all == part), "{part:?}");
    }
    let interval = &of(&records, "rr_interval")[0].stream;
    assert_eq!((interval.signal, interval.channels[0].scale), (Signal::Interval, 1000.0 / 1024.0));
    assert!((70.0..115.0).contains(&values(&of(&records, "heart_rate"))[1]));
    assert_eq!(values(&of(&records, "battery"))[0], 87.0);
    assert_eq!(values(&of(&records, "link")), [1.0, 0.0, 1.0, 0.0]);
    let lost = faults(&records).into_iter().filter(|label| label.contains("link is lost"));
    assert_eq!(lost.count(), 1);
    let course = course.lock().expect("a course");
    assert!(course.disconnections >= 1, "it is left connected");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_beats_of_a_strap_without_a_clock_are_placed_where_they_were() {
    let bluez = Bluez::start(vec![strap(ADDRESS)]).await;
    let context = context(&bluez.address);
    let began = context.clock.now() - bluez.clock.elapsed();
    let source = source::<HeartRate>(r#"person = "p001""#, &context);
    let is_enough = |records: &[Record]| of(records, "rr_interval").len() >= 60;
    let records = session(source, context.clock.clone(), is_enough).await;
    let truth: Vec<f64> = beats().take(200).collect();
    let error_secs = |record: &&Record| {
        let secs = record.sample.measured.secs_since(began);
        let errors = truth.iter().map(|beat_secs| secs - beat_secs);
        errors.min_by(|one, other| one.abs().total_cmp(&other.abs())).unwrap_or(f64::NAN)
    };
    let errors_secs: Vec<f64> = of(&records, "rr_interval").iter().map(error_secs).collect();
    // After half a minute it is known how late each one is.
    assert!(errors_secs[40..].iter().all(|error| error.abs() < 0.030), "{errors_secs:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_straps_in_range_none_is_guessed() {
    let bluez = Bluez::start(vec![strap(ADDRESS), strap("A0:9E:1A:00:00:02")]).await;
    let context = context(&bluez.address);
    let mut source = source::<HeartRate>(r#"person = "p001""#, &context);
    let outlet = Queue::new().outlet(context.clock.clone(), Streams::default());
    let error = source.run(&outlet).await.expect_err("two are in range");
    let text = error.to_string();
    assert!(text.contains(ADDRESS) && text.contains("A0:9E:1A:00:00:02"), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn two_hundred_lost_links_leave_nothing_behind() {
    let bluez = Bluez::start(vec![strap(ADDRESS)]).await;
    let context = context(&bluez.address);
    let settings = format!("person = \"p001\"\naddress = \"{ADDRESS}\"");
    let mut source = source::<HeartRate>(&settings, &context);
    let queue = Queue::new();
    let outlet = queue.outlet(context.clock.clone(), Streams::default());
    let course = Arc::clone(&bluez.courses[0]);
    let mut left = Vec::new();
    for cut in 0..200 {
        let cutting = async {
            while course.lock().expect("a course").connections <= cut {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
            course.lock().expect("a course").drop = true;
        };
        let (ended, ()) = tokio::join!(source.run(&outlet), cutting);
        assert!(ended.is_err(), "the link was lost");
        if cut % 100 == 99 {
            left.push(left_behind(&bluez).await);
        }
    }
    assert_eq!(left[0], left[1]);
    assert_eq!(left[1].0, 0, "no connection to the bus");
}

/// Connections to the bus, file descriptors and tasks, once what was aborted is gone.
async fn left_behind(bluez: &Bluez) -> (usize, usize, usize) {
    while bluez.clients().await > 0 {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let descriptors = std::fs::read_dir("/proc/self/fd").expect("on Linux").count();
    let tasks = tokio::runtime::Handle::current().metrics().num_alive_tasks();
    (bluez.clients().await, descriptors, tasks)
}

#[tokio::test]
async fn without_a_bus_the_error_says_what_to_do() {
    let context = context("unix:path=/nowhere/bus");
    let mut source = source::<HeartRate>(r#"person = "p001""#, &context);
    let outlet = Queue::new().outlet(context.clock.clone(), Streams::default());
    let error = source.run(&outlet).await.expect_err("there is no bus");
    assert!(error.to_string().starts_with("connect to the system's D-Bus: "), "{error}");
}

#[test]
fn an_address_that_is_none_is_named_at_its_place() {
    let settings: HeartRate =
        toml::from_str("person = \"p1\"\naddress = \"h10\"").expect("settings");
    let error = settings.build(&context("unix:path=/nowhere/bus")).map(drop).expect_err("none");
    assert_eq!(
        (error.path.as_str(), error.to_string().as_str()),
        ("address", "`h10` is not a Bluetooth address")
    );
}
