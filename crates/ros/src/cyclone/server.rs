//! The answering end of a service.

use std::sync::Arc;

use bytes::Bytes;

use super::domain::Participant;
use super::names;
use super::reader::{Reader, Told};
use super::service::{Call, QOS, Service};
use super::type_server::shipped_hash;
use super::writer::Writer;

/// A server: it answers as long as it lives.
pub(super) struct Server {
    _reader: Reader,
}

impl Server {
    /// Begins to answer requests of one type by replies of another.
    pub(super) fn open(
        participant: &Participant,
        service: &Service,
        (request, reply): (&str, &str),
        answer: impl Fn(&[u8]) -> Option<Bytes> + Send + Sync + 'static,
    ) -> Result<Server, String> {
        let id = format!("serviceid={};", participant.entity().gid());
        let writer = Writer::open(
            participant,
            (&service.reply_topic, &names::dds_type(reply)),
            &QOS,
            &(id.clone() + &shipped_hash(reply)),
            Box::new(|_| {}),
        )?;
        let writer = Arc::new(writer);
        let topic = service.request_topic.clone();
        let answer_all = Box::new(move |told| {
            let Told::Arrived(arrival) = told else { return };
            let Some((call, cdr)) = Call::unwrap(&arrival.bytes) else { return };
            let Some(reply) = answer(&cdr) else { return };
            if let Err(reason) = writer.write(&call.wrap(&reply), None) {
                tracing::warn!("failed to answer on {topic}: {reason}");
            }
        });
        let names = (&*service.request_topic, &*names::dds_type(request));
        let user_data = id + &shipped_hash(request);
        let reader = Reader::open(participant, names, &QOS, &user_data, answer_all)?;
        Ok(Server { _reader: reader })
    }
}
