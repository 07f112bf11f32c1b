//! Bluetooth wearables: the drivers, `BlueZ` on a bus, emulated devices.

#![expect(clippy::float_cmp, reason = "these are exact")]

mod bluez;
mod keeper;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::{ClockSettings, Clocks};
use teampulse_core::command::{Command, Sender};
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::Data;
use teampulse_core::outlet::{Outlet, Queue};
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::Signal;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_emulators::devices::{Fault, Incident};
use teampulse_messages::convert::encode;
use teampulse_ros::buses::Buses;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::wearables::heart_rate::HeartRate;
use teampulse_sources::wearables::myo::Myo;
use teampulse_sources::wearables::polar::Polar;

use bluez::worn::{COUNTS_HZ, armband, beats, h10, intervals, strap};
use bluez::{Bluez, Course};
use keeper::Keeper;

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
    sources: Vec<Box<dyn Source>>,
    clock: Clock,
    until: impl Fn(&[Record]) -> bool,
) -> Vec<Record> {
    let kept = Kept::default();
    let latency = || ClockSettings { latency_secs: Some(0.0), ..ClockSettings::default() };
    let devices = ["heart_rate_strap", "polar_h10", "myo"];
    let settings = devices.map(|device| (device.to_owned(), latency()));
    let session = Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::new(settings.into()),
        streams: Streams::default(),
        sources: sources.into_iter().map(|source| ("worn".to_owned(), source)).collect(),
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
    let records = session(vec![source], context.clock.clone(), |records| {
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
    let records = session(vec![source], context.clock.clone(), is_enough).await;
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

/// By how much the samples of a wave that count the time are off [s].
fn wave_errors(record: &Record, began: Time) -> Vec<f64> {
    let Data::Wave(wave) = &record.sample.data else { panic!("{record:?}") };
    let first_secs = record.sample.measured.secs_since(began);
    let samples = wave.samples.iter().enumerate();
    let error = |(place, count): (usize, &f64)| {
        let secs = first_secs + place as f64 * record.sample.period_ns / 1e9;
        let error = secs - count / COUNTS_HZ;
        // It counts to 16 s, and again.
        (error + 8.0).rem_euclid(16.0) - 8.0
    };
    samples.map(error).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_ecg_of_an_h10_is_where_it_was_whatever_fails() {
    let incident = |at_secs, fault| Incident { at_secs, fault };
    let incidents = vec![
        incident(0.0, Fault::LostAnswer),
        incident(12.0, Fault::LostFrame),
        incident(14.0, Fault::Stall),
    ];
    let bluez = Bluez::start(vec![h10(ADDRESS, incidents)]).await;
    let context = context(&bluez.address);
    let began = context.clock.now() - bluez.clock.elapsed();
    let source = source::<Polar>(r#"person = "p001""#, &context);
    let course = Arc::clone(&bluez.courses[0]);
    let seen_from = |records: &[Record], secs: f64| {
        let late = |record: &&&Record| record.sample.measured.secs_since(began) > secs;
        of(records, "ecg").iter().filter(late).count()
    };
    let records = session(vec![source], context.clock.clone(), |records| {
        let mut course = course.lock().expect("a course");
        // The link is lost once it streams again after the stall; the strap goes on streaming.
        course.drop |= seen_from(records, 15.0) == 3 && course.connections == 1;
        course.connections == 2 && seen_from(records, 15.0) > 10
    })
    .await;
    let ecg = of(&records, "ecg");
    assert_eq!((ecg[0].stream.signal, ecg[0].stream.device.as_str()), (Signal::Ecg, "polar_h10"));
    assert_eq!((ecg[0].stream.channels[0].unit.as_str(), ecg[0].stream.rate_hz), ("uV", 130.0));
    // The first seconds show how late the others are.
    for wave in ecg.iter().skip(10) {
        let errors_secs = wave_errors(wave, began);
        assert!(errors_secs.iter().all(|error| error.abs() < 0.005), "{errors_secs:?}");
    }
    for pair in ecg.windows(2) {
        let gap_secs = pair[1].sample.measured.secs_since(pair[0].sample.measured);
        assert!(gap_secs < 30.0, "it came back after {gap_secs} s");
    }
    let told = faults(&records);
    for what in ["ecg was silent", "link is lost"] {
        assert!(told.iter().any(|label| label.contains(what)), "no `{what}` in {told:?}");
    }
    let lost = records.iter().filter(|record| record.stream.name == "/teampulse/lost_source");
    assert!(lost.count() >= 2, "the lost frame is not counted");
    let course = course.lock().expect("a course");
    assert_eq!(course.written.last().map(Vec::as_slice), Some(&[3, 0][..]), "it still streams");
    assert!(course.disconnections >= 1, "it is left connected");
}

/// Asks for a vibration once a device is connected.
struct Button(Arc<Mutex<Course>>);

#[async_trait::async_trait]
impl Source for Button {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        while self.0.lock().expect("a course").written.is_empty() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        let command = Command::Vibrate { subject: "p001".into(), secs: 0.5 };
        outlet.command(&Sender::keys(), command).expect("keys may ask for anything");
        outlet.closed().await;
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_myo_is_read_bit_for_bit_and_vibrates_on_command() {
    let bluez = Bluez::start(vec![armband(ADDRESS)]).await;
    let context = context(&bluez.address);
    let source = source::<Myo>(r#"person = "p001""#, &context);
    let course = Arc::clone(&bluez.courses[0]);
    let button = Box::new(Button(Arc::clone(&course)));
    let records = session(vec![source, button], context.clock.clone(), |records| {
        let mut course = course.lock().expect("a course");
        let runs = of(records, "emg").len();
        course.drop |= runs >= 100 && course.connections == 1;
        course.connections == 2 && runs >= 300
    })
    .await;
    let emg = of(&records, "emg");
    assert_eq!((emg[0].stream.signal, emg[0].stream.rate_hz), (Signal::Emg, 200.0));
    let number = |sample: &[f64]| sample[0] + 100.0 * sample[1];
    let runs: Vec<[f64; 2]> = emg
        .iter()
        .map(|record| match &record.sample.data {
            Data::Wave(wave) => [number(&wave.samples[..8]), number(&wave.samples[8..])],
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(runs.iter().all(|[first, second]| second - first == 1.0), "{runs:?}");
    // Nothing is missing but at the lost link, where as much is counted as is missing.
    let gaps: Vec<f64> = runs
        .windows(2)
        .map(|pair| pair[1][0] - pair[0][1] - 1.0)
        .filter(|gap| *gap != 0.0)
        .collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    assert!(!of(&records, "orientation").is_empty() && !of(&records, "acceleration").is_empty());
    let course = course.lock().expect("a course");
    let last = course.written.iter().rev().take(2).rev().map(Vec::as_slice).collect::<Vec<_>>();
    assert!(course.written.iter().any(|command| *command == [3, 1, 2]), "it did not vibrate");
    assert_eq!(last, [&[1, 3, 0, 0, 0][..], &[9, 1, 0][..]], "it still streams");
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
