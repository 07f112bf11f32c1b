//! Domains: each is joined once per process, and left with the last participant.

use std::collections::btree_map::{BTreeMap, Entry};
use std::ffi::CString;
use std::sync::mpsc::sync_channel;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cyclors::{dds_create_domain, dds_create_participant};

use super::entity::Entity;
use super::library_log;

/// How long to wait for the library to leave a domain.
const PATIENCE: Duration = Duration::from_secs(5);

static JOINED: Mutex<BTreeMap<u32, Joined>> = Mutex::new(BTreeMap::new());

struct Joined {
    configuration: String,
    participants: usize,
    _domain: Entity,
}

/// A participant of a domain.
#[derive(Debug)]
pub(super) struct Participant {
    id: u32,
    /// `None` only during drop: it must be deleted before its domain.
    entity: Option<Entity>,
}

impl Participant {
    /// Joins a domain. The first participant of a process configures the domain.
    pub(super) fn join(id: u32, configuration: &str) -> Result<Participant, String> {
        let mut joined = lock();
        let domain = match joined.entry(id) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(Joined::new(id, configuration)?),
        };
        if domain.configuration != configuration {
            return Err("this process has joined it with another configuration".into());
        }
        let created = library_log::explain(|| {
            // SAFETY: the library allows null for QoS and listener.
            let handle = unsafe { dds_create_participant(id, std::ptr::null(), std::ptr::null()) };
            Entity::created(handle)
        });
        match created {
            Ok(entity) => {
                domain.participants += 1;
                Ok(Participant { id, entity: Some(entity) })
            }
            Err(reason) => {
                if domain.participants == 0 {
                    joined.remove(&id);
                }
                Err(reason)
            }
        }
    }

    pub(super) fn entity(&self) -> &Entity {
        self.entity.as_ref().expect("the entity exists until drop")
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        self.entity = None;
        let mut joined = lock();
        let Some(domain) = joined.get_mut(&self.id) else { return };
        domain.participants -= 1;
        if domain.participants == 0
            && let Some(ended) = joined.remove(&self.id)
        {
            ended.leave();
        }
    }
}

impl Joined {
    /// Leaves the domain. The library wakes its receiving threads with packets to itself, and waits forever if a
    /// firewall blocks these; in that case the domain is leaked.
    fn leave(self) {
        let (done, left) = sync_channel(1);
        std::thread::spawn(move || {
            drop(self);
            if done.send(()).is_err() {
                tracing::info!("leaving a ROS domain succeeded after a delay");
            }
        });
        if left.recv_timeout(PATIENCE).is_err() {
            tracing::warn!(
                "failed to leave a ROS domain: does a firewall block UDP to this machine?"
            );
        }
    }

    fn new(id: u32, configuration: &str) -> Result<Joined, String> {
        let xml = CString::new(configuration).map_err(|nul| nul.to_string())?;
        // SAFETY: `xml` is a string that outlives the call; the library copies it.
        let join = || Entity::created(unsafe { dds_create_domain(id, xml.as_ptr()) });
        let domain = library_log::explain(join)?;
        Ok(Joined { configuration: configuration.to_owned(), participants: 0, _domain: domain })
    }
}

fn lock() -> MutexGuard<'static, BTreeMap<u32, Joined>> {
    JOINED.lock().unwrap_or_else(PoisonError::into_inner)
}
