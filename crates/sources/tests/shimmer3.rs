//! A Shimmer3 over a real pseudoterminal, with its faults.

mod keeper;

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::Data;
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_emulators::body::{Body, Traits};
use teampulse_emulators::devices::{
    BodyWearer, Shimmer, ShimmerFault, ShimmerIncident, ShimmerSettings, Wearer,
};
use teampulse_emulators::task::{Operator, Plan, Skill, Task};
use teampulse_messages::convert::encode;
use teampulse_ros::buses::Buses;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::emulated::serve_shimmer;
use teampulse_sources::serial::{Pty, SerialPort};
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::wearables::shimmer3::Shimmer3;

use keeper::Keeper;

type Kept = Arc<Mutex<Vec<Record>>>;

fn body() -> BodyWearer {
    let body = Body::new(&Traits::of_seed(5), 5);
    BodyWearer::new(Operator::new(body, Task::new(Plan::default(), Skill::of_seed(5), 5)))
}

fn source(settings: &str) -> Result<Box<dyn Source>, String> {
    source_beside(Claims::default(), settings)
}

/// A source beside others with these claims.
fn source_beside(claims: Claims, settings: &str) -> Result<Box<dyn Source>, String> {
    let context = SourceContext {
        clock: Clock::host(),
        buses: Arc::new(Buses::apart()),
        claims,
        bluetooth: Bluetooth::default(),
    };
    let settings: Shimmer3 = toml::from_str(settings).map_err(|error| error.to_string())?;
    settings.build(&context).map_err(|error| format!("{}: {error}", error.path))
}

fn at(port: &str) -> Box<dyn Source> {
    source(&format!("person = \"p001\"\nport = \"{port}\"")).expect("it is built")
}

/// Waits until a condition holds, for a minute at most.
async fn until(mut is_so: impl FnMut() -> bool) {
    let began = Stopwatch::start();
    while began.elapsed() < Duration::from_secs(60) && !is_so() {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

fn look<T>(kept: &Kept, at: impl FnOnce(&[Record]) -> T) -> T {
    at(&kept.lock().expect("nobody panicked"))
}

/// Runs a session with a source until the records meet a condition.
async fn session(
    source: Box<dyn Source>,
    kept: &Kept,
    is_enough: impl Fn(&[Record]) -> bool,
) -> Outcome {
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("shimmer3".into(), source)],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(kept)))],
        workers: Vec::new(),
        encode,
        commands: Commands::new(CommandSettings::default()),
    };
    session.run(until(|| look(kept, &is_enough))).await
}

fn eda(records: &[Record]) -> impl Iterator<Item = &Record> {
    records.iter().filter(|record| record.stream.name == "/humans/persons/p001/shimmer3/eda")
}

fn last_number(records: &[Record]) -> u64 {
    eda(records).last().map_or(0, |record| record.sample.index)
}

fn faults(records: &[Record]) -> Vec<String> {
    let label = |record: &Record| match &record.sample.data {
        Data::Event(event) => Some(event.label.clone()),
        _ => None,
    };
    records.iter().filter_map(label).collect()
}

/// When the device measured it [s], and the conductance [µS].
fn conductance(record: &Record) -> (f64, f64) {
    let Data::Sample(values) = &record.sample.data else { panic!("{record:?}") };
    let mut channels = record.stream.channels.iter().zip(values.iter());
    let (channel, value) =
        channels.find(|(channel, _)| channel.name == "conductance").expect("is a channel");
    assert_eq!(channel.unit, "uS");
    let device_time = record.sample.device_time.expect("it has a clock");
    (device_time as f64 * 1e-9, value * channel.scale)
}

/// The largest deviation of a sample from the body's value at its time.
fn worst_deviation(records: &[Record]) -> f64 {
    let mut truth = body();
    let deviation = |record| {
        let (secs, conductance_us) = conductance(record);
        let true_us = truth.conductance_us(secs);
        (conductance_us / true_us - 1.0).abs()
    };
    eda(records).map(deviation).fold(0.0, f64::max)
}

#[tokio::test]
async fn what_the_body_had_is_read_over_a_port_and_the_device_is_left_idle() {
    let pty = Pty::open(None).expect("a pseudoterminal");
    let kept = Kept::default();
    let mut shimmer = Shimmer::new(ShimmerSettings::default());
    // Somebody left it streaming.
    shimmer.receive(&[0x07]);
    let mut worn = body();
    let outcome = tokio::select! {
        outcome = session(at(pty.path()), &kept, |records| last_number(records) > 500) => outcome,
        ended = serve_shimmer(&pty, &mut shimmer, &mut worn, Stopwatch::start()) => panic!("{ended:?}"),
    };
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    assert!(!shimmer.is_streaming());
    let records = kept.lock().expect("nobody panicked");
    let numbers: Vec<u64> = eda(&records).map(|record| record.sample.index).collect();
    assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "lost: {numbers:?}");
    let worst = worst_deviation(&records);
    eprintln!("Shimmer3: conductance within {:.2} % of the body's (bar 1)", 100.0 * worst);
    assert!(worst < 0.01, "{worst}");
    let rate_hz = eda(&records).next().map(|record| record.stream.rate_hz);
    assert_eq!(rate_hz, Some(128.0));
}

#[tokio::test]
async fn faults_cost_samples_that_are_counted_and_never_shift_a_channel() {
    let faults = [
        (3.0, ShimmerFault::LostByte(5)),
        (3.5, ShimmerFault::CorruptByte(6)),
        (4.0, ShimmerFault::Status),
        (4.5, ShimmerFault::LostByte(0)),
        (5.0, ShimmerFault::Stall),
    ];
    let incidents = faults.map(|(at_secs, fault)| ShimmerIncident { at_secs, fault }).to_vec();
    let mut shimmer = Shimmer::new(ShimmerSettings { incidents, ..ShimmerSettings::default() });
    let pty = Pty::open(None).expect("a pseudoterminal");
    let kept = Kept::default();
    let mut worn = body();
    let is_enough =
        |records: &[Record]| eda(records).last().is_some_and(|record| conductance(record).0 > 10.0);
    let outcome = tokio::select! {
        outcome = session(at(pty.path()), &kept, is_enough) => outcome,
        ended = serve_shimmer(&pty, &mut shimmer, &mut worn, Stopwatch::start()) => panic!("{ended:?}"),
    };
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    let records = kept.lock().expect("nobody panicked");
    let worst = worst_deviation(&records);
    assert!(worst < 0.01, "{worst}");
    let samples: Vec<&Record> = eda(&records).collect();
    for pair in samples.windows(2) {
        let missing = pair[1].sample.index - pair[0].sample.index - 1;
        let passed_secs = conductance(pair[1]).0 - conductance(pair[0]).0;
        let by_clock = (passed_secs * 128.0).round() as u64 - 1;
        assert_eq!(missing, by_clock, "at {passed_secs} s");
        // Each lost byte costs three at most; the stall is longer than the faults are apart.
        assert!(missing <= 3 || conductance(pair[0]).0 > 4.9, "{missing}");
    }
}

#[tokio::test]
async fn a_port_that_vanishes_is_named_and_read_again_when_it_is_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("shimmer");
    let kept = Kept::default();
    let mut shimmer = Shimmer::new(ShimmerSettings::default());
    let mut worn = body();
    let clock = Stopwatch::start();
    let unplugging = async {
        for numbers in [200, u64::MAX] {
            let pty = Pty::open(Some(Path::new(&link))).expect("a pseudoterminal");
            tokio::select! {
                () = until(|| look(&kept, last_number) > numbers) => {}
                ended = serve_shimmer(&pty, &mut shimmer, &mut worn, clock) => panic!("{ended:?}"),
            }
            drop(pty);
            until(|| look(&kept, |records| faults(records).iter().any(|what| is_cut(what)))).await;
        }
    };
    let is_enough = |records: &[Record]| last_number(records) > 1200;
    let outcome = tokio::select! {
        outcome = session(at(link.to_str().expect("text")), &kept, is_enough) => outcome,
        () = unplugging => panic!("the session did not go on"),
    };
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    assert!(!shimmer.is_streaming());
    let records = kept.lock().expect("nobody panicked");
    assert!(worst_deviation(&records) < 0.01);
    assert_eq!(
        eda(&records)
            .map(|record| record.stream.name.clone())
            .collect::<std::collections::BTreeSet<_>>()
            .len(),
        1
    );
}

fn is_cut(fault: &str) -> bool {
    fault.contains("the connection was closed (Shimmer3 at")
}

#[tokio::test]
async fn a_port_with_something_else_is_named() {
    let pty = Pty::open(None).expect("a pseudoterminal");
    let kept = Kept::default();
    let is_named = |records: &[Record]| {
        let named = |what: &String| what.contains("did not answer commands (Shimmer3 at /dev/pts/");
        faults(records).iter().any(named)
    };
    let mut waste = Vec::new();
    let something_else = async {
        loop {
            pty.read(&mut waste).expect("is there");
            waste.clear();
            pty.write(b"$GPGGA,123519,4807.038,N,01131.000,E\r\n").expect("is there");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let outcome = tokio::select! {
        outcome = session(at(pty.path()), &kept, is_named) => outcome,
        () = something_else => unreachable!("it goes on"),
    };
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    assert!(look(&kept, is_named), "{:?}", look(&kept, faults));
}

#[test]
fn mistakes_in_settings_are_named_at_their_place() {
    for (settings, wrong) in [
        ("person = \"P 1\"", "person: `P 1` can't be the id of a person"),
        ("person = \"p1\"\nrate_hz = 0", "rate_hz: rate_hz is 0; expected 1 to 1024"),
        ("person = \"p1\"\nsensors = []", "sensors: no sensors are listed"),
    ] {
        assert_eq!(source(settings).map(drop), Err(wrong.to_owned()));
    }
}

#[test]
fn two_on_one_person_or_on_one_port_are_refused() {
    let claims = Claims::default();
    let beside = |settings: &str| source_beside(claims.clone(), settings);
    let first = beside("person = \"p1\"\nport = \"/dev/rfcomm0\"");
    assert!(first.is_ok());
    let twice = "person: p1 wears two devices of the kind shimmer3";
    assert_eq!(beside("person = \"p1\"\nport = \"/dev/rfcomm1\"").map(drop), Err(twice.to_owned()));
    let port = "port: two sources read the port /dev/rfcomm0";
    assert_eq!(beside("person = \"p2\"\nport = \"/dev/rfcomm0\"").map(drop), Err(port.to_owned()));
    assert!(beside("person = \"p2\"\nport = \"/dev/rfcomm1\"").is_ok());
    drop(first);
    assert!(beside("person = \"p1\"\nport = \"/dev/rfcomm0\"").is_ok(), "it is free again");
}

#[tokio::test]
async fn a_port_that_another_session_reads_is_in_use() {
    let pty = Pty::open(None).expect("a pseudoterminal");
    let port = pty.path().to_owned();
    let first = SerialPort::open(&port, 115_200).await;
    assert!(first.is_ok());
    let second = SerialPort::open(&port, 115_200).await.expect_err("it is in use");
    assert_eq!(second.why, "another program is using it");
}
