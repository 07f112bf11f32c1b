//! Very many robots that come, leave and come again, on a bus in memory.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::qos::Qos;
use teampulse_core::registry::Component;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_messages::catalogue;
use teampulse_messages::convert::encode;
use teampulse_ros::bus::{Bus, Publisher, Subscription};
use teampulse_ros::buses::Buses;
use teampulse_ros::clocks::serve_clock;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::robots::Robots;
use teampulse_sources::ros_people::RosPeople;
use teampulse_sources::topics::Topics;
use teampulse_sources::wearables::bluetooth::Bluetooth;

use crate::{cpu_secs, features};

/// The topics of a robot in standard types.
const STANDARD: [(&str, &str); 5] = [
    ("battery_state", "sensor_msgs/msg/BatteryState"),
    ("diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),
    ("motor/temperature", "sensor_msgs/msg/Temperature"),
    ("odom", "nav_msgs/msg/Odometry"),
    ("wifi", "wireless_msgs/msg/Connection"),
];
/// The number of other topics of a robot, each with a message.
const OTHERS: usize = 7;
/// A `std_msgs/Float64`.
const MESSAGE: &[u8] = &[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
/// How long remaining work may take.
const SETTLING: Duration = Duration::from_millis(100);

/// Makes this many robots come one by one, leave, and come again; prints the processor time for each of their endpoints
/// [us].
pub async fn run(robots: usize) -> Result<(), Box<dyn Error>> {
    let monitor = MemoryBus::new("/teampulse");
    let bus: Arc<dyn Bus> = Arc::clone(&monitor) as Arc<dyn Bus>;
    let clock = Clock::host();
    let buses = Arc::new(Buses::holding([(0, bus)]));
    let context = SourceContext {
        clock: clock.clone(),
        buses,
        claims: Claims::default(),
        bluetooth: Bluetooth::default(),
    };
    let sources = vec![
        source::<Robots>("namespace = \"/robot*\"\ntopics = [\"value_*\"]", &context)?,
        source::<RosPeople>(RosPeople::EXAMPLE, &context)?,
        source::<Topics>("names = [\"/tf\"]", &context)?,
    ];
    let session = Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources,
        features: features()?,
        sinks: Vec::new(),
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    let began_secs = cpu_secs();
    session.run(come_and_go(&monitor, robots)).await;
    let endpoints = robots * (STANDARD.len() + OTHERS);
    let each_us = (cpu_secs() - began_secs) * 1e6 / endpoints as f64;
    println!("{{\"endpoints\": {endpoints}, \"each_us\": {each_us:.1}}}");
    Ok(())
}

async fn come_and_go(monitor: &Arc<MemoryBus>, robots: usize) {
    for _ in 0..2 {
        let mut present = Vec::new();
        for number in 0..robots {
            present.push(Robot::come(monitor, number).await);
        }
        for robot in present {
            drop(robot);
            tokio::task::yield_now().await;
        }
        tokio::time::sleep(SETTLING).await;
    }
}

/// A robot that is present.
struct Robot {
    _publishers: Vec<Box<dyn Publisher>>,
    _clock: Option<Subscription>,
}

impl Robot {
    /// Appears, waits until it is subscribed to, and sends a message on each of its other topics.
    async fn come(monitor: &Arc<MemoryBus>, number: usize) -> Robot {
        let bus = monitor.join(&format!("/robot{number}/driver"));
        let standard = STANDARD.map(|(topic, type_name)| (topic.to_owned(), type_name));
        let others = (0..OTHERS).map(|each| (format!("value_{each}"), "std_msgs/msg/Float64"));
        let mut publishers = Vec::new();
        let mut graph = monitor.graph();
        for (topic, type_name) in standard.into_iter().chain(others) {
            let topic = format!("/robot{number}/{topic}");
            let schema = catalogue::shipped(type_name).expect("it is shipped");
            let publisher = bus.publish(&topic, &schema, &Qos::reliable(10)).expect("a publisher");
            let is_heard = |graph: &Arc<_>| is_subscribed(graph, &topic);
            graph.wait_for(is_heard).await.expect("the bus is there");
            if type_name == "std_msgs/msg/Float64" {
                publisher.publish(&Bytes::from_static(MESSAGE)).expect("published");
            }
            publishers.push(publisher);
        }
        let clock = serve_clock(&*bus, Arc::new(teampulse_core::clock::wall));
        Robot { _publishers: publishers, _clock: clock.ok() }
    }
}

fn is_subscribed(graph: &teampulse_ros::graph::Graph, topic: &str) -> bool {
    graph.endpoints_of(topic).any(|each| each.own)
}

fn source<S: Component<dyn Source, SourceContext>>(
    settings: &str,
    context: &SourceContext,
) -> Result<(String, Box<dyn Source>), Box<dyn Error>> {
    let settings: S = toml::from_str(settings)?;
    Ok(("bench".to_owned(), settings.build(context)?))
}
