//! Entities of the library: objects owned through a handle.

use std::ffi::CStr;

use cyclors::{dds_delete, dds_entity_t, dds_get_guid, dds_guid_t, dds_return_t, dds_strretcode};

use crate::graph::Gid;

/// An entity; it and its children are deleted when this value is dropped.
#[derive(Debug)]
pub(super) struct Entity(dds_entity_t);

impl Entity {
    /// Takes ownership of a newly created handle; fails with the library's error if creation failed.
    pub(super) fn created(handle: dds_entity_t) -> Result<Entity, String> {
        checked(handle).map(Entity)
    }

    pub(super) fn handle(&self) -> dds_entity_t {
        self.0
    }

    /// The GUID of the entity.
    pub(super) fn gid(&self) -> Gid {
        let mut guid = dds_guid_t { v: [0; 16] };
        // SAFETY: the handle is ours and `guid` is writable. It stays zero if the call fails.
        unsafe { dds_get_guid(self.0, &raw mut guid) };
        Gid::prefixed(guid.v)
    }
}

impl Drop for Entity {
    fn drop(&mut self) {
        // SAFETY: the handle is ours; a handle that was already deleted with its parent is rejected.
        unsafe { dds_delete(self.0) };
    }
}

/// The value of a successful call; fails with the library's error otherwise.
pub(super) fn checked(returned: dds_return_t) -> Result<i32, String> {
    if returned >= 0 {
        return Ok(returned);
    }
    // SAFETY: the library returns a static string for any number.
    let said = unsafe { CStr::from_ptr(dds_strretcode(returned)) };
    Err(said.to_string_lossy().to_lowercase())
}
