//! Two participants of one domain, over the loopback interface.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::qos::Qos;
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;
use teampulse_messages::catalogue;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, Parameter, ParameterValue, SetParametersAtomicallyRequest,
    SetParametersAtomicallyResponse, SetParametersRequest, SetParametersResponse,
};
use teampulse_messages::standard::rmw_dds_common::GidWidth;
use teampulse_ros::bus::{Arrival, Asked, Bus, Deliver, Incident, Publisher, Reply, Subscription};
use teampulse_ros::cyclone::{CycloneBus, Participation};
use teampulse_ros::graph::{EndpointKind, Graph};
use tokio::sync::broadcast;

const HASH: &str = "RIHS01_0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
const ADAPTIVE: Asked = Asked::Adaptive { depth: 1000 };

/// Joins a domain as if in a process of its own: messages between two of these go over the network.
fn join(domain: u32, process: u32, node_name: &str) -> Arc<dyn Bus> {
    CycloneBus::join(participation(domain, process, node_name)).unwrap()
}

fn participation(domain: u32, process: u32, node_name: &str) -> Participation {
    let configuration = format!(
        "<CycloneDDS><Domain id=\"any\"><General><AllowMulticast>false</AllowMulticast><Interfaces>\
         <NetworkInterface address=\"127.0.0.1\"/></Interfaces></General><Discovery>\
         <ExternalDomainId>{domain}</ExternalDomainId><ParticipantIndex>auto</ParticipantIndex>\
         <Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>"
    );
    Participation {
        domain: domain + 1000 * process,
        namespace: "/".into(),
        node_name: node_name.into(),
        configuration,
        gid_width: None,
        prefixes: Vec::new(),
    }
}

fn pair(domain: u32) -> (Arc<dyn Bus>, Arc<dyn Bus>) {
    (join(domain, 1, "robot"), join(domain, 2, "monitor"))
}

fn schema() -> Schema {
    Schema {
        name: "demo_msgs/msg/Blob".into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: HASH.into(),
    }
}

fn speak(bus: &Arc<dyn Bus>, topic: &str, qos: &Qos) -> Box<dyn Publisher> {
    bus.publish(topic, &schema(), qos).unwrap()
}

type Heard = Arc<Mutex<Vec<Arrival>>>;

fn listen(bus: &Arc<dyn Bus>, topic: &str, asked: Asked) -> (Subscription, Heard) {
    let heard = Heard::default();
    let kept = Arc::clone(&heard);
    let deliver: Deliver = Arc::new(move |arrival| kept.lock().unwrap().push(arrival));
    (bus.subscribe(topic, "demo_msgs/msg/Blob", asked, deliver).unwrap(), heard)
}

fn message(number: u8, bytes: usize) -> Vec<u8> {
    let mut cdr = vec![number; 4 + bytes];
    cdr[..4].copy_from_slice(&[0, 1, 0, 0]);
    cdr
}

/// Waits until a condition holds; fails if it takes too long.
fn until(what: &str, so: impl Fn() -> bool) {
    for _ in 0..1000 {
        if so() {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("{what}: not within ten seconds");
}

fn until_graph(bus: &Arc<dyn Bus>, what: &str, so: impl Fn(&Graph) -> bool) {
    let graph = bus.graph();
    until(what, || so(&graph.borrow()));
}

/// Waits until a subscription has adapted to the offers and is matched.
fn until_matched(publisher: &dyn Publisher) {
    until("a match", || publisher.subscribers() > 0);
    std::thread::sleep(Duration::from_millis(300));
}

fn numbers(heard: &Heard) -> Vec<u64> {
    heard.lock().unwrap().iter().map(|each| each.sequence.unwrap()).collect()
}

#[test]
fn messages_arrive_byte_for_byte_with_consecutive_numbers() {
    let (robot, monitor) = pair(101);
    let (_subscription, heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    let publisher = speak(&robot, "/r1/x", &Qos::reliable(1000));
    until_matched(&*publisher);
    for k in 0..100 {
        publisher.publish(&message(k, 8)).unwrap();
    }
    until("a hundred messages", || heard.lock().unwrap().len() >= 100);
    assert_eq!(numbers(&heard), (1..=100).collect::<Vec<u64>>());
    let last = heard.lock().unwrap()[99].clone();
    assert_eq!(&last.bytes[..], &message(99, 8)[..]);
    assert!(last.source_time.is_some());
    let graph = monitor.graph();
    let gid = graph.borrow().publishers("/r1/x").next().unwrap().gid;
    assert_eq!(last.publisher, gid);
}

#[test]
fn both_sides_see_each_other_with_nodes_types_hashes_and_qos() {
    let (robot, monitor) = pair(102);
    let publisher = speak(&robot, "/r1/x", &Qos::latched(5));
    let (_subscription, _heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    until_graph(&monitor, "the publisher and its node", |graph| {
        graph.publishers("/r1/x").any(|each| each.node.as_deref() == Some("/robot"))
            && graph.nodes().eq(["/monitor", "/robot"])
    });
    let graph = Arc::clone(&monitor.graph().borrow());
    let offered = graph.publishers("/r1/x").next().unwrap();
    assert_eq!((&*offered.type_name, &*offered.type_hash), ("demo_msgs/msg/Blob", HASH));
    assert_eq!((&offered.qos, offered.own), (&Qos::latched(5), false));
    until_graph(&robot, "the subscription and its node", |graph| {
        graph.endpoints().any(|each| {
            each.kind == EndpointKind::Subscription
                && each.node.as_deref() == Some("/monitor")
                && each.type_hash == HASH
        })
    });
    drop(publisher);
    until_graph(&monitor, "the end of the publisher", |graph| {
        graph.publishers("/r1/x").count() == 0
    });
    drop(robot);
    until_graph(&monitor, "the end of the node", |graph| graph.nodes().eq(["/monitor"]));
}

#[test]
fn a_late_joiner_is_given_what_is_transient_local() {
    let (robot, monitor) = pair(103);
    let publisher = speak(&robot, "/r1/map", &Qos::latched(3));
    for k in 0..5 {
        publisher.publish(&message(k, 4)).unwrap();
    }
    let (_subscription, heard) = listen(&monitor, "/r1/map", ADAPTIVE);
    until("three messages", || heard.lock().unwrap().len() >= 3);
    publisher.publish(&message(5, 4)).unwrap();
    until("one more", || heard.lock().unwrap().len() >= 4);
    std::thread::sleep(Duration::from_millis(2500));
    assert_eq!(numbers(&heard), [3, 4, 5, 6], "nothing comes twice, even after the overlap");
}

#[test]
fn an_adaptive_subscription_follows_what_is_offered() {
    let (robot, monitor) = pair(104);
    let (_subscription, heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    let mut incidents = monitor.incidents();
    let reliable = speak(&robot, "/r1/x", &Qos::reliable(100));
    until_matched(&*reliable);
    let best_effort = speak(&robot, "/r1/x", &Qos::best_effort(100));
    until_matched(&*best_effort);
    for k in 0..10 {
        reliable.publish(&message(k, 4)).unwrap();
        best_effort.publish(&message(k, 4)).unwrap();
    }
    until("both publishers' messages", || heard.lock().unwrap().len() >= 20);
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(heard.lock().unwrap().len(), 20, "none comes twice");
    assert!(incidents.try_recv().is_err(), "adapting is no incident");
}

#[test]
fn nothing_is_lost_or_heard_twice_while_a_subscription_adapts() {
    let (robot, monitor) = pair(115);
    let (_subscription, heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    let steady = speak(&robot, "/r1/x", &Qos::reliable(1000));
    until_matched(&*steady);
    let say_hundred = || {
        for k in 0..100 {
            steady.publish(&message(k, 4)).unwrap();
            std::thread::sleep(Duration::from_millis(2));
        }
    };
    say_hundred();
    for qos in [Qos::best_effort(1), Qos::latched(1), Qos::best_effort(1)] {
        let _passing = speak(&robot, "/r1/x", &qos);
        say_hundred();
    }
    say_hundred();
    until("five hundred messages", || heard.lock().unwrap().len() >= 500);
    let mut numbers = numbers(&heard);
    numbers.sort_unstable();
    assert_eq!(numbers, (1..=500).collect::<Vec<u64>>());
}

#[test]
fn large_messages_arrive_whole() {
    let (robot, monitor) = pair(105);
    let (_subscription, heard) = listen(&monitor, "/r1/camera", ADAPTIVE);
    let publisher = speak(&robot, "/r1/camera", &Qos::reliable(10));
    until_matched(&*publisher);
    for k in 0..5 {
        publisher.publish(&message(k, 1 << 20)).unwrap();
    }
    until("five images", || heard.lock().unwrap().len() >= 5);
    let heard = heard.lock().unwrap();
    for (k, arrival) in heard.iter().enumerate() {
        assert!(arrival.bytes == message(k as u8, 1 << 20), "image {k}");
        assert_eq!(arrival.sequence, Some(k as u64 + 1));
    }
}

#[test]
fn incompatible_qos_is_reported_on_both_sides() {
    let (robot, monitor) = pair(106);
    let (mut at_robot, mut at_monitor) = (robot.incidents(), monitor.incidents());
    let _publisher = speak(&robot, "/r1/x", &Qos::best_effort(1));
    let (_subscription, _heard) = listen(&monitor, "/r1/x", Asked::Exactly(Qos::reliable(1)));
    for (incidents, ours) in [(&mut at_monitor, true), (&mut at_robot, false)] {
        let (topic, policy) = ("/r1/x".to_owned(), "reliability".to_owned());
        let expected = Incident::IncompatibleQos { topic, policy, ours };
        assert_eq!(next(incidents), expected);
    }
}

/// The next incident; fails if it takes too long.
fn next(incidents: &mut broadcast::Receiver<Incident>) -> Incident {
    for _ in 0..1000 {
        if let Ok(incident) = incidents.try_recv() {
            return incident;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("no incident within ten seconds");
}

#[test]
fn a_missed_deadline_and_a_second_type_are_reported() {
    let (robot, monitor) = pair(107);
    let mut incidents = monitor.incidents();
    let (_subscription, _heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    let promised = Qos { deadline: Some(Duration::from_millis(200)), ..Qos::reliable(10) };
    let publisher = speak(&robot, "/r1/x", &promised);
    until_matched(&*publisher);
    publisher.publish(&message(1, 4)).unwrap();
    let other = Schema { name: "demo_msgs/msg/Other".into(), ..schema() };
    let _second = robot.publish("/r1/x", &other, &Qos::reliable(1)).unwrap();
    let (mut missed, mut two_types) = (false, false);
    for _ in 0..1000 {
        match incidents.try_recv() {
            Ok(Incident::DeadlineMissed { topic, total }) => missed = topic == "/r1/x" && total > 0,
            Ok(Incident::TwoTypes { types, .. }) => {
                two_types = types == ["demo_msgs/msg/Blob", "demo_msgs/msg/Other"];
            }
            _ if missed && two_types => return,
            _ => std::thread::sleep(Duration::from_millis(10)),
        }
    }
    panic!("missed deadline: {missed}, two types: {two_types}");
}

#[test]
fn nobody_hears_itself_but_neighbours_in_one_process_hear_each_other() {
    let one = join(108, 1, "one");
    let other = join(108, 1, "other");
    let (_own, by_itself) = listen(&one, "/r1/x", ADAPTIVE);
    let (_foreign, by_other) = listen(&other, "/r1/x", ADAPTIVE);
    let publisher = speak(&one, "/r1/x", &Qos::reliable(10));
    until_matched(&*publisher);
    for k in 0..3 {
        publisher.publish(&message(k, 5)).unwrap();
    }
    until("three messages", || by_other.lock().unwrap().len() >= 3);
    assert_eq!(numbers(&by_other), [1, 2, 3]);
    assert!(by_itself.lock().unwrap().is_empty());
}

#[test]
fn a_domain_can_be_left_and_joined_again() {
    for _ in 0..3 {
        let (robot, monitor) = pair(109);
        until_graph(&monitor, "the other's node", |graph| graph.nodes().count() == 2);
        drop((robot, monitor));
    }
}

#[tokio::test]
async fn a_definition_that_is_not_found_says_what_was_tried() {
    let (robot, monitor) = pair(111);
    let _publisher = speak(&robot, "/r1/x", &Qos::reliable(1));
    until_graph(&monitor, "the publisher and its node", |graph| {
        graph.publishers("/r1/x").any(|each| each.node.is_some())
    });
    let error = monitor.definition("demo_msgs/msg/Blob", HASH).await.unwrap_err();
    assert_eq!(
        error.to_string(),
        "find the definition of demo_msgs/msg/Blob: /robot was asked: it says: demo_msgs/msg/Blob \
         is not known here; in the installed ROS: demo_msgs/msg/Blob is missing; \
         it is not shipped with teampulse"
    );
}

#[test]
fn nodes_see_each_other_whatever_the_width_of_their_ids() {
    let humble =
        Participation { gid_width: Some(GidWidth::Humble), ..participation(112, 1, "humble") };
    let (humble, either) = (CycloneBus::join(humble).unwrap(), join(112, 2, "either"));
    for bus in [&humble, &either] {
        until_graph(bus, "both nodes", |graph| graph.nodes().eq(["/either", "/humble"]));
    }
}

#[test]
fn a_domain_that_cannot_be_joined_says_why() {
    let absurd = Participation {
        configuration:
            "<General><Interfaces><NetworkInterface name=\"none7\"/></Interfaces></General>".into(),
        ..participation(113, 1, "nobody")
    };
    let error = CycloneBus::join(absurd).err().unwrap().to_string();
    assert!(error.starts_with("join ROS domain 1113: ") && error.contains("none7"), "{error}");
}

#[test]
fn what_is_no_cdr_is_refused_and_short_messages_pass() {
    let (robot, monitor) = pair(114);
    let (_subscription, heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    let publisher = speak(&robot, "/r1/x", &Qos::reliable(10));
    until_matched(&*publisher);
    assert!(publisher.publish(&[]).is_err() && publisher.publish(&[0, 1, 0]).is_err());
    publisher.publish(&message(0, 0)).unwrap();
    publisher.publish(&message(1, 1)).unwrap();
    until("two messages", || heard.lock().unwrap().len() >= 2);
    assert_eq!(numbers(&heard), [1, 2]);
    assert_eq!(&heard.lock().unwrap()[1].bytes[..], [0, 1, 0, 0, 1, 0, 0, 0], "whole words");
}

#[test]
fn a_message_may_be_stamped_by_another_clock() {
    let (robot, monitor) = pair(117);
    let publisher = speak(&robot, "/r1/x", &Qos::reliable(10));
    let (_subscription, heard) = listen(&monitor, "/r1/x", ADAPTIVE);
    until_matched(&*publisher);
    let stamp = Time::from_stamp(1_234_567_890, 5);
    publisher.publish_at(&message(1, 8), stamp).unwrap();
    until("the message", || !heard.lock().unwrap().is_empty());
    assert_eq!(heard.lock().unwrap()[0].source_time, Some(stamp));
}

#[test]
fn a_service_answers_whoever_asks_and_gives_who_answered() {
    let (robot, monitor) = pair(118);
    let type_name = "teampulse_msgs/srv/ProbeClock";
    let answer = |request: &[u8]| Some(Bytes::from([request, &[7]].concat()));
    let _service = robot.serve("/robot/probe_clock", type_name, Arc::new(answer)).unwrap();
    let offered =
        |graph: &Graph| graph.services().find(|each| each.type_name == type_name).cloned();
    until_graph(&monitor, "the service", |graph| offered(graph).is_some());
    let graph = Arc::clone(&monitor.graph().borrow());
    let service = offered(&graph).unwrap();
    assert_eq!((&*service.name, service.own), ("/robot/probe_clock", false));
    let replies = Arc::<Mutex<Vec<Reply>>>::default();
    let kept = Arc::clone(&replies);
    let hear = Arc::new(move |reply| kept.lock().unwrap().push(reply));
    let client = monitor.client(&service.name, type_name, hear).unwrap();
    until("a reply", || {
        client.ask(5, &message(1, 8)).unwrap();
        !replies.lock().unwrap().is_empty()
    });
    let reply = replies.lock().unwrap()[0].clone();
    // The network pads what it carries.
    assert_eq!((reply.number, &reply.bytes[..13]), (5, &[&message(1, 8)[..], &[7]].concat()[..]));
    assert_eq!(reply.server.participant(), service.gid.participant());
    // The host and the process of whoever runs this test, and the participant.
    let computer = graph.computer(reply.server);
    assert!(computer.ends_with(&format!(", {})", reply.server.participant())), "{computer}");
}

/// Calls a service of the other node until it answers; returns the plain CDR of the reply.
fn asked<Request: Message>(
    monitor: &Arc<dyn Bus>,
    service: &str,
    type_name: &str,
    request: &Request,
) -> Bytes {
    let (answers, replies) = std::sync::mpsc::sync_channel(1);
    let hear = Arc::new(move |reply: Reply| drop(answers.try_send(reply.bytes)));
    let client = monitor.client(service, type_name, hear).unwrap();
    loop {
        client.ask(1, &request.encode()).unwrap();
        if let Ok(reply) = replies.recv_timeout(Duration::from_millis(100)) {
            return reply;
        }
    }
}

#[test]
fn the_parameters_of_a_node_are_reported_as_by_any_other() {
    let (robot, monitor) = pair(119);
    let ask = |service: &str| format!("/robot/{service}");
    let kind = |service: &str| format!("rcl_interfaces/srv/{service}");
    let names = vec!["use_sim_time".to_owned()];

    let list = ListParametersRequest::default();
    let listed = asked(&monitor, &ask("list_parameters"), &kind("ListParameters"), &list);
    let listed = ListParametersResponse::decode(&listed).unwrap().result.names;
    assert_eq!(listed, ["start_type_description_service", "use_sim_time"]);

    let get = GetParametersRequest { names: names.clone() };
    let reported = || {
        let reply = asked(&monitor, &ask("get_parameters"), &kind("GetParameters"), &get);
        GetParametersResponse::decode(&reply).unwrap().values
    };
    assert_eq!(reported(), [ParameterValue::bool(false)]);
    let deliver: Deliver = Arc::new(|_| {});
    let _clock = robot.subscribe("/clock", "rosgraph_msgs/msg/Clock", ADAPTIVE, deliver).unwrap();
    until("the clock is followed", || reported() == [ParameterValue::bool(true)]);

    let types = GetParameterTypesRequest { names: names.clone() };
    let types = asked(&monitor, &ask("get_parameter_types"), &kind("GetParameterTypes"), &types);
    assert_eq!(GetParameterTypesResponse::decode(&types).unwrap().types, [ParameterValue::BOOL]);

    let describe = DescribeParametersRequest { names };
    let described =
        asked(&monitor, &ask("describe_parameters"), &kind("DescribeParameters"), &describe);
    let described = DescribeParametersResponse::decode(&described).unwrap().descriptors;
    assert!(described[0].read_only && described[0].r#type == ParameterValue::BOOL);

    let parameters = vec![Parameter { name: "use_sim_time".into(), ..Parameter::default() }];
    let set = SetParametersRequest { parameters: parameters.clone() };
    let results = asked(&monitor, &ask("set_parameters"), &kind("SetParameters"), &set);
    assert!(!SetParametersResponse::decode(&results).unwrap().results[0].successful);
    let set = SetParametersAtomicallyRequest { parameters };
    let service = ask("set_parameters_atomically");
    let result = asked(&monitor, &service, &kind("SetParametersAtomically"), &set);
    assert!(!SetParametersAtomicallyResponse::decode(&result).unwrap().result.successful);
}

#[test]
fn a_reader_gives_the_hash_of_its_type_before_anything_is_published() {
    let (robot, monitor) = pair(120);
    let deliver: Deliver = Arc::new(|_| {});
    let events = [
        ("/session/events", "teampulse_msgs/msg/Event"),
        ("/session/events", "std_msgs/msg/String"),
        ("/clock", "rosgraph_msgs/msg/Clock"),
    ];
    let subscribe = |(topic, type_name): (&str, &str)| {
        monitor.subscribe(topic, type_name, ADAPTIVE, Arc::clone(&deliver)).unwrap()
    };
    let _subscriptions: Vec<Subscription> = events.into_iter().map(subscribe).collect();
    until_graph(&robot, "all readers with their hashes", |graph| {
        events.iter().all(|(topic, type_name)| {
            let hash = &catalogue::shipped(type_name).unwrap().hash;
            graph.endpoints().any(|each| {
                each.topic == *topic
                    && each.type_name == *type_name
                    && each.kind == EndpointKind::Subscription
                    && each.type_hash == *hash
            })
        })
    });
}
