//! People on an in-memory bus, recorded by a whole session.

mod keeper;
mod watching;

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Channel, Origin, Shape, Signal, Stream, Subject};
use teampulse_core::time::Time;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::std_msgs::Header;
use teampulse_messages::standard::teampulse_msgs as msgs;
use teampulse_ros::bus::Publisher;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::ros_people::RosPeople;

use watching::{faults, of, publisher, subscribed, watch};

const ECG: &str = "/humans/persons/p001/strap/ecg";
const PEOPLE: &str = "";

fn wave(stamp: Time, samples: &[f64]) -> Vec<u8> {
    numbered(0, stamp, samples)
}

fn numbered(index: u64, stamp: Time, samples: &[f64]) -> Vec<u8> {
    let header = Header { stamp, frame_id: String::new() };
    let samples = samples.to_vec();
    let (device_time, period_ns) = (77, 1e9 / 128.0);
    msgs::Wave { header, device_time, index, period_ns, channels: 1, samples }.encode().to_vec()
}

/// The description of the ECG that a sensor's computer publishes.
fn description() -> Vec<u8> {
    let subject = Subject { about: About::Person, id: "p001".into() };
    let stream = Stream {
        signal: Signal::Ecg,
        device: "polar_h10".into(),
        rate_hz: 128.0,
        channels: vec![Channel { scale: 0.5, ..Channel::new("lead1", "mV") }],
        ..Stream::raw(ECG, subject, Shape::Wave)
    };
    let header = Header::at(Time::from_stamp(5, 0));
    msgs::StreamDescription::of(&stream, header).encode().to_vec()
}

fn descriptions(bus: &MemoryBus) -> Box<dyn Publisher> {
    publisher(bus, "/teampulse/streams", msgs::StreamDescription::NAME)
}

/// What is known about a stream at the end.
fn stream(records: &[Record], name: &str) -> Stream {
    Stream::clone(&of(records, name).last().expect("it was heard").stream)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_described_signal_is_declared_as_it_is_described_and_kept_raw() {
    let stamp = clock::wall();
    let records = watch::<RosPeople>(PEOPLE, async move |bus: Arc<MemoryBus>| {
        let (described, ecg) = (descriptions(&bus), publisher(&bus, ECG, msgs::Wave::NAME));
        subscribed(&*described).await;
        described.publish(&description()).expect("published");
        subscribed(&*ecg).await;
        tokio::time::sleep(Duration::from_millis(50)).await;
        ecg.publish(&wave(stamp, &[1.0, 2.0])).expect("published");
    })
    .await;
    let [record] = of(&records, ECG)[..] else { panic!("{records:?}") };
    let heard = &record.stream;
    assert_eq!(
        (heard.about, heard.id.as_str(), heard.origin),
        (About::Person, "p001", Origin::Raw)
    );
    assert_eq!((heard.signal, heard.device.as_str()), (Signal::Ecg, "polar_h10"));
    assert_eq!(heard.channels, [Channel { scale: 0.5, ..Channel::new("lead1", "mV") }]);
    assert!((heard.rate_hz - 128.0).abs() < 1e-9, "{heard:?}");
    let sample = &record.sample;
    assert_eq!((sample.source_time, sample.device_time), (Some(stamp), Some(77)));
    assert_eq!(sample.measured, stamp, "what another computer has stamped is believed");
    let Data::Wave(wave) = &sample.data else { panic!("{sample:?}") };
    assert_eq!((wave.channels, &*wave.samples), (1, &[1.0, 2.0][..]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_description_that_comes_late_is_learned() {
    let records = watch::<RosPeople>(PEOPLE, async |bus: Arc<MemoryBus>| {
        let ecg = publisher(&bus, ECG, msgs::Wave::NAME);
        subscribed(&*ecg).await;
        ecg.publish(&wave(clock::wall(), &[1.0])).expect("published");
        let described = descriptions(&bus);
        subscribed(&*described).await;
        described.publish(&description()).expect("published");
        tokio::time::sleep(Duration::from_millis(100)).await;
        ecg.publish(&wave(clock::wall(), &[1.0])).expect("published");
    })
    .await;
    let channels: Vec<usize> =
        of(&records, ECG).iter().map(|record| record.stream.channels.len()).collect();
    assert_eq!(channels, [0, 1]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_signal_that_nobody_describes_is_what_its_name_and_its_messages_say() {
    let records = watch::<RosPeople>(PEOPLE, async |bus: Arc<MemoryBus>| {
        let ecg = publisher(&bus, ECG, msgs::Wave::NAME);
        subscribed(&*ecg).await;
        for _ in 0..20 {
            ecg.publish(&wave(clock::wall(), &[1.0])).expect("published");
        }
        tokio::time::sleep(Duration::from_millis(700)).await;
        ecg.publish(&wave(clock::wall(), &[1.0])).expect("published");
    })
    .await;
    let heard = stream(&records, ECG);
    assert_eq!((heard.signal, heard.device.as_str()), (Signal::Ecg, "strap"));
    assert_eq!(heard.channels, [Channel::new("ecg", "")]);
    assert!((heard.rate_hz - 128.0).abs() < 1e-6);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_never_reached_its_publisher_is_a_gap_and_counted() {
    let indices = [100, 101, 102, 105, 106, 110];
    let records = watch::<RosPeople>(PEOPLE, async move |bus: Arc<MemoryBus>| {
        let ecg = publisher(&bus, ECG, msgs::Wave::NAME);
        subscribed(&*ecg).await;
        for index in indices {
            ecg.publish(&numbered(index, clock::wall(), &[1.0, 2.0])).expect("published");
        }
    })
    .await;
    let kept: Vec<u64> = of(&records, ECG).iter().map(|record| record.sample.index).collect();
    assert_eq!(kept, indices);
    let lost = of(&records, "/teampulse/lost_source").into_iter().filter_map(lost).sum::<f64>();
    assert!((lost - 10.0).abs() < 1e-9, "samples, not waves of two: {lost}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_can_not_be_decoded_is_reported_once_and_counted() {
    let records = watch::<RosPeople>(PEOPLE, async |bus: Arc<MemoryBus>| {
        let ecg = publisher(&bus, ECG, msgs::Wave::NAME);
        subscribed(&*ecg).await;
        for length in 0..40 {
            ecg.publish(&vec![0xff; length]).expect("published");
        }
        ecg.publish(&wave(clock::wall(), &[])).expect("published");
        ecg.publish(&wave(clock::wall(), &[1.0])).expect("published");
    })
    .await;
    assert_eq!(of(&records, ECG).len(), 1);
    let faults_found = faults(&records);
    assert_eq!(
        faults_found.iter().filter(|label| label.starts_with(ECG)).count(),
        1,
        "{faults_found:?}"
    );
    let lost = of(&records, "/teampulse/lost_source").into_iter().filter_map(lost).sum::<f64>();
    assert!((lost - 41.0).abs() < 1e-9, "{lost}");
}

fn lost(record: &Record) -> Option<f64> {
    let Data::Event(event) = &record.sample.data else { return None };
    (event.label == ECG).then_some(event.value)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn arbitrary_descriptions_do_no_harm() {
    let records = watch::<RosPeople>(PEOPLE, async |bus: Arc<MemoryBus>| {
        let (described, ecg) = (descriptions(&bus), publisher(&bus, ECG, msgs::Wave::NAME));
        subscribed(&*described).await;
        for length in 0..200 {
            described.publish(&vec![0xff; length]).expect("published");
            described
                .publish(&description()[..length.min(description().len())])
                .expect("published");
        }
        subscribed(&*ecg).await;
        ecg.publish(&wave(clock::wall(), &[1.0])).expect("published");
    })
    .await;
    assert_eq!(of(&records, ECG).len(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_a_person_does_comes_as_events() {
    let topic = "/humans/persons/p002/task/presses";
    let records = watch::<RosPeople>(PEOPLE, async move |bus: Arc<MemoryBus>| {
        let presses = publisher(&bus, topic, msgs::Event::NAME);
        subscribed(&*presses).await;
        let press = msgs::Event {
            header: Header::at(clock::wall()),
            device_time: msgs::NO_DEVICE_TIME,
            kind: "marker".into(),
            label: "press".into(),
            value: 0.6,
            duration_secs: 0.0,
        };
        presses.publish(&press.encode()).expect("published");
    })
    .await;
    let [record] = of(&records, topic)[..] else { panic!("{records:?}") };
    let Data::Event(event) = &record.sample.data else { panic!("{record:?}") };
    assert_eq!((event.kind, event.label.as_str()), (EventKind::Marker, "press"));
    assert_eq!((record.stream.signal, record.stream.id.as_str()), (Signal::Event, "p002"));
}

/// Publishes the ECG often enough for a second publisher to be distinguished from a restarted one; returns how often,
/// and the faults.
async fn both_talk(first: &dyn Publisher, second: &dyn Publisher) {
    for k in 0..60 {
        first.publish(&wave(clock::wall(), &[f64::from(k)])).expect("published");
        second.publish(&wave(clock::wall(), &[f64::from(-1000 - k)])).expect("published");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// The first number of each wave of a stream.
fn numbers(records: &[Record], name: &str) -> Vec<f64> {
    let first = |record: &&Record| match &record.sample.data {
        Data::Wave(wave) => wave.samples[0],
        other => panic!("{other:?}"),
    };
    of(records, name).iter().map(first).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_publishers_of_one_person_are_not_merged_into_one_heart() {
    let records = watch::<RosPeople>(PEOPLE, async |bus: Arc<MemoryBus>| {
        let (laptop, other) = (bus.join("/laptop1/driver"), bus.join("/laptop2/driver"));
        let first = publisher(&laptop, ECG, msgs::Wave::NAME);
        subscribed(&*first).await;
        first.publish(&wave(clock::wall(), &[-1.0])).expect("published");
        let second = publisher(&other, ECG, msgs::Wave::NAME);
        subscribed(&*second).await;
        both_talk(&*first, &*second).await;
    })
    .await;
    let expected = |from: i32, step: i32| (0..60).map(move |k| f64::from(from + step * k));
    let of_first: Vec<f64> = std::iter::once(-1.0).chain(expected(0, 1)).collect();
    assert_eq!(numbers(&records, ECG), of_first);
    let beside = format!("{ECG}/publisher_2");
    assert_eq!(numbers(&records, &beside), expected(-1000, -1).collect::<Vec<_>>());
    let stream = stream(&records, &beside);
    assert_eq!((stream.beside.as_str(), stream.id.as_str()), (ECG, "p001"));
    assert!(stream.publisher.starts_with("/laptop2/driver ("), "{}", stream.publisher);
    let faults_found = faults(&records);
    let [label] = &faults_found[..] else { panic!("{faults_found:?}") };
    assert!(label.starts_with(&format!("{ECG}: a second publisher, /laptop2/driver (")), "{label}");
    assert!(label.contains(", beside /laptop1/driver (") && label.ends_with(&beside), "{label}");
    let published_by = of(&records, "/teampulse/published_by");
    let Data::Event(event) = &published_by[0].sample.data else { panic!("{published_by:?}") };
    assert!(event.label.starts_with(&format!("{ECG} /laptop1/driver (")), "{}", event.label);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_publisher_that_restarts_is_the_same_stream_from_its_first_message_on() {
    let records = watch::<RosPeople>(PEOPLE, async |bus: Arc<MemoryBus>| {
        let mut count = 0;
        for _ in 0..5 {
            let driver = bus.join("/laptop1/driver");
            let ecg = publisher(&driver, ECG, msgs::Wave::NAME);
            subscribed(&*ecg).await;
            for _ in 0..20 {
                ecg.publish(&wave(clock::wall(), &[f64::from(count)])).expect("published");
                count += 1;
            }
        }
    })
    .await;
    assert_eq!(numbers(&records, ECG), (0..100).map(f64::from).collect::<Vec<_>>());
    assert_eq!(faults(&records), Vec::<String>::new());
}
