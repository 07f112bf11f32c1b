//! Robots on a bus in memory, watched by a whole session.

mod keeper;
mod watching;

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::data::Data;
use teampulse_core::stream::{Shape, Signal};
use teampulse_core::time::Time;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::sensor_msgs::Temperature;
use teampulse_messages::standard::std_msgs::Header;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::robots::Robots;
use teampulse_sources::topics::Topics;

use watching::{faults, of, publisher, subscribed, watch};

fn temperature(secs: i32, temperature: f64) -> Vec<u8> {
    let header = Header { stamp: Time::from_stamp(secs, 5), frame_id: String::new() };
    Temperature { header, temperature, variance: 0.0 }.encode().to_vec()
}

const ROBOTS: &str = r#"namespace = "/robot*""#;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn whose_clock_stamps_a_topic_is_told_before_its_first_message() {
    let topic = "/robot1/motor/temperature";
    let records = watch::<Robots>(ROBOTS, async move |bus: Arc<MemoryBus>| {
        let publisher = publisher(&bus, topic, "sensor_msgs/msg/Temperature");
        subscribed(&*publisher).await;
        publisher.publish(&temperature(100, 21.5)).expect("published");
    })
    .await;
    let told = of(&records, "/teampulse/stamped_by");
    let Data::Event(event) = &told[0].sample.data else { panic!("{told:?}") };
    assert!(event.label.starts_with(&format!("{topic} /robot1/driver (")), "{}", event.label);
    assert!(told[0].sample.log_time < of(&records, topic)[0].sample.log_time);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_that_appears_is_watched_byte_for_byte() {
    let sent = temperature(100, 21.5);
    let message = sent.clone();
    let records = watch::<Robots>(ROBOTS, async move |bus: Arc<MemoryBus>| {
        let topic = "/robot1/motor/temperature";
        let publisher = publisher(&bus, topic, "sensor_msgs/msg/Temperature");
        subscribed(&*publisher).await;
        for _ in 0..3 {
            publisher.publish(&message).expect("published");
        }
    })
    .await;
    let kept = of(&records, "/robot1/motor/temperature");
    assert_eq!(kept.len(), 3);
    assert!(kept.iter().all(|record| record.cdr[..] == sent[..]));
    let stream = &kept[0].stream;
    assert_eq!((stream.id.as_str(), stream.signal), ("robot1", Signal::Temperature));
    assert!(matches!(&stream.shape, Shape::Message(schema) if !schema.text.is_empty()));
    assert_eq!(kept[0].sample.source_time, Some(Time::from_stamp(100, 5)));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn arbitrary_bytes_are_recorded_and_do_no_harm() {
    let records = watch::<Robots>(ROBOTS, async |bus: Arc<MemoryBus>| {
        let publisher = publisher(&bus, "/robot1/temperature", "sensor_msgs/msg/Temperature");
        subscribed(&*publisher).await;
        for length in 0..40 {
            publisher.publish(&vec![0xff; length]).expect("published");
        }
    })
    .await;
    assert_eq!(of(&records, "/robot1/temperature").len(), 40);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_type_that_nobody_can_explain_is_recorded_and_said_once() {
    let records = watch::<Topics>(r#"names = ["/odd"]"#, async |bus: Arc<MemoryBus>| {
        let publisher = publisher(&bus, "/odd", "odd_msgs/msg/Odd");
        subscribed(&*publisher).await;
        publisher.publish(&[0, 1, 0, 0, 7]).expect("published");
        tokio::time::sleep(Duration::from_millis(100)).await;
    })
    .await;
    assert_eq!(of(&records, "/odd").len(), 1);
    let told = faults(&records);
    assert_eq!(
        told.iter().filter(|label| label.contains("odd_msgs/msg/Odd")).count(),
        1,
        "{told:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_types_on_one_topic_are_both_recorded_and_told() {
    let records = watch::<Topics>(r#"names = ["/both"]"#, async |bus: Arc<MemoryBus>| {
        let first = publisher(&bus, "/both", "std_msgs/msg/String");
        let second = publisher(&bus, "/both", "std_msgs/msg/Int32");
        subscribed(&*first).await;
        subscribed(&*second).await;
        first.publish(&[0, 1, 0, 0, 1, 0, 0, 0, 0]).expect("published");
        second.publish(&[0, 1, 0, 0, 1, 0, 0, 0]).expect("published");
        tokio::time::sleep(Duration::from_millis(100)).await;
    })
    .await;
    assert_eq!(of(&records, "/both").len(), 2);
    let told = faults(&records);
    assert!(told.iter().any(|label| label.contains("two types")), "{told:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_publishers_of_one_topic_are_told_once_by_name() {
    let topic = "/robot1/temperature";
    let records = watch::<Robots>(ROBOTS, async move |bus: Arc<MemoryBus>| {
        let other = bus.join("/robot1/second_driver");
        let first = publisher(&bus, topic, "sensor_msgs/msg/Temperature");
        subscribed(&*first).await;
        for _ in 0..2 {
            let second = publisher(&other, topic, "sensor_msgs/msg/Temperature");
            subscribed(&*second).await;
            tokio::time::sleep(Duration::from_millis(1_200)).await;
        }
    })
    .await;
    let told = faults(&records);
    let several: Vec<_> = told.iter().filter(|label| label.contains("published by")).collect();
    let [label] = several[..] else { panic!("{told:?}") };
    assert!(label.starts_with(&format!("{topic}: published by two processes: ")), "{label}");
    assert!(label.contains("/robot1/driver") && label.contains("/robot1/second_driver"), "{label}");
}
