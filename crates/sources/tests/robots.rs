//! Robots on an in-memory bus, recorded by a whole session.

mod keeper;
mod watching;

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::data::Data;
use teampulse_core::qos::Qos;
use teampulse_core::sample::Record;
use teampulse_core::source::Source;
use teampulse_core::stream::{About, Schema, Shape, Signal};
use teampulse_core::time::Time;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::sensor_msgs::Temperature;
use teampulse_messages::standard::std_msgs::Header;
use teampulse_ros::bus::Bus;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::SourceContext;
use teampulse_sources::robots::Robots;
use teampulse_sources::ros_people::RosPeople;
use teampulse_sources::topics::Topics;

use watching::{built, faults, of, publisher, subscribed, watch, watch_with};

fn temperature(secs: i32, temperature: f64) -> Vec<u8> {
    let header = Header { stamp: Time::from_stamp(secs, 5), frame_id: String::new() };
    Temperature { header, temperature, variance: 0.0 }.encode().to_vec()
}

const ROBOTS: &str = r#"namespace = "/robot*""#;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn whose_clock_stamps_a_topic_is_reported_before_its_first_message() {
    let topic = "/robot1/motor/temperature";
    let records = watch::<Robots>(ROBOTS, async move |bus: Arc<MemoryBus>| {
        let publisher = publisher(&bus, topic, "sensor_msgs/msg/Temperature");
        subscribed(&*publisher).await;
        publisher.publish(&temperature(100, 21.5)).expect("published");
    })
    .await;
    let stamped = of(&records, "/teampulse/stamped_by");
    let Data::Event(event) = &stamped[0].sample.data else { panic!("{stamped:?}") };
    assert!(event.label.starts_with(&format!("{topic} /robot1/driver (")), "{}", event.label);
    assert!(stamped[0].sample.log_time < of(&records, topic)[0].sample.log_time);
}

/// The computers reported to stamp a topic, in order.
fn computers(records: &[Record], topic: &str) -> Vec<String> {
    let label = |record: &&Record| match &record.sample.data {
        Data::Event(event) => event.label.strip_prefix(&format!("{topic} ")).map(str::to_owned),
        _ => None,
    };
    of(records, "/teampulse/stamped_by").iter().filter_map(label).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_several_computers_each_message_is_by_its_own_clock() {
    let topic = "/robot1/temperature";
    let records = watch::<Robots>(ROBOTS, async move |bus: Arc<MemoryBus>| {
        let other = bus.join("/robot1/second_driver");
        let first = publisher(&bus, topic, "sensor_msgs/msg/Temperature");
        let second = publisher(&other, topic, "sensor_msgs/msg/Temperature");
        subscribed(&*first).await;
        subscribed(&*second).await;
        for (publisher, secs) in [(&first, 1), (&first, 2), (&second, 3), (&first, 4)] {
            publisher.publish(&temperature(secs, 21.5)).expect("published");
        }
    })
    .await;
    let found = computers(&records, topic);
    assert_eq!(of(&records, topic).len(), 4);
    assert_eq!(found.len(), 3, "{found:?}");
    assert_eq!(found[0], found[2]);
    assert!(found[0].starts_with("/robot1/driver ("), "{found:?}");
    assert!(found[1].starts_with("/robot1/second_driver ("), "{found:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_definition_that_comes_late_lets_the_header_stamp_what_follows() {
    const HEADED: &str = "std_msgs/Header header\nfloat64 grip\n\
        ================================================================================\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\n\
        MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let records = watch::<Topics>(r#"names = ["/odd"]"#, async |bus: Arc<MemoryBus>| {
        let schema = Schema {
            name: "odd_msgs/msg/Grip".into(),
            encoding: "ros2msg".into(),
            text: HEADED.into(),
            hash: "RIHS01_07".into(),
        };
        let publisher = bus.publish("/odd", &schema, &Qos::reliable(10)).expect("a publisher");
        subscribed(&*publisher).await;
        for _ in 0..100 {
            publisher.publish(&temperature(100, 21.5)).expect("published");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    })
    .await;
    let last = of(&records, "/odd").last().expect("its messages").sample.source_time;
    assert_eq!(last, Some(Time::from_stamp(100, 5)));
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
    let labels = faults(&records);
    assert_eq!(
        labels.iter().filter(|label| label.contains("odd_msgs/msg/Odd")).count(),
        1,
        "{labels:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_types_on_one_topic_are_both_recorded_and_reported() {
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
    let labels = faults(&records);
    assert!(labels.iter().any(|label| label.contains("two types")), "{labels:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_publishers_of_one_topic_are_reported_once_by_name() {
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
    let labels = faults(&records);
    let several: Vec<_> = labels.iter().filter(|label| label.contains("published by")).collect();
    let [label] = several[..] else { panic!("{labels:?}") };
    assert!(label.starts_with(&format!("{topic}: published by two processes: ")), "{label}");
    assert!(label.contains("/robot1/driver") && label.contains("/robot1/second_driver"), "{label}");
}

/// Robots and people by their own sources, and everything by name.
fn all_of_them(context: &SourceContext) -> Vec<Box<dyn Source>> {
    vec![
        built::<Robots>("namespace = \"/*\"\ntopics = [\"**\"]", context),
        built::<RosPeople>("", context),
        built::<Topics>("names = [\"/**\"]", context),
        built::<Topics>("names = [\"/tf\", \"/robot1/**\"]", context),
    ]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_topic_is_one_subscription_whatever_order_it_is_found_in() {
    const TEMPERATURE: &str = "/robot1/motor/temperature";
    const ECG: &str = "/humans/persons/p001/strap/ecg";
    let topics = [
        (TEMPERATURE, "sensor_msgs/msg/Temperature"),
        (ECG, "teampulse_msgs/msg/Wave"),
        ("/robot1/other", "std_msgs/msg/String"),
        ("/tf", "tf2_msgs/msg/TFMessage"),
    ];
    for turned in [false, true] {
        let build = |context: &SourceContext| {
            let mut sources = all_of_them(context);
            if turned {
                sources.reverse();
            }
            sources
        };
        let records = watch_with(build, async |bus: Arc<MemoryBus>| {
            let of_session = publisher(&bus, "/session/events", "teampulse_msgs/msg/Event");
            let publishers = topics.map(|(topic, type_name)| publisher(&bus, topic, type_name));
            for each in &publishers {
                subscribed(&**each).await;
            }
            for secs in 0..20 {
                publishers[0].publish(&temperature(secs, 21.5)).expect("published");
            }
            // Whatever else would subscribe has had its turn.
            tokio::time::sleep(Duration::from_millis(100)).await;
            assert_eq!(of_session.subscribers(), 0, "the session itself hears that");
            for (publisher, (topic, _)) in publishers.iter().zip(topics) {
                assert_eq!(publisher.subscribers(), 1, "{topic}");
            }
        })
        .await;
        let kept = of(&records, TEMPERATURE);
        assert_eq!(kept.len(), 20);
        assert!(kept.iter().all(|record| record.stream.id == "robot1"), "{:?}", kept[0].stream);
        let about = |name: &str| {
            let mut described = records.iter().filter_map(|record| match &record.sample.data {
                Data::Description(stream) if stream.name == name => Some(stream.about),
                _ => None,
            });
            described.next_back()
        };
        assert_eq!([about(ECG), about("/tf")], [Some(About::Person), Some(About::Session)]);
    }
}
