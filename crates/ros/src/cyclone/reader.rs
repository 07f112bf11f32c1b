//! The reader of a topic in the library.

use std::collections::BTreeMap;
use std::ffi::{CString, c_void};
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::{Mutex, PoisonError};

use cyclors as c;
use teampulse_core::qos::Qos;
use teampulse_core::time::Time;

use super::domain::Participant;
use super::entity::Entity;
use super::gather;
use super::message;
use super::qos::{self, Policies};
use super::sertype;
use crate::bus::Arrival;
use crate::graph::Gid;

/// The number of messages taken from the library at a time.
const BATCH: usize = 32;
/// The most publishers that a reader remembers; a topic has a few at a time.
const REMEMBERED: usize = 4096;

/// A reader, which delivers messages until it is dropped.
#[derive(Debug)]
pub(super) struct Reader {
    /// Declared before `_callbacks`: once it is deleted, the library makes no more callbacks.
    _entity: Entity,
    _callbacks: Box<Callbacks>,
}

/// An event of a reader. Events are delivered on threads of the library, one at a time for each reader.
#[derive(Debug)]
pub(super) enum ReaderEvent {
    /// A message arrived.
    Arrived(Arrival),
    /// A publisher offers less of this policy than was requested.
    Incompatible(String),
    /// This number of deadlines was missed since the last event.
    DeadlinesMissed(u64),
}

/// The callback for all events of a reader.
pub(super) type OnEvent = Box<dyn Fn(ReaderEvent) + Send + Sync>;

struct Callbacks {
    report: OnEvent,
    /// The GIDs of known publishers, by the library's handle.
    publishers: Mutex<BTreeMap<u64, Gid>>,
}

impl std::fmt::Debug for Callbacks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Callbacks")
    }
}

impl Reader {
    /// Opens a reader of a DDS topic and type.
    pub(super) fn open(
        participant: &Participant,
        (topic, type_name): (&str, &str),
        qos: &Qos,
        user_data: &str,
        report: OnEvent,
    ) -> Result<Reader, String> {
        let topic = CString::new(topic).map_err(|nul| nul.to_string())?;
        let type_name = CString::new(type_name).map_err(|nul| nul.to_string())?;
        // The topic may be deleted at the end of this function: the reader keeps what it needs from it.
        let topic = sertype::topic(participant.entity(), &topic, &type_name)?;
        let callbacks = Box::new(Callbacks { report, publishers: Mutex::default() });
        let policies = Policies::new(qos, user_data);
        // SAFETY: the library copies the listener, and its argument lives as long as the reader.
        let handle = unsafe {
            let argument = ptr::from_ref(&*callbacks).cast_mut().cast::<c_void>();
            let listener = c::dds_create_listener(argument);
            c::dds_lset_data_available(listener, Some(data_available));
            c::dds_lset_requested_incompatible_qos(listener, Some(incompatible));
            c::dds_lset_requested_deadline_missed(listener, Some(deadline_missed));
            let within = participant.entity().handle();
            let handle = c::dds_create_reader(within, topic.handle(), policies.as_ptr(), listener);
            c::dds_delete_listener(listener);
            handle
        };
        Ok(Reader { _entity: Entity::created(handle)?, _callbacks: callbacks })
    }
}

impl Callbacks {
    /// Calls the callback, and catches panics before they enter the library.
    fn report(&self, event: ReaderEvent) {
        if catch_unwind(AssertUnwindSafe(|| (self.report)(event))).is_err() {
            tracing::error!("the callback of a subscription panicked");
        }
    }

    /// The GID of the publisher with this handle.
    fn publisher(&self, reader: c::dds_entity_t, handle: u64) -> Gid {
        let mut known = self.publishers.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(gid) = known.get(&handle) {
            return *gid;
        }
        if known.len() == REMEMBERED {
            known.clear();
        }
        let gid = publisher(reader, handle).unwrap_or_else(|| stand_in(handle));
        known.insert(handle, gid);
        gid
    }
}

fn publisher(reader: c::dds_entity_t, handle: u64) -> Option<Gid> {
    // SAFETY: the library returns null or a structure that we must free.
    unsafe {
        let endpoint = c::dds_get_matched_publication_data(reader, handle);
        let gid = endpoint.as_ref().map(|endpoint| Gid::prefixed(endpoint.key.v));
        if !endpoint.is_null() {
            c::dds_builtintopic_free_endpoint(endpoint);
        }
        gid
    }
}

/// A substitute GID for a publisher that was gone before its last messages were taken.
fn stand_in(handle: u64) -> Gid {
    let mut gid = [0; 16];
    gid[..8].copy_from_slice(&handle.to_be_bytes());
    Gid::prefixed(gid)
}

unsafe extern "C" fn data_available(reader: c::dds_entity_t, callbacks: *mut c_void) {
    // SAFETY: the argument is the reader's `Callbacks`, which outlive it.
    let callbacks = unsafe { &*callbacks.cast::<Callbacks>() };
    let mut messages = [ptr::null_mut::<c::ddsi_serdata>(); BATCH];
    let mut infos = [const { MaybeUninit::<c::dds_sample_info_t>::uninit() }; BATCH];
    let began = gather::begin();
    let mut messages_taken = 0;
    loop {
        // SAFETY: there is room for a batch of each.
        let taken = unsafe {
            let infos = infos.as_mut_ptr().cast::<c::dds_sample_info_t>();
            let any = c::DDS_ANY_STATE;
            c::dds_takecdr(reader, messages.as_mut_ptr(), BATCH as u32, infos, any)
        };
        let taken = usize::try_from(taken).unwrap_or(0);
        messages_taken += taken;
        for (message, info) in messages.iter().zip(&infos).take(taken) {
            // SAFETY: the first `taken` entries were filled; each message comes with a reference.
            let (content, info) = unsafe { (message::take(*message), info.assume_init_ref()) };
            if info.valid_data {
                let at = info.source_timestamp;
                callbacks.report(ReaderEvent::Arrived(Arrival {
                    bytes: content.cdr,
                    source_time: (at > 0).then_some(Time::from_nanos(at)),
                    publisher: callbacks.publisher(reader, info.publication_handle),
                    sequence: content.sequence,
                }));
            }
        }
        if taken < BATCH {
            return gather::end(began, messages_taken);
        }
    }
}

unsafe extern "C" fn incompatible(
    _reader: c::dds_entity_t,
    status: c::dds_requested_incompatible_qos_status_t,
    callbacks: *mut c_void,
) {
    // SAFETY: the argument is the reader's `Callbacks`, which outlive it.
    let callbacks = unsafe { &*callbacks.cast::<Callbacks>() };
    callbacks.report(ReaderEvent::Incompatible(qos::policy_name(status.last_policy_id)));
}

unsafe extern "C" fn deadline_missed(
    _reader: c::dds_entity_t,
    status: c::dds_requested_deadline_missed_status_t,
    callbacks: *mut c_void,
) {
    // SAFETY: the argument is the reader's `Callbacks`, which outlive it.
    let callbacks = unsafe { &*callbacks.cast::<Callbacks>() };
    callbacks.report(ReaderEvent::DeadlinesMissed(
        status.total_count_change.max(0).unsigned_abs().into(),
    ));
}
