//! The server end of a service.

use bytes::Bytes;

use super::domain::Participant;
use super::names;
use super::reader::{Reader, ReaderEvent};
use super::replies::Replies;
use super::service::{Call, QOS, Service};
use super::type_server::shipped_hash;

/// A server, which answers requests until it is dropped.
pub(super) struct Server {
    _reader: Reader,
}

impl Server {
    /// Starts to answer requests of one type with replies of another.
    pub(super) fn open(
        participant: &Participant,
        service: &Service,
        (request, reply): (&str, &str),
        answer: impl Fn(&[u8]) -> Option<Bytes> + Send + Sync + 'static,
    ) -> Result<Server, String> {
        let id = format!("serviceid={};", participant.entity().gid());
        let names = (&*service.reply_topic, &*names::dds_type(reply));
        let replies =
            Replies::open(participant, names, &QOS, &(id.clone() + &shipped_hash(reply)))?;
        let answer_all = Box::new(move |event| {
            let ReaderEvent::Arrived(arrival) = event else { return };
            let Some((call, cdr)) = Call::unwrap(&arrival.bytes) else { return };
            let Some(reply) = answer(&cdr) else { return };
            replies.send(arrival.publisher, call.wrap(&reply));
        });
        let names = (&*service.request_topic, &*names::dds_type(request));
        let user_data = id + &shipped_hash(request);
        let reader = Reader::open(participant, names, &QOS, &user_data, answer_all)?;
        Ok(Server { _reader: reader })
    }
}
