//! `ros_discovery_info`: the nodes of each participant, including our own.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use teampulse_core::qos::Qos;
use teampulse_messages::standard::rmw_dds_common::{GidWidth, ParticipantEntitiesInfo};

use super::census::DISCOVERY_TOPIC;
use super::domain::Participant;
use super::names;
use super::reader::{Reader, ReaderEvent};
use super::type_server::shipped_hash;
use super::wake::Wake;
use super::writer::Writer;

/// The most messages that are queued; participants do not repeat announcements, so there are few.
const WAITING: usize = 4096;

/// Our reader and writer of the topic.
pub(super) struct Nodes {
    writer: Writer,
    _reader: Reader,
    heard: Arc<Mutex<Vec<Bytes>>>,
    announced: Option<(ParticipantEntitiesInfo, GidWidth)>,
}

impl Nodes {
    /// Opens the reader and the writer; `wake` is woken for each message.
    pub(super) fn open(participant: &Participant, wake: Arc<Wake>) -> Result<Nodes, String> {
        let type_name = names::dds_type(ParticipantEntitiesInfo::NAME);
        let names = (DISCOVERY_TOPIC, type_name.as_str());
        let user_data = shipped_hash(ParticipantEntitiesInfo::NAME);
        let heard = Arc::<Mutex<Vec<Bytes>>>::default();
        let waiting = Arc::clone(&heard);
        let report = Box::new(move |event| {
            let ReaderEvent::Arrived(arrival) = event else { return };
            let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
            if waiting.len() < WAITING {
                waiting.push(arrival.bytes);
            }
            drop(waiting);
            wake.wake();
        });
        let reader = Reader::open(participant, names, &Qos::latched(100), &user_data, report)?;
        let meet = Box::new(|_| {});
        let writer = Writer::open(participant, names, &Qos::latched(1), &user_data, meet)?;
        Ok(Nodes { writer, _reader: reader, heard, announced: None })
    }

    /// Takes new announcements of other participants; unreadable ones are skipped.
    pub(super) fn take(&self) -> Vec<(ParticipantEntitiesInfo, GidWidth)> {
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        let heard = std::mem::take(&mut *heard);
        heard.iter().filter_map(|cdr| ParticipantEntitiesInfo::decode(cdr).ok()).collect()
    }

    /// Announces our node, unless the announcement is unchanged; returns whether it was written.
    pub(super) fn announce(&mut self, ours: ParticipantEntitiesInfo, width: GidWidth) -> bool {
        let announced_now = (ours, width);
        if self.announced.as_ref() != Some(&announced_now) {
            if let Err(reason) = self.writer.write(&announced_now.0.encode(width), None) {
                tracing::warn!("failed to announce our node: {reason}");
                return false;
            }
            self.announced = Some(announced_now);
        }
        true
    }
}
