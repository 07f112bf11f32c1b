//! Clocks of devices and computers in a session: corrected, reported, and equal in a replay.

mod session;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::{ClockSettings, Clocks, Hindsight, IntervalLatency};
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, Event, EventKind, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::qos::Qos;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{About, Schema, Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use session::{Keeper, Recording, derived, encode};

const SECOND_NANOS: i64 = 1_000_000_000;
const BEGAN_NANOS: i64 = 1_700_000_000 * SECOND_NANOS;

/// A reading to come, with its stream.
struct Coming {
    arrival: i64,
    stream: Stream,
    device: Option<i64>,
    source: Option<i64>,
    data: Data,
}

/// Hands over readings at the times at which they arrive, with the reports on computers' clocks.
struct Script {
    readings: Vec<Coming>,
    stamped_by: Vec<(&'static str, &'static str)>,
}

#[async_trait]
impl Source for Script {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let began = Time::from_nanos(BEGAN_NANOS);
        for (topic, computer) in self.stamped_by.drain(..) {
            let stream = outlet.declare_at(messages(topic), began);
            outlet.stamped_by(stream, computer);
        }
        self.readings.sort_by_key(|reading| reading.arrival);
        for each in self.readings.drain(..) {
            let arrival = Time::from_nanos(each.arrival);
            let reading = Reading {
                index: None,
                stream: outlet.declare_at(each.stream, arrival),
                device_time: each.device,
                source_time: each.source.map(Time::from_nanos),
                data: each.data,
            };
            if outlet.send(reading, arrival).await.is_err() {
                break;
            }
        }
        Ok(())
    }
}

fn messages(topic: &str) -> Stream {
    let schema = Schema {
        name: "test_msgs/msg/Any".into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    let robot = topic.split('/').nth(1).unwrap_or_default();
    Stream::raw(topic, Subject::robot(robot), Shape::Message(Arc::new(schema)))
}

fn ecg() -> Stream {
    let subject = Subject { about: About::Person, id: "p001".into() };
    let mut stream = Stream::raw("/humans/persons/p001/polar_h10/ecg", subject, Shape::Wave);
    stream.device = "polar_h10".into();
    stream.rate_hz = 130.0;
    stream.with_channels(&[("ecg", "V")])
}

/// A heart strap: 73 samples in a notification, 60 to 150 ms late, its clock 40 ppm fast and an
/// hour ahead from `jump_secs` on.
fn strap(secs: i64, jump_secs: f64) -> Vec<Coming> {
    let period_nanos = SECOND_NANOS as f64 / 130.0;
    let batches = secs * 130 / 73;
    let batch = |k: i64| {
        let first_secs = (73 * k) as f64 / 130.0;
        let last_secs = first_secs + 72.0 / 130.0;
        let delay_secs = 0.06 + 0.09 * ((k * 7919) % 97) as f64 / 97.0;
        let jump_secs = if first_secs >= jump_secs { 3600.0 } else { 0.0 };
        let device_secs = 55.0 + first_secs * 1.000_04 + jump_secs;
        let wave =
            Wave { period_ns: period_nanos, channels: 1, samples: vec![k as f64; 73].into() };
        Coming {
            arrival: BEGAN_NANOS + ((last_secs + delay_secs) * 1e9) as i64,
            stream: ecg(),
            device: Some((device_secs * 1e9) as i64),
            source: None,
            data: Data::Wave(wave),
        }
    };
    (0..batches).map(batch).collect()
}

/// A robot that publishes at 10 Hz, 2 to 6 ms late, its clock ahead by `offset_secs`.
fn robot(topic: &str, secs: i64, offset_secs: f64) -> Vec<Coming> {
    let message = |k: i64| {
        let sent = BEGAN_NANOS + k * SECOND_NANOS / 10;
        Coming {
            arrival: sent + 2_000_000 + (k * 7919) % 97 * 40_000,
            stream: messages(topic),
            device: None,
            source: Some(sent + (offset_secs * 1e9) as i64),
            data: Data::Message(k.to_le_bytes().to_vec().into()),
        }
    };
    (1..10 * secs).map(message).collect()
}

async fn keep(source: impl Source + 'static, pause_ms: u64) -> Vec<Record> {
    keep_with(Clocks::default(), source, pause_ms).await
}

async fn keep_with(clocks: Clocks, source: impl Source + 'static, pause_ms: u64) -> Vec<Record> {
    let kept = Arc::default();
    let pause = Duration::from_millis(pause_ms);
    let session = Session {
        clock: Clock::settable(),
        pace: Pace::Recorded,
        clocks,
        streams: Streams::default(),
        sources: vec![("test".into(), Box::new(source))],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper { kept: Arc::clone(&kept), pause })],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(std::future::pending()).await;
    let mut kept = kept.lock().expect("nobody panicked");
    std::mem::take(&mut *kept)
}

fn last_status<'a>(records: &'a [Record], name: &str) -> &'a StreamStatus {
    let mut statuses = records.iter().rev().filter_map(|record| match &record.sample.data {
        Data::Status(status) => Some(&**status),
        _ => None,
    });
    statuses.find(|status| status.name == name).expect("its health is reported")
}

fn clock_events(records: &[Record]) -> Vec<&Event> {
    let events = records.iter().filter(|record| record.stream.name == "/teampulse/clocks");
    events
        .filter_map(|record| match &record.sample.data {
            Data::Event(event) => Some(&**event),
            _ => None,
        })
        .collect()
}

/// The error of the time of each batch's first sample, from some time on [s].
fn errors_secs(records: &[Record], from_secs: f64) -> Vec<f64> {
    let waves = records.iter().filter_map(|record| match &record.sample.data {
        Data::Wave(wave) => Some((record.sample.measured, wave.samples[0])),
        _ => None,
    });
    let placed = waves.map(|(measured, k)| {
        let true_secs = 73.0 * k / 130.0;
        (true_secs, (measured.nanos() - BEGAN_NANOS) as f64 / 1e9 - true_secs)
    });
    placed.filter(|(at, _)| *at > from_secs).map(|(_, error)| error).collect()
}

#[tokio::test]
async fn a_strap_is_placed_by_its_own_clock_and_not_by_its_arrivals() {
    let records = keep(Script { readings: strap(180, f64::MAX), stamped_by: vec![] }, 0).await;
    let errors = errors_secs(&records, 60.0);
    let (least, most) = errors
        .iter()
        .fold((f64::MAX, f64::MIN), |(least, most), error| (least.min(*error), most.max(*error)));
    assert!(errors.len() > 200 && most - least < 0.010, "{least} to {most} s");
    let status = last_status(&records, &ecg().name);
    assert_eq!((status.clock, status.epoch), (1, 0));
    assert!((status.skew_ppm - 40.0).abs() < 60.0, "{} ppm", status.skew_ppm);
    let uncertainty_secs = 1.96 * status.sigma_secs;
    assert!(errors.iter().all(|error| error.abs() < uncertainty_secs), "{uncertainty_secs} s");
}

/// A bracelet without a clock: 250 Hz in waves of four, the first with its number, 20 to 30 ms late. After 30 s
/// samples are lost.
struct Bracelet {
    lost: u64,
}

/// The samples of a wave of the bracelet.
const RUN: u64 = 4;
const BRACELET_HZ: f64 = 250.0;

fn ppg() -> Stream {
    let subject = Subject { about: About::Person, id: "p001".into() };
    let mut stream = Stream::raw("/humans/persons/p001/bracelet/ppg", subject, Shape::Wave);
    stream.device = "bracelet".into();
    stream.rate_hz = BRACELET_HZ;
    stream.with_channels(&[("ppg", "1")])
}

#[async_trait]
impl Source for Bracelet {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = outlet.declare_at(ppg(), Time::from_nanos(BEGAN_NANOS));
        let mut first = 0;
        for k in 0..7500_u64 {
            if k == 1875 {
                outlet.lost(stream, self.lost);
                first += self.lost;
            }
            let samples = (first..first + RUN).map(|number| number as f64).collect();
            first += RUN;
            let delay_secs = 0.02 + 0.01 * ((k * 7919) % 97) as f64 / 97.0;
            let arrival_secs = (first - 1) as f64 / BRACELET_HZ + delay_secs;
            let arrival = Time::from_nanos(BEGAN_NANOS + (arrival_secs * 1e9) as i64);
            let wave = Wave { period_ns: 1e9 / BRACELET_HZ, channels: 1, samples };
            let data = Data::Wave(wave);
            let reading =
                Reading { index: None, stream, device_time: None, source_time: None, data };
            if outlet.send(reading, arrival).await.is_err() {
                break;
            }
        }
        Ok(())
    }
}

#[tokio::test]
async fn lost_samples_move_no_time_whether_or_not_they_fill_waves() {
    for lost in [1, 48, 50] {
        let records = keep(Bracelet { lost }, 0).await;
        let placed = records.iter().filter_map(|record| match &record.sample.data {
            Data::Wave(wave) => Some((wave.samples[0], &record.sample)),
            _ => None,
        });
        let placed: Vec<_> = placed.collect();
        let error_secs = placed.iter().map(|(number, sample)| {
            (sample.measured.nanos() - BEGAN_NANOS) as f64 / 1e9 - number / BRACELET_HZ
        });
        let errors_secs: Vec<f64> = error_secs.skip(500).collect();
        let least = errors_secs.iter().copied().fold(f64::MAX, f64::min);
        let most = errors_secs.iter().copied().fold(f64::MIN, f64::max);
        assert!(most - least < 0.004, "{lost} lost: {least} to {most} s");
        let missing = placed.windows(2).map(|pair| pair[1].1.index - pair[0].1.index - 1);
        assert_eq!(missing.sum::<u64>(), lost.div_ceil(RUN), "{lost} lost");
        let status = last_status(&records, &ppg().name);
        assert_eq!((status.clock, status.lost_source), (3, Some(lost)));
        assert!(status.skew_ppm.abs() < 200.0, "{lost} lost: {} ppm", status.skew_ppm);
    }
}

fn intervals() -> Stream {
    let subject = Subject { about: About::Person, id: "p001".into() };
    let stream = Stream::raw("/humans/persons/p001/strap/interval", subject, Shape::Sample);
    Stream { device: "strap".into(), ..stream }.with_channels(&[("rr", "ms")])
}

/// The time of each beat of a heart, from the start [s].
fn beats(count: usize) -> Vec<f64> {
    let interval_secs = |k: usize| 0.8 + 0.2 * ((k * 7919) % 97) as f64 / 97.0;
    let next = |at: &mut f64, k| {
        *at += interval_secs(k);
        Some(*at)
    };
    (0..count).scan(0.0, next).collect()
}

/// A strap that sends the intervals of every two beats in one packet, 20 to 60 ms after the second, each
/// with the time of its beat by the strap's clock.
struct Pairs(Vec<f64>);

#[async_trait]
impl Source for Pairs {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        for (k, pair) in self.0.chunks(2).enumerate() {
            let delay_secs = 0.02 + 0.04 * ((k * 7919) % 97) as f64 / 97.0;
            let arrival_secs = pair[pair.len() - 1] + delay_secs;
            let arrival = Time::from_nanos(BEGAN_NANOS + (arrival_secs * 1e9) as i64);
            outlet.clock().set(arrival);
            let stream = outlet.declare(intervals());
            let reading = |at: &f64| Reading {
                index: None,
                stream,
                device_time: Some(((55.0 + at * 1.000_04) * 1e9) as i64),
                source_time: None,
                data: Data::Sample(Arc::new([*at])),
            };
            outlet.offer_together(pair.iter().map(reading).collect());
        }
        Ok(())
    }
}

#[tokio::test]
async fn intervals_that_come_in_one_packet_have_their_own_times_live_and_in_a_replay() {
    let beats = beats(200);
    let run = keep(Pairs(beats.clone()), 0).await;
    let name = intervals().name;
    let of_strap = |records: &[Record]| -> Vec<(Time, Time, u64, Option<i64>)> {
        let of_strap = records.iter().filter(|record| record.stream.name == name);
        let place = |record: &Record| {
            let sample = &record.sample;
            (sample.measured, sample.log_time, sample.index, sample.device_time)
        };
        of_strap.map(place).collect()
    };
    let placed = of_strap(&run);
    assert_eq!(placed.len(), beats.len());
    let mut errors_secs = Vec::new();
    for (number, ((measured, log_time, index, _), at)) in placed.iter().zip(&beats).enumerate() {
        assert_eq!(*index, number as u64);
        if *at > 60.0 {
            errors_secs.push((measured.nanos() - BEGAN_NANOS) as f64 / 1e9 - at);
        }
        if number % 2 == 1 {
            assert_eq!(*log_time, placed[number - 1].1, "they arrived together");
        }
    }
    // What all have in common is the fixed latency of the link, which no stamp shows.
    let least = errors_secs.iter().copied().fold(f64::MAX, f64::min);
    let most = errors_secs.iter().copied().fold(f64::MIN, f64::max);
    assert!(errors_secs.len() > 100 && most - least < 0.005, "{least} to {most} s");
    let status = last_status(&run, &name);
    assert!(most.max(-least) < 1.96 * status.sigma_secs, "{} s", status.sigma_secs);
    assert_eq!((status.late, status.duplicates, status.lost_queue), (0, 0, 0));
    assert!((status.rate_hz - 1.11).abs() < 0.1, "{} Hz", status.rate_hz);
    let replay = keep(Recording(run.clone()), 0).await;
    assert_eq!(of_strap(&replay), placed);
    assert_eq!(derived(&replay), derived(&run));
}

#[tokio::test]
async fn a_device_clock_that_jumps_begins_an_epoch_and_is_reported() {
    let records = keep(Script { readings: strap(180, 100.0), stamped_by: vec![] }, 0).await;
    let events = clock_events(&records);
    let jump = events.iter().find(|event| event.label.starts_with("polar_h10 of p001 jumped by +"));
    assert!(jump.is_some_and(|event| (event.value - 3600.0).abs() < 0.2), "{events:?}");
    assert_eq!(last_status(&records, &ecg().name).epoch, 1);
    assert!(
        errors_secs(&records, 60.0).iter().all(|error| error.abs() < 0.5),
        "no sample an hour off"
    );
}

/// An optical sensor that only numbers its samples: 36 in a frame, declared at 135 Hz and sent at 55 Hz.
fn pulse(secs: i64) -> Vec<Coming> {
    let subject = Subject { about: About::Person, id: "p001".into() };
    let mut stream = Stream::raw("/humans/persons/p001/verity/ppg", subject, Shape::Wave);
    (stream.device, stream.rate_hz) = ("verity".into(), 135.0);
    let stream = stream.with_channels(&[("ppg", "")]);
    let frame = |k: i64| {
        let delay_secs = 0.02 + 0.04 * ((k * 7919) % 97) as f64 / 97.0;
        let secs = (36 * (k + 1)) as f64 / 55.0 + delay_secs;
        let samples = vec![k as f64; 36].into();
        let wave = Wave { period_ns: SECOND_NANOS as f64 / 135.0, channels: 1, samples };
        Coming {
            arrival: BEGAN_NANOS + (secs * 1e9) as i64,
            stream: stream.clone(),
            device: None,
            source: None,
            data: Data::Wave(wave),
        }
    };
    (0..secs * 55 / 36).map(frame).collect()
}

#[tokio::test]
async fn a_rate_that_proves_wrong_is_declared_anew_and_is_no_fault_live_and_in_a_replay() {
    // The source declares its stream at each reading, as one does that connects again.
    let run = keep(Script { readings: pulse(120), stamped_by: vec![] }, 0).await;
    let name = "/humans/persons/p001/verity/ppg";
    let events = clock_events(&run);
    assert!(events.iter().any(|event| (event.value - 55.0).abs() < 0.5), "{events:?}");
    let rates_hz = |records: &[Record]| -> Vec<f64> {
        let described = records.iter().filter_map(|record| match &record.sample.data {
            Data::Description(stream) if stream.name == name => Some(stream.rate_hz),
            _ => None,
        });
        described.collect()
    };
    let rates = rates_hz(&run);
    assert_eq!((rates.len(), rates[0]), (2, 135.0));
    assert!((rates[1] - 55.0).abs() < 0.5, "{rates:?}");
    let status = last_status(&run, name);
    assert_eq!((status.state, status.reason.as_str()), (State::Ok, ""));
    for pause_ms in [0, 1] {
        let replay = keep(Recording(run.clone()), pause_ms).await;
        assert_eq!(rates_hz(&replay), rates);
        assert!(derived(&replay) == derived(&run));
    }
}

#[tokio::test]
async fn a_computer_whose_clock_is_off_is_named_and_its_stamps_are_shifted() {
    let mut readings = robot("/r1/odom", 60, 1.5);
    readings.extend(robot("/r2/odom", 60, 0.0));
    let stamped_by = vec![("/r1/odom", "laptop2 (driver)"), ("/r2/odom", "laptop3 (driver)")];
    let records = keep(Script { readings, stamped_by }, 0).await;
    let events = clock_events(&records);
    assert_eq!(events.len(), 1, "{events:?}");
    assert!(events[0].label.starts_with("laptop2 (driver) is +1."), "{}", events[0].label);
    assert!((events[0].value - 1.5).abs() < 0.02, "{events:?}");
    let (off, right) = (last_status(&records, "/r1/odom"), last_status(&records, "/r2/odom"));
    assert_eq!((off.state, right.state), (State::Degraded, State::Ok));
    assert!((off.offset_secs - 1.5).abs() < 0.02, "{} s", off.offset_secs);
    let of_r1 = records.iter().filter(|record| record.stream.name == "/r1/odom").skip(50);
    let worst = of_r1.map(|record| record.sample.log_time.secs_since(record.sample.measured));
    assert!(worst.map(f64::abs).fold(0.0, f64::max) < 0.02);
}

#[tokio::test]
async fn a_replay_gives_the_same_times_as_the_run() {
    let mut readings = strap(120, 70.0);
    readings.extend(robot("/r1/odom", 120, 1.5));
    let stamped_by = vec![("/r1/odom", "laptop2")];
    let run = keep(Script { readings, stamped_by }, 0).await;
    for pause_ms in [0, 1] {
        let replay = keep(Recording(run.clone()), pause_ms).await;
        assert!(derived(&replay) == derived(&run), "a pause of {pause_ms} ms changed the replay");
        let times = |records: &[Record]| -> Vec<Time> {
            records.iter().map(|record| record.sample.measured).collect()
        };
        assert!(times(&replay) == times(&run));
    }
}

#[tokio::test]
async fn samples_kept_for_late_joiners_keep_their_time_live_and_in_a_replay() {
    let subject = Subject { about: About::Person, id: "p001".into() };
    let mut phases = Stream::raw("/humans/persons/p001/task/phases", subject, Shape::Event);
    phases.qos = vec![Qos::latched(100)];
    let phase = |label: &str, began_secs: i64, arrival_secs: i64| {
        let (kind, label) = (EventKind::Phase, label.to_owned());
        let event = Event { kind, label, value: f64::NAN, duration_secs: 60.0 };
        Coming {
            arrival: BEGAN_NANOS + arrival_secs * SECOND_NANOS,
            stream: phases.clone(),
            device: None,
            source: Some(BEGAN_NANOS + began_secs * SECOND_NANOS),
            data: Data::Event(Arc::new(event)),
        }
    };
    // Someone joins after 200 s, receives two phases from before, and then one that begins.
    let readings =
        vec![phase("baseline", 0, 200), phase("1-back", 60, 201), phase("rest", 260, 260)];
    let run = keep(Script { readings, stamped_by: vec![] }, 0).await;
    let begun_secs = |records: &[Record]| -> Vec<i64> {
        let of_phases = records.iter().filter(|record| record.stream.name == phases.name);
        let begun = of_phases.map(|record| record.sample.measured.nanos() - BEGAN_NANOS);
        begun.map(|nanos| nanos / SECOND_NANOS).collect()
    };
    assert_eq!(begun_secs(&run), [0, 60, 260]);
    let replay = keep(Recording(run.clone()), 0).await;
    assert_eq!(begun_secs(&replay), begun_secs(&run));
    assert!(derived(&replay) == derived(&run));
}

#[tokio::test]
async fn with_hindsight_a_recording_is_placed_right_from_its_beginning_and_stays_so() {
    let run = keep(Script { readings: strap(180, f64::MAX), stamped_by: vec![] }, 0).await;
    let hindsight = Hindsight::default();
    let first = Clocks::collecting(BTreeMap::new(), &hindsight);
    keep_with(first, Recording(run.clone()), 0).await;
    let second = Clocks::with_hindsight(BTreeMap::new(), hindsight);
    let retimed = keep_with(second, Recording(run.clone()), 0).await;
    let spread = |records: &[Record]| {
        let errors = errors_secs(records, 0.0);
        errors.iter().copied().fold(f64::MIN, f64::max)
            - errors.iter().copied().fold(f64::MAX, f64::min)
    };
    let (live_secs, retimed_secs) = (spread(&run), spread(&retimed));
    assert!(retimed_secs < 0.006 && retimed_secs < live_secs, "{live_secs}, {retimed_secs} s");

    let viewed = keep_with(Clocks::retimed(BTreeMap::new()), Recording(retimed.clone()), 0).await;
    let times = |records: &[Record]| -> Vec<(Time, f64)> {
        let waves = records.iter().filter(|record| record.stream.shape == Shape::Wave);
        waves.map(|record| (record.sample.measured, record.sample.period_ns)).collect()
    };
    assert!(times(&viewed) == times(&retimed), "what is stamped anew is not corrected again");
}

#[tokio::test]
async fn a_latency_that_the_study_gives_is_taken_off_a_drivers_messages() {
    let latency = ClockSettings { latency_secs: Some(0.08), ..ClockSettings::default() };
    let clocks = Clocks::new([("imu".to_owned(), latency)].into());
    let mut readings = robot("/r1/imu", 20, 0.0);
    readings.extend(robot("/r1/odom", 20, 0.0));
    let records = keep_with(clocks, Script { readings, stamped_by: vec![] }, 0).await;
    let before_stamp_nanos = |name: &str| -> Vec<i64> {
        let of_name = records.iter().filter(|record| record.stream.name == name);
        let sample = of_name.map(|record| &record.sample);
        sample.filter_map(|it| Some(it.source_time?.nanos_since(it.measured))).collect()
    };
    assert!(before_stamp_nanos("/r1/imu").iter().all(|nanos| *nanos == 80_000_000));
    assert!(before_stamp_nanos("/r1/odom").iter().all(|nanos| *nanos == 0));
    assert!(
        last_status(&records, "/r1/imu").sigma_secs > last_status(&records, "/r1/odom").sigma_secs
    );
}

#[tokio::test]
async fn over_a_link_whose_interval_the_study_knows_the_latency_is_that_of_the_interval() {
    const INTERVAL_NANOS: i64 = 30_000_000;
    let last_of = async |interval_secs: f64| {
        let of_interval =
            IntervalLatency { interval_secs, latency_secs: 0.07, uncertainty_secs: Some(0.002) };
        let settings = ClockSettings {
            latency_secs: Some(0.05),
            uncertainty_secs: Some(0.02),
            intervals: vec![of_interval],
            ..ClockSettings::default()
        };
        let mut readings = strap(240, 1e9);
        for reading in &mut readings {
            let since = reading.arrival - BEGAN_NANOS;
            let events = since.div_euclid(INTERVAL_NANOS) + 1;
            reading.arrival = BEGAN_NANOS + events * INTERVAL_NANOS;
        }
        let clocks = Clocks::new([("polar_h10".to_owned(), settings)].into());
        let records = keep_with(clocks, Script { readings, stamped_by: vec![] }, 0).await;
        let waves = records.iter().filter(|record| record.stream.shape == Shape::Wave);
        let measured = waves.map(|record| record.sample.measured.nanos()).next_back();
        (measured.expect("there are waves"), last_status(&records, &ecg().name).sigma_secs)
    };
    let (of_another, sigma_of_another) = last_of(0.015).await;
    let (of_this, sigma_of_this) = last_of(0.03).await;
    assert!((of_another - of_this - 20_000_000).abs() < 2_000, "{}", of_another - of_this);
    assert!(sigma_of_this < sigma_of_another / 2.0, "{sigma_of_this}, {sigma_of_another}");
}
