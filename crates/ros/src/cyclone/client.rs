//! The client end of a service.

use bytes::Bytes;

use super::names;
use super::reader::{Reader, ReaderEvent};
use super::service::{Call, QOS, Service};
use super::site::Site;
use super::type_server::shipped_hash;
use super::writer::Writer;
use crate::bus::Reply;

/// A client of all servers of a service.
pub(super) struct Client {
    writer: Writer,
    _reader: Reader,
    id: u64,
}

impl Client {
    /// Creates a client of a service with the given request and reply types. `hear` is called for each reply to the
    /// client's own requests.
    pub(super) fn open(
        site: &Site,
        service: &Service,
        (request, reply): (&str, &str),
        hear: impl Fn(Reply) + Send + Sync + 'static,
    ) -> Result<Client, String> {
        let participant = &site.participant;
        let id = format!("clientid={}.{};", participant.entity().gid(), site.next_call());
        let topic = (&*service.request_topic, &*names::dds_type(request));
        let user_data = id.clone() + &shipped_hash(request);
        let writer = Writer::open(participant, topic, &QOS, &user_data, Box::new(|_| {}))?;
        let own = writer.gid().bytes();
        let client = u64::from_be_bytes(*own.last_chunk().expect("an id has sixteen bytes"));
        let hear_ours = Box::new(move |event| {
            let ReaderEvent::Arrived(arrival) = event else { return };
            // Replies to other clients arrive on the same topic.
            if let Some((call, cdr)) = Call::unwrap(&arrival.bytes)
                && call.client == client
            {
                let (number, bytes) = (call.number, Bytes::from(cdr));
                hear(Reply { number, bytes, server: arrival.publisher });
            }
        });
        let topic = (&*service.reply_topic, &*names::dds_type(reply));
        let user_data = id + &shipped_hash(reply);
        let reader = Reader::open(participant, topic, &QOS, &user_data, hear_ours)?;
        Ok(Client { writer, _reader: reader, id: client })
    }

    /// Sends a request.
    pub(super) fn ask(&self, number: i64, request: &[u8]) -> Result<(), String> {
        self.writer.write(&Call { client: self.id, number }.wrap(request), None)
    }

    /// The number of servers that currently receive the client's requests.
    pub(super) fn servers(&self) -> usize {
        self.writer.readers()
    }
}
