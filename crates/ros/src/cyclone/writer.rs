//! The writer of a topic in the library.

use std::ffi::{CString, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::{Mutex, PoisonError};

use cyclors as c;
use teampulse_core::qos::Qos;
use teampulse_core::time::Time;

use super::domain::Participant;
use super::entity::{Entity, checked};
use super::message;
use super::qos::{self, Policies};
use super::sertype;
use crate::graph::Gid;

/// An event of a writer about readers. Events are delivered on threads of the library.
#[derive(Debug)]
pub(super) enum Met {
    /// A reader was matched or unmatched.
    Matched,
    /// A subscription requests more of this policy than is offered.
    Incompatible(String),
}

/// The callback for all events of a writer.
pub(super) type Meet = Box<dyn Fn(Met) + Send + Sync>;

/// The most readers that are searched for a reader of a given participant; beyond this number, one is assumed to be
/// matched.
const REACHED: usize = 256;

/// A writer. Its messages have sequence numbers from one, like those of the library.
pub(super) struct Writer {
    /// Declared before `_meet`: once it is deleted, the library makes no more callbacks.
    entity: Entity,
    _meet: Box<Meet>,
    /// The number of messages written. Locked during a write, so that sequence numbers stay in order.
    written: Mutex<u64>,
}

impl Writer {
    /// Creates a writer of a DDS topic and type.
    pub(super) fn open(
        participant: &Participant,
        (topic, type_name): (&str, &str),
        qos: &Qos,
        user_data: &str,
        meet: Meet,
    ) -> Result<Writer, String> {
        let topic = CString::new(topic).map_err(|nul| nul.to_string())?;
        let type_name = CString::new(type_name).map_err(|nul| nul.to_string())?;
        // The topic may be deleted at the end of this function: the writer keeps what it needs from it.
        let topic = sertype::topic(participant.entity(), &topic, &type_name)?;
        let meet = Box::new(meet);
        let policies = Policies::new(qos, user_data);
        // SAFETY: the library copies the listener, and its argument lives as long as the writer.
        let handle = unsafe {
            let argument = ptr::from_ref(&*meet).cast_mut().cast::<c_void>();
            let listener = c::dds_create_listener(argument);
            c::dds_lset_offered_incompatible_qos(listener, Some(incompatible));
            c::dds_lset_publication_matched(listener, Some(matched));
            let within = participant.entity().handle();
            let handle = c::dds_create_writer(within, topic.handle(), policies.as_ptr(), listener);
            c::dds_delete_listener(listener);
            handle
        };
        let entity = Entity::created(handle)?;
        Ok(Writer { entity, _meet: meet, written: Mutex::new(0) })
    }

    /// Writes a message: CDR with its header, with the given timestamp or the current time. Blocks on slow
    /// subscribers for at most a second.
    pub(super) fn write(&self, cdr: &[u8], stamp: Option<Time>) -> Result<(), String> {
        if cdr.len() < message::HEADER_BYTES {
            return Err(format!(
                "it has {} bytes, but the header of CDR alone has four",
                cdr.len()
            ));
        }
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the type lives as long as the writer, and the call takes over the reference to the
        // message whether it succeeds or not.
        checked(unsafe {
            let mut sertype = ptr::null();
            let found = c::dds_get_entity_sertype(self.entity.handle(), &raw mut sertype);
            checked(found)?;
            let message = message::outgoing(sertype, cdr, *written + 1);
            match stamp {
                None => c::dds_writecdr(self.entity.handle(), message),
                Some(stamp) => {
                    (*message).statusinfo = 0;
                    (*message).timestamp.v = stamp.nanos();
                    c::dds_forwardcdr(self.entity.handle(), message)
                }
            }
        })?;
        // A rejected message uses no sequence number.
        *written += 1;
        Ok(())
    }

    /// The number of matched readers.
    pub(super) fn readers(&self) -> usize {
        // SAFETY: all zeros is a valid value of this C structure; it stays so if the call fails.
        unsafe {
            let mut status: c::dds_publication_matched_status_t = std::mem::zeroed();
            c::dds_get_publication_matched_status(self.entity.handle(), &raw mut status);
            status.current_count as usize
        }
    }

    /// Whether a reader of the same participant as `entity` is matched.
    pub(super) fn reaches_participant_of(&self, entity: Gid) -> bool {
        let matched = self.entity.handle();
        let mut handles = [0; REACHED];
        // SAFETY: the library writes no more handles than there is room for, and each returned structure is
        // freed.
        unsafe {
            let found = c::dds_get_matched_subscriptions(matched, handles.as_mut_ptr(), REACHED);
            let found = usize::try_from(found).unwrap_or(0);
            found > REACHED
                || handles[..found].iter().any(|handle| {
                    let endpoint = c::dds_get_matched_subscription_data(matched, *handle);
                    if endpoint.is_null() {
                        return false;
                    }
                    let reader = Gid::prefixed((*endpoint).key.v);
                    c::dds_builtintopic_free_endpoint(endpoint);
                    reader.participant() == entity.participant()
                })
        }
    }

    pub(super) fn gid(&self) -> Gid {
        self.entity.gid()
    }
}

unsafe extern "C" fn incompatible(
    _writer: c::dds_entity_t,
    status: c::dds_offered_incompatible_qos_status_t,
    meet: *mut c_void,
) {
    // SAFETY: the argument is the writer's `Meet`, which outlives it.
    unsafe { call(meet, Met::Incompatible(qos::policy_name(status.last_policy_id))) }
}

unsafe extern "C" fn matched(
    _writer: c::dds_entity_t,
    _status: c::dds_publication_matched_status_t,
    meet: *mut c_void,
) {
    // SAFETY: the argument is the writer's `Meet`, which outlives it.
    unsafe { call(meet, Met::Matched) }
}

/// # Safety
/// `meet` points to a `Meet`.
unsafe fn call(meet: *mut c_void, met: Met) {
    // SAFETY: guaranteed by the caller.
    let meet = unsafe { &*meet.cast::<Meet>() };
    if catch_unwind(AssertUnwindSafe(|| meet(met))).is_err() {
        tracing::error!("the callback of a publisher panicked");
    }
}
