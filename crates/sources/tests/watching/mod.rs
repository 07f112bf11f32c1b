//! A whole session with one source on an in-memory bus.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::Commands;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::qos::Qos;
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::stream::Schema;
use teampulse_core::streams::Streams;
use teampulse_messages::catalogue;
use teampulse_messages::convert::encode;
use teampulse_ros::bus::{Bus, Publisher};
use teampulse_ros::buses::Buses;
use teampulse_ros::memory::MemoryBus;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::bluetooth::Bluetooth;

use crate::keeper::Keeper;

/// Runs a session with these settings while `robots` runs; returns everything recorded.
pub async fn watch<S: Component<dyn Source, SourceContext>>(
    settings: &str,
    robots: impl AsyncFnOnce(Arc<MemoryBus>),
) -> Vec<Record> {
    watch_with(|context| vec![built::<S>(settings, context)], robots).await
}

/// The source with these settings.
pub fn built<S: Component<dyn Source, SourceContext>>(
    settings: &str,
    context: &SourceContext,
) -> Box<dyn Source> {
    let settings: S = toml::from_str(settings).expect("settings");
    settings.build(context).expect("a source")
}

/// Runs a session with several sources.
pub async fn watch_with(
    build: impl FnOnce(&SourceContext) -> Vec<Box<dyn Source>>,
    robots: impl AsyncFnOnce(Arc<MemoryBus>),
) -> Vec<Record> {
    let monitor = MemoryBus::new("/teampulse");
    let robot = monitor.join("/robot1/driver");
    let bus: Arc<dyn Bus> = monitor;
    let clock = Clock::host();
    let buses = Arc::new(Buses::holding([(0, bus)]));
    let context = SourceContext {
        clock: clock.clone(),
        buses,
        claims: Claims::default(),
        bluetooth: Bluetooth::default(),
    };
    let sources = build(&context).into_iter().map(|source| ("test".to_owned(), source)).collect();
    let kept = Arc::default();
    let session = Session {
        clock,
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources,
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(&kept)))],
        workers: Vec::new(),
        encode,
        commands: Commands::default(),
    };
    session.run(robots(robot)).await;
    std::mem::take(&mut *kept.lock().expect("nobody panicked"))
}

/// Waits until there is a subscription.
pub async fn subscribed(publisher: &dyn Publisher) {
    while publisher.subscribers() == 0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

/// A publisher of a topic.
pub fn publisher(bus: &MemoryBus, topic: &str, type_name: &str) -> Box<dyn Publisher> {
    let unknown = Schema {
        name: type_name.into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    let schema = catalogue::shipped(type_name).map_or(unknown, |shipped| (*shipped).clone());
    bus.publish(topic, &schema, &Qos::reliable(10)).expect("a publisher")
}

/// The records of a stream.
pub fn of<'a>(records: &'a [Record], name: &str) -> Vec<&'a Record> {
    records.iter().filter(|record| record.stream.name == name).collect()
}

/// The reported problems.
pub fn faults(records: &[Record]) -> Vec<String> {
    let label = |record: &Record| match &record.sample.data {
        Data::Event(event) if event.kind == EventKind::Fault => Some(event.label.clone()),
        _ => None,
    };
    of(records, "/session/events").into_iter().filter_map(label).collect()
}
