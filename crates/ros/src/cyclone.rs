//! A ROS 2 domain over DDS.
#![expect(unsafe_code, reason = "it binds the C library Cyclone DDS")]

pub mod configuration;
mod dds;
mod site;
mod subscription;
mod duplicates;
mod nodes;
mod census;
mod type_search;
mod type_client;
mod type_server;
mod parameter_server;
mod client;
mod server;
mod service;
mod names;
mod wake;
mod discovery;
mod reader;
mod replies;
mod writer;
mod message;
mod gather;
mod waits;
mod overflow;
mod sockets;
mod fragments;
mod sertype;
mod qos;
mod domain;
mod entity;
mod library_log;

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use async_trait::async_trait;
use teampulse_core::qos::Qos;
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;
use teampulse_messages::standard::rmw_dds_common::GidWidth;
use tokio::sync::{broadcast, watch};

use crate::bus::{
    Answer, Asked, Bus, BusError, Client, Deliver, Hear, Incident, Publisher, Subscription,
};
use crate::graph::{EndpointKind, Graph};
pub use dds::DDS;
use domain::Participant;
use parameter_server::{FollowsClock, ParameterServer};
use server::Server;
use service::Service;
use site::{Site, Watcher};
use subscription::Listening;
use type_server::TypeServer;
use writer::{Met, Writer};

/// The settings of a participant.
#[derive(Clone, Debug)]
pub struct Participation {
    /// The domain id.
    pub domain: u32,
    /// The namespace of our node: `/`.
    pub namespace: String,
    /// The name of our node: `teampulse`.
    pub node_name: String,
    /// The configuration of Cyclone DDS, as written by [`configuration`](configuration::configuration).
    pub configuration: String,
    /// The width of GIDs in the announcement of our node; `None` takes the width of the first announcement received,
    /// and until then the width of ROS 2 Iron and later.
    pub gid_width: Option<GidWidth>,
    /// The install prefixes of ROS packages, where types are found that no participant provides.
    pub prefixes: Vec<PathBuf>,
}

/// A participant of a ROS 2 domain.
///
/// It has one node, which owns all of its publishers and subscriptions and does not receive its own
/// messages. A [`Deliver`] must neither block nor drop its own subscription.
pub struct CycloneBus {
    name: String,
    prefixes: Vec<PathBuf>,
    watcher: Option<JoinHandle<()>>,
    /// Declared before `site`, whose participant it uses, to be dropped first.
    _types: TypeServer,
    _parameters: ParameterServer,
    site: Arc<Site>,
}

impl CycloneBus {
    /// Joins a domain. All participants of a process in the same domain need the same configuration.
    pub fn join(participation: Participation) -> Result<Arc<dyn Bus>, BusError> {
        let name = format!("ROS domain {}", participation.domain);
        match CycloneBus::open(name.clone(), participation) {
            Ok(bus) => Ok(Arc::new(bus)),
            Err(reason) => Err(BusError::Join { bus: name, reason, hint: String::new() }),
        }
    }

    fn open(name: String, participation: Participation) -> Result<CycloneBus, String> {
        let Participation { domain, namespace, node_name, configuration, gid_width, prefixes } =
            participation;
        let participant = Arc::new(Participant::join(domain, &configuration)?);
        if let Some(bytes) = sockets::enlarge(domain) {
            gather::suit(bytes);
        }
        let node = names::node(&namespace, &node_name);
        let types = TypeServer::open(&participant, &node)?;
        let site = Arc::new(Site::new(participant, namespace, node_name));
        let parameters = ParameterServer::open(&site.participant, &node, &follows_clock(&site))?;
        let mut watcher = Watcher::new(Arc::clone(&site), domain, gid_width)?;
        watcher.look();
        let thread = thread::Builder::new().name(format!("ros-domain-{domain}"));
        let watcher = thread.spawn(|| watcher.run()).map_err(|error| error.to_string())?;
        let watcher = Some(watcher);
        Ok(CycloneBus { name, prefixes, watcher, _types: types, _parameters: parameters, site })
    }
}

/// Returns whether we subscribe to `/clock`; `false` once the site is gone.
fn follows_clock(site: &Arc<Site>) -> FollowsClock {
    let site = Arc::downgrade(site);
    Arc::new(move || {
        let Some(site) = site.upgrade() else { return false };
        let graph = Arc::clone(&site.graph.borrow());
        let mut on_clock = graph.endpoints_of("/clock");
        on_clock.any(|each| each.own && each.kind == EndpointKind::Subscription)
    })
}

impl Drop for CycloneBus {
    fn drop(&mut self) {
        self.site.wake.end();
        if let Some(watcher) = self.watcher.take()
            && watcher.join().is_err()
        {
            tracing::error!("the thread that watches {} panicked", self.name);
        }
    }
}

#[async_trait]
impl Bus for CycloneBus {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn graph(&self) -> watch::Receiver<Arc<Graph>> {
        self.site.graph.subscribe()
    }

    fn incidents(&self) -> broadcast::Receiver<Incident> {
        self.site.incidents.subscribe()
    }

    fn subscribe(
        &self,
        topic: &str,
        type_name: &str,
        asked: Asked,
        deliver: Deliver,
    ) -> Result<Subscription, BusError> {
        let listening = Listening::begin(&self.site, (topic, type_name), asked, deliver);
        let listening = listening.map_err(|reason| not_opened(topic, type_name, reason))?;
        let listening = Arc::new(listening);
        self.site.keep(&listening);
        Ok(Subscription::new(Closing(listening)))
    }

    fn publish(
        &self,
        topic: &str,
        schema: &Schema,
        qos: &Qos,
    ) -> Result<Box<dyn Publisher>, BusError> {
        let names = (&*names::dds_topic(topic), &*names::dds_type(&schema.name));
        let (incidents, own_topic) = (self.site.incidents.clone(), topic.to_owned());
        let meet = Box::new(move |met| {
            let Met::Incompatible(policy) = met else { return };
            let topic = own_topic.clone();
            // Without a listener the event is dropped.
            incidents.send(Incident::IncompatibleQos { topic, policy, ours: false }).ok();
        });
        let participant = Arc::clone(&self.site.participant);
        let user_data = names::user_data(&schema.hash);
        let writer = Writer::open(&participant, names, qos, &user_data, meet);
        let writer = writer.map_err(|reason| not_opened(topic, &schema.name, reason))?;
        Ok(Box::new(Publishing { topic: topic.to_owned(), writer, _participant: participant }))
    }

    fn node(&self) -> String {
        names::node(&self.site.namespace, &self.site.node_name)
    }

    fn serve(
        &self,
        service: &str,
        type_name: &str,
        answer: Answer,
    ) -> Result<Subscription, BusError> {
        let [request, reply] = halves(type_name);
        let participant = Arc::clone(&self.site.participant);
        let answer = move |request: &[u8]| answer(request);
        let named = Service::named(service);
        let server = Server::open(&participant, &named, (&request, &reply), answer);
        let server = server.map_err(|reason| not_opened(service, type_name, reason))?;
        Ok(Subscription::new(Serving { _server: server, _participant: participant }))
    }

    fn client(
        &self,
        service: &str,
        type_name: &str,
        hear: Hear,
    ) -> Result<Box<dyn Client>, BusError> {
        let [request, reply] = halves(type_name);
        let participant = Arc::clone(&self.site.participant);
        let (named, hear) = (Service::named(service), move |reply| hear(reply));
        let client = client::Client::open(&self.site, &named, (&request, &reply), hear);
        let client = client.map_err(|reason| not_opened(service, type_name, reason))?;
        Ok(Box::new(Asking { service: service.to_owned(), client, _participant: participant }))
    }

    async fn definition(&self, type_name: &str, hash: &str) -> Result<Schema, BusError> {
        let found = type_search::find(&self.site, &self.prefixes, type_name, hash).await;
        let type_name = type_name.to_owned();
        found.map_err(|reason| BusError::Definition { type_name, reason })
    }
}

fn not_opened(topic: &str, type_name: &str, reason: String) -> BusError {
    BusError::Topic { topic: topic.to_owned(), type_name: type_name.to_owned(), reason }
}

/// The request type and the response type of a service type.
fn halves(type_name: &str) -> [String; 2] {
    [format!("{type_name}_Request"), format!("{type_name}_Response")]
}

/// A service that we offer.
struct Serving {
    /// Declared before `_participant`, which it uses, to be dropped first.
    _server: Server,
    _participant: Arc<Participant>,
}

/// A client of a service.
struct Asking {
    service: String,
    /// Declared before `_participant`, which it uses, to be dropped first.
    client: client::Client,
    _participant: Arc<Participant>,
}

impl Client for Asking {
    fn ask(&self, number: i64, request: &[u8]) -> Result<(), BusError> {
        let failed = |reason| BusError::Publish { topic: self.service.clone(), reason };
        self.client.ask(number, request).map_err(failed)
    }
}

/// Closes a subscription when it is dropped, even if others still hold it briefly.
struct Closing(Arc<Listening>);

impl Drop for Closing {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// A publisher of one topic.
struct Publishing {
    topic: String,
    /// Declared before `_participant`, which it uses, to be dropped first.
    writer: Writer,
    _participant: Arc<Participant>,
}

impl Publisher for Publishing {
    fn publish(&self, cdr: &[u8]) -> Result<(), BusError> {
        let failed = |reason| BusError::Publish { topic: self.topic.clone(), reason };
        self.writer.write(cdr, None).map_err(failed)
    }

    fn publish_at(&self, cdr: &[u8], stamp: Time) -> Result<(), BusError> {
        let failed = |reason| BusError::Publish { topic: self.topic.clone(), reason };
        self.writer.write(cdr, Some(stamp)).map_err(failed)
    }

    fn subscribers(&self) -> usize {
        self.writer.readers()
    }
}
