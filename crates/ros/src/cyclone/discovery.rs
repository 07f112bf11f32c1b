//! Participants and endpoints discovered by the library, including our own.

use std::ffi::{CStr, c_char, c_void};
use std::mem::MaybeUninit;
use std::ptr;
use std::sync::Arc;

use cyclors as c;

use super::census::{Change, Found, Process};
use super::domain::Participant;
use super::entity::Entity;
use super::names;
use super::qos;
use super::wake::Wake;
use crate::graph::{EndpointKind, Gid};

/// The number of changes taken from the library at a time.
const BATCH: usize = 64;

/// Readers of the library's built-in topics with discovered endpoints.
pub(super) struct Discovery {
    /// Declared before `_wake`: once these are deleted, the library makes no more callbacks.
    participants: Entity,
    publishers: Entity,
    subscriptions: Entity,
    _wake: Arc<Wake>,
}

impl Discovery {
    /// Starts discovery; `wake` is woken for each change.
    pub(super) fn listen(participant: &Participant, wake: Arc<Wake>) -> Result<Discovery, String> {
        let open = |topic| {
            // SAFETY: the library copies the listener, and its argument outlives the readers.
            Entity::created(unsafe {
                let argument = Arc::as_ptr(&wake).cast_mut().cast::<c_void>();
                let listener = c::dds_create_listener(argument);
                c::dds_lset_data_available(listener, Some(data_available));
                let within = participant.entity().handle();
                let handle = c::dds_create_reader(within, topic, ptr::null(), listener);
                c::dds_delete_listener(listener);
                handle
            })
        };
        Ok(Discovery {
            participants: open(c::DDS_BUILTIN_TOPIC_DCPSPARTICIPANT)?,
            publishers: open(c::DDS_BUILTIN_TOPIC_DCPSPUBLICATION)?,
            subscriptions: open(c::DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION)?,
            _wake: wake,
        })
    }

    /// Takes all changes since the last call.
    pub(super) fn take(&self) -> Vec<Change> {
        let mut changes = Vec::new();
        // SAFETY: the samples of each reader have the documented structure of its topic.
        unsafe {
            take(&self.participants, |sample: &c::dds_builtintopic_participant_t, alive| {
                let gid = Gid::prefixed(sample.key.v);
                changes.push(if alive {
                    Change::Participant(gid, process(sample.qos))
                } else {
                    Change::ParticipantGone(gid)
                });
            });
            take(&self.publishers, |sample, alive| {
                changes.push(endpoint(EndpointKind::Publisher, sample, alive));
            });
            take(&self.subscriptions, |sample, alive| {
                changes.push(endpoint(EndpointKind::Subscription, sample, alive));
            });
        }
        changes
    }
}

unsafe extern "C" fn data_available(_reader: c::dds_entity_t, wake: *mut c_void) {
    // SAFETY: the argument is the `Wake` that the readers' owner holds.
    unsafe { &*wake.cast::<Wake>() }.wake();
}

/// Takes all samples of a reader; `each` also receives whether the sample's instance is still alive.
///
/// # Safety
///
/// The samples of the reader have type `T`.
unsafe fn take<T>(reader: &Entity, mut each: impl FnMut(&T, bool)) {
    let mut samples = [ptr::null_mut::<c_void>(); BATCH];
    let mut infos = [const { MaybeUninit::<c::dds_sample_info_t>::uninit() }; BATCH];
    loop {
        // SAFETY: there is room for a batch. Null pointers request a loan, which is returned below; until
        // then the samples do not change.
        let taken = unsafe {
            let infos = infos.as_mut_ptr().cast::<c::dds_sample_info_t>();
            let handle = reader.handle();
            c::dds_take(handle, samples.as_mut_ptr(), infos, BATCH, BATCH as u32)
        };
        if taken <= 0 {
            return;
        }
        for (sample, info) in samples.iter().zip(&infos).take(taken as usize) {
            // SAFETY: the first `taken` entries were filled.
            let (sample, info) = unsafe { (&*sample.cast::<T>(), info.assume_init_ref()) };
            let alive = info.instance_state == c::dds_instance_state_DDS_IST_ALIVE;
            each(sample, alive && info.valid_data);
        }
        // SAFETY: this is the loan from above.
        unsafe { c::dds_return_loan(reader.handle(), samples.as_mut_ptr(), taken) };
        samples = [ptr::null_mut(); BATCH];
    }
}

/// Reads the host and the process that a participant announces, in the format of Cyclone DDS or of Fast DDS.
///
/// # Safety
///
/// `policies` is null or a valid set.
unsafe fn process(policies: *const c::dds_qos_t) -> Option<Process> {
    // SAFETY: guaranteed by the caller.
    let read = |name| unsafe { qos::property(policies, name) };
    let host = read(c"__Hostname").or_else(|| read(c"fastdds.physical_data.host"))?;
    let process = read(c"__ProcessName").or_else(|| read(c"fastdds.physical_data.process"));
    let host = host.split_whitespace().collect();
    Some(Process { host, name: process.unwrap_or_default().trim().to_owned() })
}

fn endpoint(kind: EndpointKind, sample: &c::dds_builtintopic_endpoint_t, alive: bool) -> Change {
    let gid = Gid::prefixed(sample.key.v);
    if !alive {
        return Change::EndpointGone(gid);
    }
    // SAFETY: the strings and the policies of a sample on loan are valid or null.
    let (topic, type_name, (qos, user_data)) =
        unsafe { (text(sample.topic_name), text(sample.type_name), qos::read(sample.qos)) };
    Change::Endpoint(Found {
        kind,
        gid,
        participant: Gid::prefixed(sample.participant_key.v),
        topic,
        type_name,
        type_hash: names::type_hash(&user_data),
        qos,
    })
}

/// # Safety
///
/// `text` is null or a valid string.
unsafe fn text(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: guaranteed by the caller.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}
