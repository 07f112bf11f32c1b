//! Replies to the clients of a service.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use teampulse_core::qos::Qos;

use super::domain::Participant;
use super::writer::{Met, Writer};
use crate::graph::Gid;

/// The most replies that wait for their clients; beyond this number the oldest reply is dropped.
const WAITING: usize = 64;

/// Sends replies. A client's requests may arrive before its reply reader is discovered, and DDS drops
/// messages written until then, so a reply waits for that reader.
pub(super) struct Replies {
    topic: String,
    /// The writer, which is set once it exists.
    writer: OnceLock<Writer>,
    waiting: Mutex<VecDeque<(Gid, Vec<u8>)>>,
}

impl Replies {
    /// Opens the reply topic.
    pub(super) fn open(
        participant: &Participant,
        (topic, type_name): (&str, &str),
        qos: &Qos,
        user_data: &str,
    ) -> Result<Arc<Replies>, String> {
        let writer = OnceLock::new();
        let replies = Replies { topic: topic.to_owned(), writer, waiting: Mutex::default() };
        let replies = Arc::new(replies);
        let matched = Arc::downgrade(&replies);
        let meet = Box::new(move |met| {
            if let (Met::Matched, Some(replies)) = (met, Weak::upgrade(&matched)) {
                replies.send_waiting();
            }
        });
        let writer = Writer::open(participant, (topic, type_name), qos, user_data, meet)?;
        replies.writer.set(writer).ok();
        Ok(replies)
    }

    /// Sends a reply to the client whose request came from this writer, either now or when its reader is
    /// discovered.
    pub(super) fn send(&self, asker: Gid, reply: Vec<u8>) {
        let Some(writer) = self.writer.get() else { return };
        // A reader that is matched after this check waits for the lock, and then finds the reply.
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if !writer.reaches_participant_of(asker) {
            if waiting.len() == WAITING {
                waiting.pop_front();
                tracing::warn!("a client of {} without a reply reader gets no reply", self.topic);
            }
            waiting.push_back((asker, reply));
            return;
        }
        drop(waiting);
        self.write(writer, &reply);
    }

    fn send_waiting(&self) {
        let Some(writer) = self.writer.get() else { return };
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let all = waiting.drain(..);
        let (reached, still) = all.partition(|(asker, _)| writer.reaches_participant_of(*asker));
        let reached: VecDeque<_> = reached;
        *waiting = still;
        drop(waiting);
        for (_, reply) in &reached {
            self.write(writer, reply);
        }
    }

    fn write(&self, writer: &Writer, reply: &[u8]) {
        if let Err(reason) = writer.write(reply, None) {
            tracing::warn!("failed to reply on {}: {reason}", self.topic);
        }
    }
}
