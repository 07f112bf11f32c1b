//! Sensors that other nodes publish as plain numbers, on an in-memory bus, recorded by a whole session.

#![expect(clippy::float_cmp, reason = "these are exact")]

mod keeper;
mod watching;

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::data::{Data, EventKind};
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Origin, Signal};
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::biosensors::Biosensors;

use watching::{faults, of, publisher, subscribed, watch};

const PERSON: &str = r#"person = "p003""#;
const FLOAT: &str = "std_msgs/msg/Float32";
const INT: &str = "std_msgs/msg/Int32";

/// A message of one number, with its header.
fn number(bytes: [u8; 4]) -> Vec<u8> {
    [[0, 1, 0, 0], bytes].concat()
}

fn float(value: f32) -> Vec<u8> {
    number(value.to_le_bytes())
}

fn int(value: i32) -> Vec<u8> {
    number(value.to_le_bytes())
}

fn values(records: &[Record], name: &str) -> Vec<f64> {
    let first = |record: &Record| match &record.sample.data {
        Data::Sample(values) => values[0],
        other => panic!("{other:?}"),
    };
    of(records, name).into_iter().map(first).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn numbers_become_streams_of_a_person_with_their_units() {
    let records = watch::<Biosensors>(PERSON, async |bus: Arc<MemoryBus>| {
        let skin = publisher(&bus, "/biosensors/shimmer3_gsr/gsr", FLOAT);
        let heart = publisher(&bus, "/p007/biosensors/empatica_e4/ibi", FLOAT);
        let tag = publisher(&bus, "/biosensors/empatica_e4/tag", "std_msgs/msg/Empty");
        let chunk = publisher(&bus, "/biosensors/empatica_e4/bvp_chunk", FLOAT);
        for each in [&skin, &heart, &tag] {
            subscribed(&**each).await;
        }
        skin.publish(&float(200.0)).expect("published");
        heart.publish(&float(0.8)).expect("published");
        tag.publish(&[0, 1, 0, 0, 0]).expect("published");
        tokio::time::sleep(Duration::from_millis(100)).await;
        assert_eq!(chunk.subscribers(), 0, "it repeats what another has");
    })
    .await;
    assert_eq!(values(&records, "/humans/persons/p003/shimmer3_gsr/eda"), [5.0]);
    let stream = &of(&records, "/humans/persons/p003/shimmer3_gsr/eda")[0].stream;
    assert_eq!((stream.about, stream.origin), (About::Person, Origin::Raw));
    assert_eq!((stream.signal, stream.channels[0].unit.as_str()), (Signal::Eda, "uS"));
    assert!((stream.rate_hz - 32768.0 / 655.0).abs() < 1e-9);
    let intervals = values(&records, "/humans/persons/p007/empatica_e4/ibi");
    assert!((intervals[0] - 800.0).abs() < 1e-3, "{intervals:?}");
    let [press] = of(&records, "/humans/persons/p003/empatica_e4/events")[..] else { panic!() };
    let Data::Event(event) = &press.sample.data else { panic!("{press:?}") };
    assert_eq!((event.kind, event.label.as_str()), (EventKind::Marker, "tag"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_bytes_that_were_published_apart_are_an_interval_again() {
    let records = watch::<Biosensors>(PERSON, async |bus: Arc<MemoryBus>| {
        let low = publisher(&bus, "/biosensors/polar_h10/ibi", INT);
        let high = publisher(&bus, "/biosensors/polar_h10/dev", INT);
        subscribed(&*high).await;
        subscribed(&*low).await;
        for interval in [850, 700] {
            low.publish(&int(interval & 0xff)).expect("published");
            high.publish(&int(interval >> 8)).expect("published");
        }
        high.publish(&int(3)).expect("published"); // without its low byte
        tokio::time::sleep(Duration::from_millis(700)).await;
    })
    .await;
    let topic = "/humans/persons/p003/polar_h10/rr_interval";
    assert_eq!(values(&records, topic), [850.0, 700.0].map(|steps| steps * 1000.0 / 1024.0));
    assert_eq!(of(&records, topic)[0].stream.signal, Signal::Interval);
    let is_told = |label: &String| label.contains("low byte") && label.contains("counted as lost");
    assert_eq!(faults(&records).iter().filter(|label| is_told(label)).count(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_was_started_twice_is_kept_apart() {
    let records = watch::<Biosensors>(PERSON, async |bus: Arc<MemoryBus>| {
        let topic = "/biosensors/empatica_e4/gsr";
        let one = publisher(&bus, topic, FLOAT);
        let twin = bus.join("/twin");
        let other = publisher(&twin, topic, FLOAT);
        subscribed(&*one).await;
        subscribed(&*other).await;
        for _ in 0..10 {
            one.publish(&float(1.0)).expect("published");
            other.publish(&float(2.0)).expect("published");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    })
    .await;
    let name = "/humans/persons/p003/empatica_e4/eda";
    let heard = values(&records, name);
    assert!(!heard.is_empty() && heard.iter().all(|value| *value == heard[0]), "{heard:?}");
    let is_told = |label: &String| label.contains("a second publisher");
    assert_eq!(faults(&records).iter().filter(|label| is_told(label)).count(), 1);
}
