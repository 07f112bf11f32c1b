//! Asking other nodes for the definitions of their types.

use std::time::Duration;

use bytes::Bytes;
use teampulse_core::stream::Schema;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::type_description_interfaces::{
    GetTypeDescriptionRequest as Request, GetTypeDescriptionResponse as Response,
};
use tokio::sync::mpsc;
use tokio::time::{sleep, timeout};

use super::names;
use super::reader::{Reader, Told};
use super::service::{self, Call, Service};
use super::site::Site;
use super::type_server::{QOS, shipped_hash};
use super::writer::Writer;
use crate::definitions;

/// How long a node has for its answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// After how long a node is asked again: it may have answered before it knew where to.
const AGAIN: Duration = Duration::from_millis(500);
/// How often it is looked whether a node can hear us.
const GLANCE: Duration = Duration::from_millis(10);

/// Asks a node for a type; says why it gave none.
pub(super) async fn ask(
    site: &Site,
    node: &str,
    type_name: &str,
    hash: &str,
) -> Result<Schema, String> {
    let service = Service::get_type_description(node);
    let server = site.census().server(&service.request_topic);
    if !service::speaks_it(server.ok_or("it has no service for this")?) {
        return Err("its services are not those of Cyclone DDS".into());
    }
    let mut client = Client::open(site, &service)?;
    let (name, hash_text) = (type_name.to_owned(), hash.to_owned());
    let request = Request { type_name: name, type_hash: hash_text, include_type_sources: true };
    let Ok(answered) = timeout(PATIENCE, client.call(&request.encode())).await else {
        return Err(format!("it gave no answer within {} s", PATIENCE.as_secs()));
    };
    let response = answered?;
    if !response.successful {
        return Err(format!("it says: {}", response.failure_reason));
    }
    definitions::linked(type_name, hash, |part| text_of(&response, part))
}

/// The text of a part in an answer, if it is written in the language of messages.
fn text_of(response: &Response, part: &str) -> Option<String> {
    let is_it = |encoding: &str, name: &str| encoding == "msg" && name == part;
    let mut sources = response.type_sources.iter();
    let source = sources.find(|source| is_it(&source.encoding, &source.type_name))?;
    Some(source.raw_file_contents.clone())
}

/// A client of the service of one node.
struct Client {
    writer: Writer,
    _reader: Reader,
    replies: mpsc::Receiver<Bytes>,
    call: Call,
}

impl Client {
    fn open(site: &Site, service: &Service) -> Result<Client, String> {
        let participant = &site.participant;
        let (sender, replies) = mpsc::channel(16);
        let hear = Box::new(move |told| {
            if let Told::Arrived(arrival) = told {
                // Replies that nobody waits for are others'.
                sender.try_send(arrival.bytes).ok();
            }
        });
        let number = site.next_call();
        let id = format!("clientid={}.{number};", participant.entity().gid());
        let names = (&*service.reply_topic, &*names::dds_type(Response::NAME));
        let user_data = id.clone() + &shipped_hash(Response::NAME);
        let reader = Reader::open(participant, names, &QOS, &user_data, hear)?;
        let names = (&*service.request_topic, &*names::dds_type(Request::NAME));
        let user_data = id + &shipped_hash(Request::NAME);
        let writer = Writer::open(participant, names, &QOS, &user_data, Box::new(|_| {}))?;
        let own = writer.gid().0;
        let client = u64::from_be_bytes(*own.last_chunk().expect("an id has sixteen bytes"));
        Ok(Client { writer, _reader: reader, replies, call: Call { client, number } })
    }

    /// Asks until there is an answer.
    async fn call(&mut self, request: &[u8]) -> Result<Response, String> {
        while self.writer.readers() == 0 {
            sleep(GLANCE).await;
        }
        loop {
            self.writer.write(&self.call.wrap(request))?;
            if let Ok(response) = timeout(AGAIN, self.reply()).await {
                return response;
            }
        }
    }

    /// The next reply to our call.
    async fn reply(&mut self) -> Result<Response, String> {
        loop {
            let bytes = self.replies.recv().await.ok_or("the reader is gone")?;
            if let Some((call, cdr)) = Call::unwrap(&bytes)
                && call == self.call
            {
                return Response::decode(&cdr).map_err(|error| format!("it failed to {error}"));
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
    async fn a_node_tells_the_types_that_it_knows() {
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
        let told = ask(&monitor.site, "/r1/driver", &known.name, &known.hash).await.unwrap();
        assert_eq!(told.hash, known.hash);
        let nobody = ask(&monitor.site, "/r1/nobody", &known.name, "").await.unwrap_err();
        assert_eq!(nobody, "it has no service for this");
    }
}
