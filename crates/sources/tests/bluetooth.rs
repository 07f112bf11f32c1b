//! Bluetooth wearables: the drivers, `BlueZ` on a bus, emulated devices.

#![expect(clippy::float_cmp, reason = "these are exact")]

mod keeper;
mod observed;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::{ClockSettings, Clocks};
use teampulse_core::command::{Command, Sender};
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::{Data, Wave};
use teampulse_core::outlet::{Outlet, Queue};
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Signal;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_emulators::devices::{Fault, Incident, VerityFault, VerityIncident};
use teampulse_messages::convert::encode;
use teampulse_ros::buses::Buses;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::emulated::bluetooth::{EmulatedBluetooth, EmulatedDevice};
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::wearables::heart_rate::HeartRate;
use teampulse_sources::wearables::myo::Myo;
use teampulse_sources::wearables::polar::Polar;

use keeper::Keeper;
use observed::{
    COUNTS_HZ, LIGHT_OF_SECS, SharedCourse, armband, beats, h10, intervals, strap, verity,
};

const ADDRESS: &str = "A0:9E:1A:00:00:01";

/// A `BlueZ` with these devices, and when they were switched on.
async fn bluez(devices: Vec<EmulatedDevice>) -> (EmulatedBluetooth, Stopwatch) {
    let clock = Stopwatch::start();
    let bluez = EmulatedBluetooth::start(devices, clock).await;
    (bluez.expect("dbus-daemon, which `make test` installs"), clock)
}

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

/// Runs a session with a source until the records meet a condition, for 60 s at most.
async fn session(
    sources: Vec<Box<dyn Source>>,
    clock: Clock,
    until: impl Fn(&[Record]) -> bool,
) -> Vec<Record> {
    let kept = Kept::default();
    let latency = || ClockSettings { latency_secs: Some(0.0), ..ClockSettings::default() };
    let devices = ["heart_rate_strap", "polar_h10", "polar_verity_sense", "myo"];
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

/// The statuses about the clock of a stream, second by second.
fn statuses<'a>(records: &'a [Record], leaf: &str) -> Vec<(Time, &'a StreamStatus)> {
    let status = |record: &'a Record| match &record.sample.data {
        Data::Status(status) if status.name.rsplit('/').next() == Some(leaf) => {
            Some((record.sample.log_time, &**status))
        }
        _ => None,
    };
    records.iter().filter_map(status).collect()
}

/// The number of epochs that the clock of a stream has had.
fn epochs(records: &[Record], leaf: &str) -> u32 {
    statuses(records, leaf).last().map_or(0, |(_, status)| status.epoch)
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
    let (device, course) = strap(ADDRESS);
    let (bluez, _) = bluez(vec![device]).await;
    let context = context(bluez.bus_address());
    let source = source::<HeartRate>(r#"person = "p001""#, &context);
    let records = session(vec![source], context.clock.clone(), |records| {
        let mut course = course.lock();
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
    assert_eq!(values(&of(&records, "battery"))[0], 70.0);
    assert_eq!(values(&of(&records, "link")), [1.0, 0.0, 1.0, 0.0]);
    let lost = faults(&records).into_iter().filter(|label| label.contains("link is lost"));
    assert_eq!(lost.count(), 1);
    let course = course.lock();
    assert!(course.disconnections >= 1, "it is left connected");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_h10_that_another_program_has_connected_is_read_beside_it() {
    let (device, _) = h10(ADDRESS, Vec::new());
    let (bluez, _) = bluez(vec![device]).await;
    let other = zbus::connection::Builder::address(bluez.bus_address());
    let other = other.build().await.expect("the bus accepts clients");
    let ask = async |path: &str, interface: &str, method: &str| {
        other.call_method(Some("org.bluez"), path, Some(interface), method, &()).await
    };
    ask("/org/bluez/hci0", "org.bluez.Adapter1", "StartDiscovery").await.expect("a discovery");
    let path = format!("/org/bluez/hci0/dev_{}", ADDRESS.replace(':', "_"));
    let began = Stopwatch::start();
    while ask(&path, "org.bluez.Device1", "Connect").await.is_err() {
        assert!(began.elapsed() < Duration::from_secs(20), "it is not found");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert!(bluez.is_connected(ADDRESS));
    let context = context(bluez.bus_address());
    let source = source::<Polar>(r#"person = "p001""#, &context);
    let records = session(vec![source], context.clock.clone(), |records| {
        of(records, "ecg").len() >= 3 && !of(records, "battery").is_empty()
    })
    .await;
    assert!(of(&records, "ecg").len() >= 3);
    assert_eq!(values(&of(&records, "link"))[0], 1.0);
    assert!(!faults(&records).iter().any(|label| label.contains("link")), "{:?}", faults(&records));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_beats_of_a_strap_without_a_clock_are_placed_where_they_were() {
    let (device, _) = strap(ADDRESS);
    let (bluez, clock) = bluez(vec![device]).await;
    let context = context(bluez.bus_address());
    let began = context.clock.now() - clock.elapsed();
    let source = source::<HeartRate>(r#"person = "p001""#, &context);
    let is_enough = |records: &[Record]| of(records, "rr_interval").len() >= 75;
    let records = session(vec![source], context.clock.clone(), is_enough).await;
    let truth: Vec<f64> = beats().take(200).collect();
    let error_secs = |record: &&Record| {
        let secs = record.sample.measured.secs_since(began);
        let errors = truth.iter().map(|beat_secs| secs - beat_secs);
        errors.min_by(|one, other| one.abs().total_cmp(&other.abs())).unwrap_or(f64::NAN)
    };
    let errors_secs: Vec<f64> = of(&records, "rr_interval").iter().map(error_secs).collect();
    let late_secs = of(&records, "heart_rate").into_iter().map(|record| late_secs(record, began));
    let late_secs = late_secs.fold(0.0, f64::max);
    // What is stated once a second is stated of the beats until then.
    let statuses = statuses(&records, "rr_interval");
    let stated_secs = |record: &Record| {
        let next = statuses.iter().find(|(at, _)| *at > record.sample.log_time);
        next.map(|(_, status)| status.uncertainty_secs())
    };
    let beats = of(&records, "rr_interval").into_iter().zip(&errors_secs);
    let stated: Vec<(f64, f64)> =
        beats.filter_map(|(beat, error)| Some((stated_secs(beat)?, error.abs()))).collect();
    let within = stated.iter().filter(|(stated, error)| *error <= stated + late_secs).count();
    // After half a minute it is known how late each one is.
    let worst_secs = errors_secs[50..].iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
    eprintln!(
        "beats of a strap: within {:.0} ms after 50 beats (bar 30); {within} of {} within what is stated (bar 95 %), \
         at last {:.0} ms; this machine was late by up to {:.0} ms more than usual",
        1e3 * worst_secs,
        stated.len(),
        stated.last().map_or(f64::NAN, |(stated, _)| 1e3 * stated),
        1e3 * late_secs
    );
    assert!(worst_secs < 0.030 + late_secs, "{errors_secs:?}");
    assert!(within as f64 >= 0.95 * stated.len() as f64, "{stated:?}");
}

/// How much later a measurement, which is sent at a full second, arrived than it would on an idle machine [s].
fn late_secs(measurement: &Record, began: Time) -> f64 {
    const USUAL_SECS: f64 = 0.010;
    let since_secs = measurement.sample.log_time.secs_since(began);
    (since_secs.rem_euclid(1.0) - USUAL_SECS).max(0.0)
}

/// The time errors of the samples of a wave, whose values encode the time [s].
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

/// The minimum delay with which this machine sent waves, in the worst span [s].
///
/// An emulated device stamps its data with the time at which they are due, and this machine sends them when it gets to
/// it: a clock that is only known from its packets can't be known better than by the least delayed one.
fn least_late(waves: &[&Record], late_secs: impl Fn(&Record) -> f64) -> f64 {
    let least =
        |few: &[&Record]| few.iter().map(|wave| late_secs(wave)).fold(f64::INFINITY, f64::min);
    waves.windows(4).map(least).fold(0.0, f64::max)
}

/// Asserts that each sample was placed where it was measured, given errors [s] on a machine that was late.
fn is_where_it_was(device: &str, errors: impl Iterator<Item = f64>, late_secs: f64) {
    let (least, most) =
        errors.fold((0.0_f64, 0.0_f64), |(least, most), error| (least.min(error), most.max(error)));
    eprintln!(
        "{device}: each sample within {:.1} to {:.1} ms of when it was measured (bar 5); this machine was late with \
         each packet by up to {:.1} ms",
        1e3 * least,
        1e3 * most,
        1e3 * late_secs
    );
    assert!(least > -0.005 && most < 0.005 + late_secs);
}

/// Asserts that an ECG that encodes the time is placed where it was measured; the first seconds show how late the rest
/// are.
fn ecg_is_where_it_was(ecg: &[&Record], began: Time) {
    let late_secs = |wave: &Record| {
        let last = wave_errors(wave, began).last().copied().unwrap_or(f64::NAN);
        let Data::Wave(Wave { samples, .. }) = &wave.sample.data else { panic!("{wave:?}") };
        let lasted_secs = (samples.len() - 1) as f64 * wave.sample.period_ns / 1e9;
        wave.sample.log_time.secs_since(wave.sample.measured) - lasted_secs + last
    };
    let late_secs = least_late(ecg, late_secs);
    let errors = ecg[10..].iter().flat_map(|wave| wave_errors(wave, began));
    is_where_it_was("H10", errors, late_secs);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_ecg_of_an_h10_is_where_it_was_whatever_fails() {
    let incident = |at_secs, fault| Incident { at_secs, fault };
    let incidents = vec![
        incident(0.0, Fault::LostAnswer),
        incident(12.0, Fault::LostFrame),
        incident(14.0, Fault::Stall),
    ];
    let (device, course) = h10(ADDRESS, incidents);
    let (bluez, clock) = bluez(vec![device]).await;
    let context = context(bluez.bus_address());
    let began = context.clock.now() - clock.elapsed();
    let source = source::<Polar>(r#"person = "p001""#, &context);
    let seen_from = |records: &[Record], secs: f64| {
        let late = |record: &&&Record| record.sample.measured.secs_since(began) > secs;
        of(records, "ecg").iter().filter(late).count()
    };
    let records = session(vec![source], context.clock.clone(), |records| {
        let mut course = course.lock();
        // The link is lost once it streams again after the stall; the strap goes on streaming.
        course.drop |= seen_from(records, 15.0) == 3 && course.connections == 1;
        course.connections == 2 && seen_from(records, 15.0) > 10
    })
    .await;
    let ecg = of(&records, "ecg");
    assert_eq!((ecg[0].stream.signal, ecg[0].stream.device.as_str()), (Signal::Ecg, "polar_h10"));
    assert_eq!((ecg[0].stream.channels[0].unit.as_str(), ecg[0].stream.rate_hz), ("uV", 130.0));
    ecg_is_where_it_was(&ecg, began);
    let gap_secs = |pair: &[&Record]| pair[1].sample.measured.secs_since(pair[0].sample.measured);
    let gap_secs = ecg.windows(2).map(gap_secs).fold(0.0, f64::max);
    eprintln!(
        "H10 lost frame, stall, lost link: back {gap_secs:.1} s of the strap after each (bar 30)"
    );
    assert!(gap_secs < 30.0);
    // The strap's clock ran on: what comes after the loss is on the same time base.
    assert_eq!(epochs(&records, "ecg"), 0);
    let told = faults(&records);
    for what in ["ecg: no data for", "link is lost"] {
        assert!(told.iter().any(|label| label.contains(what)), "no `{what}` in {told:?}");
    }
    let lost = records.iter().filter(|record| record.stream.name == "/teampulse/lost_source");
    assert!(lost.count() >= 2, "the lost frame is not counted");
    let course = course.lock();
    assert_eq!(course.written.last().map(Vec::as_slice), Some(&[3, 0][..]), "it still streams");
    assert!(course.disconnections >= 1, "it is left connected");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bluetoothd_that_vanishes_and_returns_is_reached_again_on_the_same_time_base() {
    let folder = tempfile::tempdir().expect("a folder");
    let clock = Stopwatch::start();
    let start = async |folder: &std::path::Path| {
        let (device, _) = h10(ADDRESS, Vec::new());
        let bluez = EmulatedBluetooth::start_in(folder, vec![device], clock).await;
        bluez.expect("a dbus-daemon")
    };
    let first = start(folder.path()).await;
    // Another daemon has another identity, which is not part of the address.
    let context = context(first.bus_address());
    let began = context.clock.now() - clock.elapsed();
    let source = source::<Polar>(r#"person = "p001""#, &context);
    let (seen, mut waves) = tokio::sync::watch::channel(0);
    let returning = async {
        waves.wait_for(|waves| *waves >= 15).await.expect("the session runs");
        drop(first);
        (start(folder.path()).await, clock.elapsed())
    };
    let watched = session(vec![source], context.clock.clone(), |records| {
        let waves = of(records, "ecg").len();
        seen.send_replace(waves);
        of(records, "link").len() >= 3 && waves >= 30
    });
    let (records, (_second, returned)) = tokio::join!(watched, returning);
    assert_eq!(values(&of(&records, "link")), [1.0, 0.0, 1.0, 0.0]);
    let ecg = of(&records, "ecg");
    ecg_is_where_it_was(&ecg, began);
    assert_eq!(epochs(&records, "ecg"), 0);
    let measured = ecg.iter().map(|record| record.sample.measured.secs_since(began));
    let back = measured.filter(|secs| *secs > returned.as_secs_f64()).reduce(f64::min);
    let back_secs = back.expect("it came back") - returned.as_secs_f64();
    eprintln!("the ECG is back {back_secs:.1} s of the device after bluetoothd (bar 30)");
}

/// When the samples of a wave of a Verity Sense were measured, according to their values, and where they were placed
/// [s].
fn light_secs(record: &Record, began: Time) -> Vec<(f64, f64)> {
    // Of the first light: counts without any, and of all of it.
    const COUNTS: [f64; 2] = [430_000.0, 40_000.0];
    let Data::Wave(wave) = &record.sample.data else { panic!("{record:?}") };
    let first_secs = record.sample.measured.secs_since(began);
    let samples = wave.samples.chunks(wave.channels as usize).enumerate();
    let secs = |(place, counts): (usize, &[f64])| {
        let measured_secs = (counts[0] - COUNTS[0]) / COUNTS[1] / LIGHT_OF_SECS;
        (measured_secs, first_secs + place as f64 * record.sample.period_ns / 1e9)
    };
    samples.map(secs).collect()
}

/// Asserts that light was placed where it was measured, and was back soon after each failure.
fn light_is_where_it_was(ppg: &[&Record], began: Time) {
    let late_secs = |wave: &Record| {
        let last_secs = light_secs(wave, began).last().map_or(f64::NAN, |(measured, _)| *measured);
        wave.sample.log_time.secs_since(began) - last_secs
    };
    let late_secs = least_late(ppg, late_secs);
    // The first seconds show how late the others are.
    let placed: Vec<(f64, f64)> =
        ppg[10..].iter().flat_map(|wave| light_secs(wave, began)).collect();
    let errors = placed.iter().map(|(measured, placed)| placed - measured);
    is_where_it_was("Verity Sense", errors, late_secs);
    let gap_secs = placed.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max);
    eprintln!(
        "Verity Sense lost frame, stall, lost link: back {gap_secs:.1} s of it after each (bar 5)"
    );
    assert!(gap_secs < 5.0, "{gap_secs}");
}

/// Asserts that pulses are those of the heart, and placed where they occurred, within the stated uncertainty.
fn pulses_are_where_they_were(records: &[Record], began: Time) {
    // Each comes 0.2 s after its beat; the sensor does not say when, so it is placed by when its span ended.
    let next = beats().skip(1);
    let truth = beats().zip(next).map(|(one, next)| (((next - one) * 1e3).round(), next + 0.2));
    let truth: Vec<(f64, f64)> = truth.take(200).collect();
    let pulses = of(records, "pp_interval");
    let placed = pulses.iter().map(|pulse| pulse.sample.measured.secs_since(began));
    let pulses: Vec<(f64, f64)> = values(&pulses).into_iter().zip(placed).take(5).collect();
    let is_run = |all: &[(f64, f64)]| all.iter().zip(&pulses).all(|(one, other)| one.0 == other.0);
    let place = truth.windows(pulses.len()).position(is_run);
    let place = place.expect("are those of the heart, in their order");
    let stated = statuses(records, "pp_interval");
    let stated_secs = stated.last().map_or(f64::NAN, |(_, status)| status.uncertainty_secs());
    for (pulse, truth) in pulses.iter().zip(&truth[place..]) {
        assert!((pulse.1 - truth.1).abs() < stated_secs, "{pulse:?} {truth:?} {stated_secs}");
    }
    // They are as far apart as they were.
    let span_secs = |all: &[(f64, f64)]| all[pulses.len() - 1].1 - all[0].1;
    assert!((span_secs(&pulses) - span_secs(&truth[place..])).abs() < 0.05, "{pulses:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_light_and_the_pulses_of_a_verity_sense_are_where_they_were_whatever_fails() {
    let incident = |at_secs, fault| VerityIncident { at_secs, fault };
    let incidents = vec![
        incident(0.0, VerityFault::LostAnswer),
        incident(16.0, VerityFault::LostFrame),
        incident(18.0, VerityFault::Stall),
    ];
    let (device, course) = verity(ADDRESS, incidents);
    let (bluez, clock) = bluez(vec![device]).await;
    let context = context(bluez.bus_address());
    let began = context.clock.now() - clock.elapsed();
    let source = source::<Polar>(r#"person = "p001""#, &context);
    let records = session(vec![source], context.clock.clone(), |records| {
        let mut course = course.lock();
        course.drop |= of(records, "pp_interval").len() >= 5 && course.connections == 1;
        let last = of(records, "ppg").last().map(|wave| wave.sample.measured.secs_since(began));
        let returned = course.connections == 2 && of(records, "link").len() >= 3;
        returned && last.is_some_and(|secs| secs > 45.0)
    })
    .await;
    let ppg = of(&records, "ppg");
    let stream = &ppg[0].stream;
    assert_eq!((stream.signal, stream.rate_hz), (Signal::Ppg, 55.0));
    assert_eq!(stream.device, "polar_verity_sense");
    light_is_where_it_was(&ppg, began);
    assert_eq!(epochs(&records, "ppg"), 0);
    pulses_are_where_they_were(&records, began);
    let told = faults(&records);
    for what in ["ppg: no data for", "link is lost"] {
        assert!(told.iter().any(|label| label.contains(what)), "no `{what}` in {told:?}");
    }
    let course = course.lock();
    let stops: Vec<&[u8]> = course.written.iter().rev().take(2).map(Vec::as_slice).collect();
    assert!(stops.iter().all(|stop| stop[0] == 3), "it still streams: {stops:?}");
    assert!(course.disconnections >= 1, "it is left connected");
}

/// Asks for a vibration once a device is connected.
struct Button(SharedCourse);

#[async_trait::async_trait]
impl Source for Button {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        while self.0.lock().written.is_empty() {
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
    let (device, course) = armband(ADDRESS);
    let (bluez, _) = bluez(vec![device]).await;
    let context = context(bluez.bus_address());
    let source = source::<Myo>(r#"person = "p001""#, &context);
    let button = Box::new(Button(course.clone()));
    let records = session(vec![source, button], context.clock.clone(), |records| {
        let mut course = course.lock();
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
    eprintln!(
        "Myo: {} EMG samples bit for bit; back {:.2} s of the Myo after a lost link (bar 5)",
        2 * runs.len(),
        gaps[0] / 200.0
    );
    assert!(!of(&records, "orientation").is_empty() && !of(&records, "acceleration").is_empty());
    let course = course.lock();
    let last = course.written.iter().rev().take(2).rev().map(Vec::as_slice).collect::<Vec<_>>();
    assert!(course.written.iter().any(|command| *command == [3, 1, 2]), "it did not vibrate");
    assert_eq!(last, [&[1, 3, 0, 0, 0][..], &[9, 1, 0][..]], "it still streams");
}

/// The error of a source that finds these devices.
async fn refused(devices: Vec<EmulatedDevice>, settings: &str) -> String {
    let (bluez, _) = bluez(devices).await;
    let context = context(bluez.bus_address());
    let mut source = source::<Polar>(settings, &context);
    let outlet = Queue::new().outlet(context.clock.clone(), Streams::default());
    source.run(&outlet).await.expect_err("two are in range").to_string()
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_straps_in_range_none_is_guessed_not_even_by_a_name_that_both_have() {
    let other = "A0:9E:1A:00:00:02";
    for name in ["", "name = \"Polar H10 A1B2C3D4\""] {
        let devices = [ADDRESS, other].map(|address| h10(address, Vec::new()).0);
        let text = refused(devices.into(), &format!("person = \"p001\"\n{name}")).await;
        assert!(text.contains(ADDRESS) && text.contains(other), "{text}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn two_hundred_lost_links_leave_nothing_behind() {
    let addresses = (1..=STRAPS).map(|strap| format!("A0:9E:1A:00:00:{strap:02X}"));
    let addresses: Vec<String> = addresses.collect();
    let (devices, courses): (Vec<_>, Vec<_>) =
        addresses.iter().map(|address| strap(address)).unzip();
    let (bluez, _) = bluez(devices).await;
    let context = context(bluez.bus_address());
    let queue = Queue::new();
    let watcher = Watcher::of(&bluez).await;
    let mut left = Vec::new();
    for _ in 0..2 {
        let mut losing = tokio::task::JoinSet::new();
        for (strap, (address, course)) in addresses.iter().zip(&courses).enumerate() {
            let settings = format!("person = \"p00{strap}\"\naddress = \"{address}\"");
            let source = source::<HeartRate>(&settings, &context);
            let outlet = queue.outlet(context.clock.clone(), Streams::default());
            losing.spawn(lose_links(100 / STRAPS, source, outlet, course.clone()));
        }
        losing.join_all().await;
        left.push(watcher.left_behind().await);
    }
    assert_eq!(left[0], left[1]);
}

/// The number of straps that are connected at a time.
const STRAPS: usize = 4;

/// Runs a source repeatedly; its link is lost each time.
async fn lose_links(
    links: usize,
    mut source: Box<dyn Source>,
    outlet: Outlet,
    course: SharedCourse,
) {
    for _ in 0..links {
        let connections = course.lock().connections;
        let cutting = async {
            while course.lock().connections == connections {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
            course.lock().drop = true;
        };
        let (ended, ()) = tokio::join!(source.run(&outlet), cutting);
        assert!(ended.is_err(), "the link was lost");
    }
}

/// A connection to the bus that sees which others exist.
struct Watcher {
    connection: zbus::Connection,
    /// The number of other connections, without the sources.
    others: usize,
}

impl Watcher {
    async fn of(bluez: &EmulatedBluetooth) -> Watcher {
        let builder = zbus::connection::Builder::address(bluez.bus_address());
        let connection = builder.build().await.expect("a bus");
        let mut watcher = Watcher { connection, others: 0 };
        watcher.others = watcher.clients().await;
        watcher
    }

    async fn clients(&self) -> usize {
        let (bus, path) = ("org.freedesktop.DBus", "/org/freedesktop/DBus");
        let reply = self.connection.call_method(Some(bus), path, Some(bus), "ListNames", &()).await;
        let names = reply.expect("names").body().deserialize::<Vec<String>>().expect("names");
        names.iter().filter(|name| name.starts_with(':')).count()
    }

    /// The number of file descriptors and tasks, once no source has a connection to the bus and aborted tasks are gone.
    async fn left_behind(&self) -> (usize, usize) {
        while self.clients().await > self.others {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        let descriptors = std::fs::read_dir("/proc/self/fd").expect("on Linux").count();
        (descriptors, tokio::runtime::Handle::current().metrics().num_alive_tasks())
    }
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
