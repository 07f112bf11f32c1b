//! Requests type definitions from other nodes.

use std::time::Duration;

use bytes::Bytes;
use teampulse_core::stream::Schema;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::type_description_interfaces::{
    GetTypeDescriptionRequest as Request, GetTypeDescriptionResponse as Response,
};
use tokio::sync::mpsc;
use tokio::time::{sleep, timeout};

use super::client::Client;
use super::service::{self, Service};
use super::site::Site;
use crate::bus::Reply;
use crate::definitions;

/// How long to wait for a node's reply.
const PATIENCE: Duration = Duration::from_secs(2);
/// The interval at which a request is repeated: a node may have replied before it had discovered our
/// reader.
const AGAIN: Duration = Duration::from_millis(500);
/// The interval at which we check whether a node has matched our client.
const GLANCE: Duration = Duration::from_millis(10);

/// Requests a type definition from a node; fails with the reason why the node does not provide it.
pub(super) async fn ask(
    site: &Site,
    node: &str,
    type_name: &str,
    hash: &str,
) -> Result<Schema, String> {
    let service = Service::get_type_description(node);
    let server = site.census().server(&service.request_topic);
    if !service::speaks_it(server.ok_or("it has no service for this")?) {
        return Err("its services do not use Cyclone DDS".into());
    }
    let mut asker = Asker::open(site, &service)?;
    let (name, hash_text) = (type_name.to_owned(), hash.to_owned());
    let request = Request { type_name: name, type_hash: hash_text, include_type_sources: true };
    let Ok(answered) = timeout(PATIENCE, asker.call(&request.encode())).await else {
        return Err(format!("it did not reply within {} s", PATIENCE.as_secs()));
    };
    let response = answered?;
    if !response.successful {
        return Err(format!("it says: {}", response.failure_reason));
    }
    definitions::linked(type_name, hash, |part| text_of(&response, part))
}

/// The text of a type in a response, if the text is in `.msg` format.
fn text_of(response: &Response, part: &str) -> Option<String> {
    let is_it = |encoding: &str, name: &str| encoding == "msg" && name == part;
    let mut sources = response.type_sources.iter();
    let source = sources.find(|source| is_it(&source.encoding, &source.type_name))?;
    Some(source.raw_file_contents.clone())
}

/// A client of one node.
struct Asker {
    client: Client,
    replies: mpsc::Receiver<Bytes>,
}

impl Asker {
    fn open(site: &Site, service: &Service) -> Result<Asker, String> {
        let (sender, replies) = mpsc::channel(16);
        let hear = move |reply: Reply| {
            // Replies to repeated requests are no longer needed.
            sender.try_send(reply.bytes).ok();
        };
        let client = Client::open(site, service, (Request::NAME, Response::NAME), hear)?;
        Ok(Asker { client, replies })
    }

    /// Sends the request until there is a reply.
    async fn call(&mut self, request: &[u8]) -> Result<Response, String> {
        while self.client.servers() == 0 {
            sleep(GLANCE).await;
        }
        loop {
            self.client.ask(1, request)?;
            if let Ok(reply) = timeout(AGAIN, self.replies.recv()).await {
                let reply = reply.ok_or("the reader is gone")?;
                return Response::decode(&reply).map_err(|error| format!("it failed to {error}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use teampulse_messages::catalogue;

    use super::*;
    use crate::cyclone::{CycloneBus, Participation};

    #[tokio::test]
    async fn a_node_gives_the_types_that_it_knows() {
        let join = |node_name: &str| {
            let participation = Participation {
                domain: 110,
                namespace: "/r1".into(),
                node_name: node_name.into(),
                configuration: "<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/>\
                                </Interfaces></General>"
                    .into(),
                gid_width: None,
                prefixes: Vec::new(),
            };
            CycloneBus::open(node_name.to_owned(), participation).unwrap()
        };
        let (_driver, monitor) = (join("driver"), join("monitor"));
        let known = catalogue::shipped("nav_msgs/msg/Odometry").unwrap();
        let is_there = || {
            let topic = Service::get_type_description("/r1/driver").request_topic;
            monitor.site.census().server(&topic).is_some()
        };
        while !is_there() {
            sleep(GLANCE).await;
        }
        let found = ask(&monitor.site, "/r1/driver", &known.name, &known.hash).await.unwrap();
        assert_eq!(found.hash, known.hash);
        let nobody = ask(&monitor.site, "/r1/nobody", &known.name, "").await.unwrap_err();
        assert_eq!(nobody, "it has no service for this");
    }
}
