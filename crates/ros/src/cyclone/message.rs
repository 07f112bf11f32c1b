//! Our own sample representation: the unmodified CDR bytes, and the writer's sequence number.

use std::ffi::{c_char, c_void};
use std::ptr;
use std::sync::atomic::{AtomicU32, Ordering};

use bytes::Bytes;
use cyclors as c;

use super::fragments;
use super::sertype::Shared;

/// The length of the header before the CDR itself [bytes].
pub(super) const HEADER_BYTES: usize = 4;

/// A reference-counted message held by the library.
#[repr(C)]
pub(super) struct Message {
    /// The library's header. It is the first field, so that a pointer to it is also a pointer to the message.
    common: c::ddsi_serdata,
    cdr: Bytes,
    sequence: Option<u64>,
}

/// The content of a received message.
pub(super) struct Content {
    pub(super) cdr: Bytes,
    pub(super) sequence: Option<u64>,
}

/// Creates a message of the library from our bytes; the caller owns one reference.
///
/// # Safety
///
/// `sertype` is valid and one of ours.
pub(super) unsafe fn outgoing(
    sertype: *const c::ddsi_sertype,
    cdr: &[u8],
    sequence: u64,
) -> *mut c::ddsi_serdata {
    // The library sends whole words: it reads up to three bytes beyond the message.
    let padded = cdr.len().next_multiple_of(4);
    let mut bytes = Vec::with_capacity(padded);
    bytes.extend_from_slice(cdr);
    bytes.resize(padded, 0);
    let kind = c::ddsi_serdata_kind_SDK_DATA;
    // SAFETY: guaranteed by the caller.
    unsafe { make(sertype, kind, bytes.into(), Some(sequence)) }
}

/// Reads a message and releases one reference to it.
///
/// # Safety
///
/// `message` is one of ours, and the caller owns one reference to it.
pub(super) unsafe fn take(message: *mut c::ddsi_serdata) -> Content {
    let ours = message.cast::<Message>();
    // SAFETY: only `common` changes after creation, and the reference keeps the message alive until the
    // last line.
    unsafe {
        let content = Content { cdr: (*ours).cdr.clone(), sequence: (*ours).sequence };
        c::ddsi_serdata_unref(message);
        content
    }
}

/// # Safety
///
/// `sertype` is valid and one of ours, or null for a message without a type.
unsafe fn make(
    sertype: *const c::ddsi_sertype,
    kind: c::ddsi_serdata_kind,
    cdr: Bytes,
    sequence: Option<u64>,
) -> *mut c::ddsi_serdata {
    // SAFETY: all zeros is a valid value of this C structure; `ddsi_serdata_init` then fills it.
    let common = unsafe { std::mem::zeroed() };
    let message = Box::into_raw(Box::new(Message { common, cdr, sequence }));
    // SAFETY: we hold the only reference until it is returned.
    unsafe {
        let common = &raw mut (*message).common;
        c::ddsi_serdata_init(common, sertype, kind);
        (*common).ops = &raw const OPERATIONS.0;
        common
    }
}

/// The library's operations on messages of this representation.
pub(super) static OPERATIONS: Shared<c::ddsi_serdata_ops> = Shared(c::ddsi_serdata_ops {
    eqkey: Some(have_equal_keys),
    get_size: Some(size),
    from_ser: Some(from_fragments),
    from_ser_iov: Some(from_pieces),
    from_keyhash: Some(from_key_hash),
    from_sample: None,
    to_ser: Some(copy_out),
    to_ser_ref: Some(lend),
    to_ser_unref: Some(give_back),
    to_sample: None,
    to_untyped: Some(without_type),
    untyped_to_sample: None,
    free: Some(free),
    print: Some(print),
    get_keyhash: Some(key_hash),
    from_loaned_sample: None,
    from_psmx: None,
});

/// ROS topics have no keys, so all messages of a topic belong to one instance.
unsafe extern "C" fn have_equal_keys(
    _one: *const c::ddsi_serdata,
    _other: *const c::ddsi_serdata,
) -> bool {
    true
}

unsafe extern "C" fn size(message: *const c::ddsi_serdata) -> u32 {
    // SAFETY: the library calls these operations only with messages of this representation.
    let size = unsafe { (*message.cast::<Message>()).cdr.len() };
    u32::try_from(size).unwrap_or(u32::MAX)
}

/// Creates a message from network fragments.
unsafe extern "C" fn from_fragments(
    sertype: *const c::ddsi_sertype,
    kind: c::ddsi_serdata_kind,
    first: *const c::ddsi_rdata,
    size: usize,
) -> *mut c::ddsi_serdata {
    // SAFETY: the library passes the chain of fragments of a complete message of this size.
    let Some(cdr) = (unsafe { fragments::gather(first, size) }) else { return ptr::null_mut() };
    if kind == c::ddsi_serdata_kind_SDK_DATA && cdr.len() < HEADER_BYTES {
        return ptr::null_mut();
    }
    // SAFETY: the type is the one that references these operations.
    unsafe { make(sertype, kind, cdr.into(), fragments::sequence(first)) }
}

/// Creates a message from inside the process.
unsafe extern "C" fn from_pieces(
    sertype: *const c::ddsi_sertype,
    kind: c::ddsi_serdata_kind,
    count: c::ddsrt_msg_iovlen_t,
    pieces: *const c::ddsrt_iovec_t,
    size: usize,
) -> *mut c::ddsi_serdata {
    let mut bytes = Vec::with_capacity(size.min(64 << 10));
    for k in 0..count {
        // SAFETY: there are `count` pieces, each with a valid start and length.
        unsafe {
            let piece = &*pieces.add(k);
            let start = piece.iov_base.cast::<u8>();
            bytes.extend_from_slice(std::slice::from_raw_parts(start, piece.iov_len));
        }
    }
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    // SAFETY: the type is the one that references these operations.
    unsafe { make(sertype, kind, bytes.into(), None) }
}

unsafe extern "C" fn from_key_hash(
    sertype: *const c::ddsi_sertype,
    _hash: *const c::ddsi_keyhash,
) -> *mut c::ddsi_serdata {
    // SAFETY: the type is the one that references these operations.
    unsafe { make(sertype, c::ddsi_serdata_kind_SDK_KEY, Bytes::new(), None) }
}

unsafe extern "C" fn copy_out(
    message: *const c::ddsi_serdata,
    offset: usize,
    size: usize,
    to: *mut c_void,
) {
    // SAFETY: the message is of this representation, and the library has room for `size` bytes.
    unsafe {
        let part = part(message, offset, size);
        ptr::copy_nonoverlapping(part.as_ptr(), to.cast::<u8>(), part.len());
    }
}

/// Lends a part of a message, with a reference to the message.
unsafe extern "C" fn lend(
    message: *const c::ddsi_serdata,
    offset: usize,
    size: usize,
    piece: *mut c::ddsrt_iovec_t,
) -> *mut c::ddsi_serdata {
    let message = message.cast_mut();
    // SAFETY: the message is of this representation and valid; its reference count is changed atomically
    // only, here as in the library.
    unsafe {
        let part = part(message, offset, size);
        (*piece).iov_base = part.as_ptr().cast_mut().cast::<c_void>();
        (*piece).iov_len = part.len();
        let references = AtomicU32::from_ptr(&raw mut (*message).refc.v);
        references.fetch_add(1, Ordering::Relaxed);
    }
    message
}

unsafe extern "C" fn give_back(message: *mut c::ddsi_serdata, _piece: *const c::ddsrt_iovec_t) {
    // SAFETY: this is the reference taken by `lend`.
    unsafe { c::ddsi_serdata_unref(message) };
}

/// The key of the single instance of a topic.
unsafe extern "C" fn without_type(message: *const c::ddsi_serdata) -> *mut c::ddsi_serdata {
    // SAFETY: the message is valid, so its type is; the copy's type is cleared before anyone sees it.
    unsafe {
        let key = make((*message).type_, c::ddsi_serdata_kind_SDK_KEY, Bytes::new(), None);
        (*key).type_ = ptr::null();
        (*key).hash = (*message).hash;
        key
    }
}

unsafe extern "C" fn free(message: *mut c::ddsi_serdata) {
    // SAFETY: `make` created it from a box, and this is the last reference.
    drop(unsafe { Box::from_raw(message.cast::<Message>()) });
}

/// Prints nothing: the library's traces omit the content of messages.
unsafe extern "C" fn print(
    _sertype: *const c::ddsi_sertype,
    _message: *const c::ddsi_serdata,
    text: *mut c_char,
    size: usize,
) -> usize {
    if size > 0 {
        // SAFETY: there is room for `size` characters.
        unsafe { *text = 0 };
    }
    0
}

unsafe extern "C" fn key_hash(
    _message: *const c::ddsi_serdata,
    hash: *mut c::ddsi_keyhash,
    _force_md5: bool,
) {
    // SAFETY: the hash is an output parameter of the library.
    unsafe { (*hash).value = [0; 16] };
}

/// A part of a message, truncated at its end.
///
/// # Safety
///
/// The message is of this representation and outlives the part.
unsafe fn part<'a>(message: *const c::ddsi_serdata, offset: usize, size: usize) -> &'a [u8] {
    // SAFETY: guaranteed by the caller; the bytes never change.
    let cdr: &'a Bytes = unsafe { &(*message.cast::<Message>()).cdr };
    let end = offset.saturating_add(size).min(cdr.len());
    cdr.get(offset..end).unwrap_or_default()
}
