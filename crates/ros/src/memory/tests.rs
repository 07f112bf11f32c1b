use std::sync::Mutex;

use super::*;
use crate::bus::Arrival;

type Heard = Arc<Mutex<Vec<Arrival>>>;

fn listen(bus: &MemoryBus, asked: Asked) -> (Subscription, Heard) {
    let heard = Heard::default();
    let kept = Arc::clone(&heard);
    let deliver: Deliver = Arc::new(move |arrival| kept.lock().unwrap().push(arrival));
    (bus.subscribe("/r1/x", "a/msg/X", asked, deliver).unwrap(), heard)
}

fn speak(bus: &MemoryBus, type_name: &str, qos: &Qos) -> Box<dyn Publisher> {
    let schema = Schema {
        name: type_name.into(),
        encoding: "ros2msg".into(),
        text: "uint8 x".into(),
        hash: "RIHS01_00".into(),
    };
    bus.publish("/r1/x", &schema, qos).unwrap()
}

fn numbers(heard: &Heard) -> Vec<u64> {
    heard.lock().unwrap().iter().map(|each| each.sequence.unwrap()).collect()
}

const ADAPTIVE: Asked = Asked::Adaptive { depth: 100 };

#[test]
fn messages_arrive_numbered_in_order_and_byte_for_byte() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let (_subscription, heard) = listen(&monitor, ADAPTIVE);
    let publisher = speak(&robot, "a/msg/X", &Qos::reliable(10));
    for k in 0..3 {
        publisher.publish(&[0, 1, 0, 0, k]).unwrap();
    }
    assert_eq!(numbers(&heard), [1, 2, 3]);
    assert_eq!(&heard.lock().unwrap()[2].bytes[..], &[0, 1, 0, 0, 2]);
    assert_eq!(publisher.subscribers(), 1);
}

#[test]
fn a_dropped_subscription_hears_no_more() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let publisher = speak(&robot, "a/msg/X", &Qos::reliable(10));
    let (subscription, heard) = listen(&monitor, ADAPTIVE);
    drop(subscription);
    publisher.publish(&[0, 1, 0, 0]).unwrap();
    assert!(heard.lock().unwrap().is_empty());
}

#[test]
fn a_late_joiner_is_given_what_is_transient_local_and_no_more() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let publisher = speak(&robot, "a/msg/X", &Qos::latched(2));
    for _ in 0..5 {
        publisher.publish(&[0, 1, 0, 0]).unwrap();
    }
    let (_adaptive, heard) = listen(&monitor, ADAPTIVE);
    let (_volatile, nothing) = listen(&monitor, Asked::Exactly(Qos::reliable(1)));
    assert_eq!(numbers(&heard), [4, 5]);
    assert!(numbers(&nothing).is_empty());
}

#[test]
fn what_is_incompatible_does_not_flow_and_both_sides_are_reported() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let (mut at_robot, mut at_monitor) = (robot.incidents(), monitor.incidents());
    let publisher = speak(&robot, "a/msg/X", &Qos::best_effort(10));
    let (_subscription, heard) = listen(&monitor, Asked::Exactly(Qos::reliable(1)));
    publisher.publish(&[0, 1, 0, 0]).unwrap();
    assert!(numbers(&heard).is_empty());
    let incident = |ours| Incident::IncompatibleQos {
        topic: "/r1/x".into(),
        policy: "reliability".into(),
        ours,
    };
    assert_eq!(at_monitor.try_recv(), Ok(incident(true)));
    assert_eq!(at_robot.try_recv(), Ok(incident(false)));
}

#[test]
fn an_adaptive_subscription_hears_whatever_is_offered() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let (_subscription, heard) = listen(&monitor, ADAPTIVE);
    for qos in [Qos::latched(1), Qos::reliable(1), Qos::best_effort(1)] {
        speak(&robot, "a/msg/X", &qos).publish(&[0, 1, 0, 0]).unwrap();
    }
    assert_eq!(heard.lock().unwrap().len(), 3);
}

#[test]
fn nobody_hears_itself() {
    let bus = MemoryBus::new("/teampulse");
    let (_subscription, heard) = listen(&bus, ADAPTIVE);
    speak(&bus, "a/msg/X", &Qos::reliable(1)).publish(&[0, 1, 0, 0]).unwrap();
    assert!(numbers(&heard).is_empty());
}

#[test]
fn the_graph_is_always_the_newest_and_knows_what_is_ours() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let graph = monitor.graph();
    let publisher = speak(&robot, "a/msg/X", &Qos::reliable(10));
    let (_subscription, _heard) = listen(&monitor, ADAPTIVE);
    let now = Arc::clone(&graph.borrow());
    assert!(now.nodes().eq(["/r1/driver", "/teampulse"]));
    let offered: Vec<_> = now.publishers("/r1/x").collect();
    assert_eq!(offered.len(), 1);
    assert_eq!(offered[0].node.as_deref(), Some("/r1/driver"));
    assert_eq!((offered[0].own, &*offered[0].type_hash), (false, "RIHS01_00"));
    assert!(now.endpoints().any(|endpoint| endpoint.own));
    drop(publisher);
    assert_eq!(graph.borrow().publishers("/r1/x").count(), 0);
    drop(robot);
    assert!(graph.borrow().nodes().eq(["/teampulse"]));
}

#[test]
fn a_second_type_on_a_topic_is_reported() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let mut incidents = monitor.incidents();
    let _one = speak(&robot, "b/msg/Y", &Qos::reliable(1));
    let _same = speak(&robot, "b/msg/Y", &Qos::reliable(1));
    assert!(incidents.try_recv().is_err());
    let _other = speak(&robot, "a/msg/X", &Qos::reliable(1));
    let types = vec!["a/msg/X".to_owned(), "b/msg/Y".to_owned()];
    let topic = "/r1/x".to_owned();
    assert_eq!(incidents.try_recv(), Ok(Incident::TwoTypes { topic, types }));
}

#[tokio::test]
async fn a_definition_is_reported_by_a_publisher() {
    let robot = MemoryBus::new("/r1/driver");
    let monitor = robot.join("/teampulse");
    let _publisher = speak(&robot, "a/msg/X", &Qos::reliable(1));
    let found = monitor.definition("a/msg/X", "RIHS01_00").await.unwrap();
    assert_eq!(found.text, "uint8 x");
    assert!(monitor.definition("a/msg/X", "RIHS01_11").await.is_err());
    assert!(monitor.definition("a/msg/Y", "").await.is_err());
}
