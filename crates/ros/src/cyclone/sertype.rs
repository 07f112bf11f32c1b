//! Our single sertype: any name, plain CDR, opaque content.

use std::ffi::{CStr, c_void};
use std::ptr;

use cyclors as c;

use super::entity::Entity;
use super::message;

/// A constant table that the library reads from any thread.
#[repr(transparent)]
pub(super) struct Shared<T>(pub(super) T);

// SAFETY: the tables contain only function pointers and null, and are never modified.
unsafe impl<T> Sync for Shared<T> {}

/// Creates a topic of the given type in a participant.
pub(super) fn topic(participant: &Entity, name: &CStr, type_name: &CStr) -> Result<Entity, String> {
    // SAFETY: the strings outlive the calls, which copy them. The library takes over our reference to the
    // type if the topic is created, and leaves it to us otherwise.
    unsafe {
        let mut sertype = make(type_name);
        let handle = c::dds_create_topic_sertype(
            participant.handle(),
            name.as_ptr(),
            &raw mut sertype,
            ptr::null(),
            ptr::null(),
            ptr::null(),
        );
        if handle < 0 {
            c::ddsi_sertype_unref(sertype);
        }
        Entity::created(handle)
    }
}

/// # Safety
///
/// None, except that the result must be given to the library or freed.
unsafe fn make(type_name: &CStr) -> *mut c::ddsi_sertype {
    // SAFETY: all zeros is a valid value of this C structure, and the library then fills it. No property is
    // set: the type has no key and no fixed size.
    unsafe {
        let sertype = Box::into_raw(Box::new(std::mem::zeroed()));
        c::ddsi_sertype_init_props(
            sertype,
            type_name.as_ptr(),
            &raw const OPERATIONS.0,
            &raw const message::OPERATIONS.0,
            0,
            0,
            c::DDS_DATA_REPRESENTATION_FLAG_XCDR1,
            0,
        );
        sertype
    }
}

static OPERATIONS: Shared<c::ddsi_sertype_ops> = Shared(c::ddsi_sertype_ops {
    version: Some(c::ddsi_sertype_v0),
    arg: ptr::null_mut(),
    free: Some(free),
    zero_samples: Some(zero_samples),
    realloc_samples: Some(realloc_samples),
    free_samples: Some(free_samples),
    equal: Some(equal),
    hash: Some(hash),
    type_id: None,
    type_map: None,
    type_info: None,
    derive_sertype: None,
    get_serialized_size: None,
    serialize_into: None,
});

unsafe extern "C" fn free(sertype: *mut c::ddsi_sertype) {
    // SAFETY: `make` created it from a box, and this is the last reference.
    unsafe {
        c::ddsi_sertype_fini(sertype);
        drop(Box::from_raw(sertype));
    }
}

/// Types are equal if their names are equal, which the library has already checked.
unsafe extern "C" fn equal(_one: *const c::ddsi_sertype, _other: *const c::ddsi_sertype) -> bool {
    true
}

/// There is nothing to hash except the name, which the library has already hashed.
unsafe extern "C" fn hash(_sertype: *const c::ddsi_sertype) -> u32 {
    0
}

// This type has no decoded samples to allocate or free.

unsafe extern "C" fn zero_samples(_: *const c::ddsi_sertype, _samples: *mut c_void, _count: usize) {
}

unsafe extern "C" fn realloc_samples(
    samples: *mut *mut c_void,
    _sertype: *const c::ddsi_sertype,
    _old: *mut c_void,
    _old_count: usize,
    count: usize,
) {
    for k in 0..count {
        // SAFETY: there is room for `count` pointers.
        unsafe { *samples.add(k) = ptr::null_mut() };
    }
}

unsafe extern "C" fn free_samples(
    _sertype: *const c::ddsi_sertype,
    _samples: *mut *mut c_void,
    _count: usize,
    _operation: c::dds_free_op_t,
) {
}
