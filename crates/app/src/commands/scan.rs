//! `teampulse scan`: lists what is in range.

mod bluetooth;
mod cameras;
mod inputs;
mod lsl;
mod microphones;
mod serial;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use teampulse_core::counted::counted;
use teampulse_ros::BusId;
use teampulse_ros::bus::{Asked, Bus, Subscription};
use teampulse_ros::buses::Buses;
use teampulse_ros::graph::EndpointKind;
use teampulse_sources::hri;
use teampulse_sources::lsl::resolve;
use teampulse_sources::robots::norm_of_type;
use teampulse_sources::ros_people::{NAMESPACE, RosPeople};
use teampulse_sources::wearables::bluetooth::Bluetooth;

use self::bluetooth::Device;
use self::cameras::Camera;
use self::inputs::Input;
use self::lsl::LslStream;
use self::microphones::Microphone;
use self::serial::Port;
use crate::commands::run::seconds;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::machine;
use crate::network;
use crate::output::{self, say};

/// How often the ROS graph is read during a scan.
const LOOK: Duration = Duration::from_millis(100);
/// The queue length of a counting subscription [messages].
const DEPTH: u32 = 100;

/// Shows what is in range, with the lines of a study to paste.
#[derive(Debug, Args)]
pub struct Scan {
    /// How long to listen
    #[arg(long, value_name = "SECS", default_value = "4", value_parser = seconds)]
    seconds: f64,
    /// The ROS domains to scan, and other buses as KIND:ADDRESS; by default the domain of `ROS_DOMAIN_ID`, else 0
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    domains: Vec<BusId>,
    /// Prints one JSON array with an entry for each domain, and entries for Bluetooth, serial ports, cameras,
    /// microphones, input devices and LSL if any are found
    #[arg(long)]
    json: bool,
}

/// The results from one place.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Place {
    /// Nodes and topics on a ROS domain.
    Domain(Domain),
    /// Wearables in Bluetooth range.
    Bluetooth {
        #[serde(rename = "bluetooth")]
        devices: Vec<Device>,
    },
    /// Serial ports with a device attached.
    Serial {
        #[serde(rename = "serial_ports")]
        ports: Vec<Port>,
    },
    /// Cameras of this computer.
    Cameras { cameras: Vec<Camera> },
    /// Microphones of this computer.
    Microphones { microphones: Vec<Microphone> },
    /// Keyboards, mice and gamepads.
    Inputs { inputs: Vec<Input> },
    /// Streams of Lab Streaming Layer.
    Lsl {
        #[serde(rename = "lsl")]
        streams: Vec<LslStream>,
    },
}

/// The nodes and topics of a domain.
#[derive(Debug, Serialize)]
struct Domain {
    #[serde(rename = "domain")]
    id: BusId,
    nodes: Vec<String>,
    topics: Vec<Topic>,
}

/// A topic and its data rate.
#[derive(Debug, Serialize)]
struct Topic {
    name: String,
    #[serde(rename = "type")]
    type_name: String,
    rate_hz: f64,
    kb_per_sec: f64,
}

impl Scan {
    /// Runs the command.
    pub async fn run(self) -> Result<Exit, Failure> {
        let buses = network::buses("teampulse_scan");
        let ids = if self.domains.is_empty() {
            vec![network::default_bus(&buses)?]
        } else {
            self.domains.clone()
        };
        let bluetooth = Bluetooth::default();
        let within = Duration::from_secs_f64(self.seconds);
        let (in_range, resolving) = (bluetooth.in_range(within), resolve("", &[], within));
        let (domains, in_range, streams) =
            tokio::join!(self.domains(&buses, ids), in_range, resolving);
        let domains = domains?;
        let streams: Vec<LslStream> = match streams {
            Ok(found) => found.iter().map(LslStream::of).collect(),
            Err(error) => {
                say(format!("no LSL: failed to search for streams: {error}"));
                Vec::new()
            }
        };
        let devices = match in_range {
            Ok(seen) => Some(seen.iter().filter_map(Device::of).collect::<Vec<_>>()),
            Err(error) => {
                say(format!("no Bluetooth: failed to {error}\n hint: {}", error.hint()));
                None
            }
        };
        let microphones = Microphone::all().await;
        let (ports, cameras, inputs) = (Port::all(), Camera::all(), Input::all());
        if self.json {
            let devices = devices.filter(|devices| !devices.is_empty());
            let places = domains.into_iter().map(Place::Domain);
            let places = places.chain(devices.map(|devices| Place::Bluetooth { devices }));
            let ports = Some(ports).filter(|ports| !ports.is_empty());
            let places = places.chain(ports.map(|ports| Place::Serial { ports }));
            let cameras = (!cameras.is_empty()).then_some(Place::Cameras { cameras });
            let inputs = (!inputs.is_empty()).then_some(Place::Inputs { inputs });
            let microphones =
                (!microphones.is_empty()).then_some(Place::Microphones { microphones });
            let places = places.chain(cameras).chain(microphones).chain(inputs);
            let streams = (!streams.is_empty()).then_some(Place::Lsl { streams });
            output::json(&places.chain(streams).collect::<Vec<_>>());
        } else {
            domains.iter().for_each(show);
            if let Some(devices) = &devices {
                bluetooth::show(devices);
            }
            serial::show(&ports, 1 + devices.map_or(0, |devices| devices.len()));
            cameras::show(&cameras);
            microphones::show(&microphones);
            inputs::show(&inputs);
            lsl::show(&streams);
            output::lines(machine::check(".".as_ref()));
        }
        Ok(Exit::Fine)
    }

    /// Finds what is in range on each domain.
    async fn domains(&self, buses: &Buses, ids: Vec<BusId>) -> Result<Vec<Domain>, Failure> {
        let mut domains = Vec::new();
        for id in ids {
            let bus = buses.get(&id)?;
            domains.push(listen(id, &*bus, self.seconds).await);
        }
        Ok(domains)
    }
}

/// The messages and bytes counted on a topic.
#[derive(Debug, Default)]
struct Count {
    messages: AtomicU64,
    bytes: AtomicU64,
}

async fn listen(id: BusId, bus: &dyn Bus, duration_secs: f64) -> Domain {
    let mut counting: BTreeMap<(String, String), (Arc<Count>, Option<Subscription>)> =
        BTreeMap::new();
    let looks = (duration_secs / LOOK.as_secs_f64()).ceil() as u32;
    for _ in 0..looks {
        // A copy: the bus must be able to change its graph during the subscription.
        let graph = Arc::clone(&bus.graph().borrow());
        for endpoint in graph.endpoints() {
            let key = (endpoint.topic.clone(), endpoint.type_name.clone());
            if endpoint.kind == EndpointKind::Publisher && !endpoint.own {
                counting.entry(key).or_insert_with_key(|key| count(bus, &key.0, &key.1));
            }
        }
        tokio::time::sleep(LOOK).await;
    }
    let own = bus.node();
    let nodes =
        bus.graph().borrow().nodes().filter(|node| *node != own).map(str::to_owned).collect();
    let topic = |((name, type_name), (count, _)): ((String, String), (Arc<Count>, _))| Topic {
        name,
        type_name,
        rate_hz: count.messages.load(Ordering::Relaxed) as f64 / duration_secs,
        kb_per_sec: count.bytes.load(Ordering::Relaxed) as f64 / duration_secs / 1e3,
    };
    Domain { id, nodes, topics: counting.into_iter().map(topic).collect() }
}

fn count(bus: &dyn Bus, topic: &str, type_name: &str) -> (Arc<Count>, Option<Subscription>) {
    let count = Arc::new(Count::default());
    let counted = Arc::clone(&count);
    let deliver = Arc::new(move |arrival: teampulse_ros::bus::Arrival| {
        counted.messages.fetch_add(1, Ordering::Relaxed);
        counted.bytes.fetch_add(arrival.bytes.len() as u64, Ordering::Relaxed);
    });
    let subscribed = bus.subscribe(topic, type_name, Asked::Adaptive { depth: DEPTH }, deliver);
    (count, subscribed.ok())
}

fn show(found: &Domain) {
    let (nodes, topics) = (found.nodes.len(), found.topics.len());
    let nodes = counted(nodes, "node", "nodes");
    output::line(format!("{}: {nodes}, {}", found.id, counted(topics, "topic", "topics")));
    for topic in &found.topics {
        output::line(format!(
            "  {:<38} {:<36} {:>7.1} Hz {:>9.1} kB/s",
            topic.name, topic.type_name, topic.rate_hz, topic.kb_per_sec
        ));
    }
    let robots = robots(found).into_iter().map(|namespace| ("robots", namespace));
    let people = has_people(found).then(|| ("people", NAMESPACE.to_owned()));
    let mut sources = robots.chain(people).peekable();
    let are_seen = found.topics.iter().any(|topic| hri::sees(&topic.name, &topic.type_name));
    if are_seen || sources.peek().is_some() {
        output::line("\nlines for a study:");
    }
    for (kind, namespace) in sources {
        output::line(format!("[[sources]]\ntype      = \"{kind}\""));
        output::line(format!("namespace = \"{namespace}\"\ndomain    = {}\n", found.id.in_study()));
    }
    if are_seen {
        let domain = found.id.in_study();
        output::line("[[sources]]\ntype   = \"hri\"\nperson = \"p001\"\nframe  = [640, 480]");
        output::line(format!("domain = {domain}\n"));
    }
}

/// Whether signals of people were found in the namespace of people.
fn has_people(found: &Domain) -> bool {
    let people = RosPeople::default();
    found.topics.iter().any(|topic| people.hears(&topic.name, &topic.type_name))
}

/// Returns the robot whose condition a topic reports, by the first token of the topic's name.
pub fn robot<'a>(topic: &'a str, type_name: &str) -> Option<&'a str> {
    let (robot, below) = topic.strip_prefix('/')?.split_once('/')?;
    let gives = norm_of_type(type_name).is_some() && !below.is_empty() && robot != "sim";
    gives.then_some(robot)
}

/// Returns the namespaces in which robots were found; namespaces that differ only in a number share one pattern.
fn robots(found: &Domain) -> Vec<String> {
    let of_robot = found.topics.iter().filter_map(|topic| robot(&topic.name, &topic.type_name));
    let namespaces = of_robot.map(|robot| {
        let bare = robot.trim_end_matches(|each: char| each.is_ascii_digit());
        if bare == robot { format!("/{robot}") } else { format!("/{bare}*") }
    });
    let mut namespaces: Vec<String> = namespaces.collect();
    namespaces.sort();
    namespaces.dedup();
    namespaces
}
