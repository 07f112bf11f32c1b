//! Messages as received from the network: in fragments, one per packet.

use std::ffi::c_void;

use cyclors as c;

/// A part of a message in a received packet: `ddsi_rdata` in `ddsi_radmin.h` of Cyclone DDS 11, without the
/// counter that only its debug build appends.
#[repr(C)]
struct Fragment {
    packet: *const Packet,
    next: *const Fragment,
    /// The offset of the fragment's start in the message [bytes].
    start: u32,
    /// The offset of the fragment's end in the message [bytes].
    end: u32,
    /// The offset of the fragment's submessage in the packet [bytes]; 0 if unknown.
    submessage_offset: u16,
    /// The offset of the fragment's payload in the packet [bytes].
    payload_offset: u16,
    _key_hash_offset: u16,
}

/// The header that precedes a received packet: `ddsi_rmsg` in `ddsi_radmin.h`.
#[repr(C)]
struct Packet {
    _references: u32,
    _last_chunk: *const c_void,
    _trace: bool,
    _buffer: *const c_void,
    _next_chunk: *const c_void,
    _size: u64,
}

/// The start of the submessages `DATA` and `DATA_FRAG`, RTPS 2.5, sections 9.4.5.4 and 9.4.5.5. The library
/// has already converted its numbers to native byte order.
#[repr(C)]
struct DataHeader {
    id: u8,
    _flags: u8,
    _octets_to_next_header: u16,
    _extra_flags: u16,
    _octets_to_inline_qos: u16,
    _reader_id: u32,
    _writer_id: u32,
    sequence_high: i32,
    sequence_low: u32,
}

const DATA: u8 = 0x15;
const DATA_FRAG: u8 = 0x16;

/// Reassembles a message from its fragments; `None` if they do not make up `size` bytes.
///
/// # Safety
///
/// `first` is the head of a chain of valid fragments.
pub(super) unsafe fn gather(first: *const c::ddsi_rdata, size: usize) -> Option<Vec<u8>> {
    let mut message = Vec::new();
    message.try_reserve_exact(size).ok()?;
    let mut next = first.cast::<Fragment>();
    while !next.is_null() {
        // SAFETY: the caller guarantees that the chain is valid.
        let fragment = unsafe { &*next };
        let have = message.len();
        let (start, end) = (fragment.start as usize, (fragment.end as usize).min(size));
        if start > have {
            return None;
        }
        if end > have {
            // SAFETY: the payload of a fragment is `end - start` bytes of its packet, and the part up to
            // `have` has already been copied: fragments may overlap.
            let new = unsafe {
                let payload = packet(fragment).add(usize::from(fragment.payload_offset));
                std::slice::from_raw_parts(payload.add(have - start), end - have)
            };
            message.extend_from_slice(new);
        }
        next = fragment.next;
    }
    (message.len() == size).then_some(message)
}

/// The writer's sequence number of a message; `None` if unknown.
///
/// # Safety
///
/// `first` is a valid fragment.
pub(super) unsafe fn sequence(first: *const c::ddsi_rdata) -> Option<u64> {
    // SAFETY: guaranteed by the caller; a known submessage was received completely, and its offset is a
    // multiple of four.
    let header = unsafe {
        let fragment = &*first.cast::<Fragment>();
        if fragment.submessage_offset == 0 {
            return None;
        }
        let at = packet(fragment).add(usize::from(fragment.submessage_offset));
        at.cast::<DataHeader>().read_unaligned()
    };
    let known = matches!(header.id, DATA | DATA_FRAG);
    let sequence = i64::from(header.sequence_high) << 32 | i64::from(header.sequence_low);
    u64::try_from(sequence).ok().filter(|sequence| known && *sequence > 0)
}

/// The start of a fragment's packet, directly after the library's header.
fn packet(fragment: &Fragment) -> *const u8 {
    fragment.packet.wrapping_add(1).cast::<u8>()
}

// The library asserts the same size of its header; the other sizes are those on a 64-bit machine.
const _: () = assert!(size_of::<DataHeader>() == 24);
#[cfg(target_pointer_width = "64")]
const _: () = assert!(size_of::<Packet>() == 48 && size_of::<Fragment>() == 32);

#[cfg(test)]
mod tests {
    use super::*;

    /// A packet as stored by the library, with its header.
    #[repr(C)]
    struct Received {
        before: Packet,
        bytes: [u8; 64],
    }

    fn received(bytes: &[u8]) -> Received {
        // SAFETY: all zeros is a valid value of these structures.
        let mut received: Received = unsafe { std::mem::zeroed() };
        received.bytes[..bytes.len()].copy_from_slice(bytes);
        received
    }

    fn fragment(packet: &Received, start: u32, end: u32) -> Fragment {
        Fragment {
            packet: std::ptr::from_ref(packet).cast(),
            next: std::ptr::null(),
            start,
            end,
            submessage_offset: 0,
            payload_offset: 0,
            _key_hash_offset: 0,
        }
    }

    fn gathered(first: &Fragment, size: usize) -> Option<Vec<u8>> {
        // SAFETY: the fragments of these tests are valid until their end.
        unsafe { gather(std::ptr::from_ref(first).cast(), size) }
    }

    #[test]
    fn fragments_make_up_a_message_even_where_they_overlap() {
        let (one, two) = (received(b"abcdef"), received(b"efghij"));
        let second = fragment(&two, 4, 10);
        let mut first = fragment(&one, 0, 6);
        first.next = &raw const second;
        assert_eq!(gathered(&first, 10).as_deref(), Some(&b"abcdefghij"[..]));
        assert_eq!(gathered(&first, 8).as_deref(), Some(&b"abcdefgh"[..]));
    }

    #[test]
    fn a_message_with_a_hole_or_an_absurd_size_is_none() {
        let (one, two) = (received(b"abcd"), received(b"ghij"));
        let second = fragment(&two, 6, 10);
        let mut first = fragment(&one, 0, 4);
        first.next = &raw const second;
        assert_eq!(gathered(&first, 10), None);
        assert_eq!(gathered(&first, usize::MAX), None);
        assert_eq!(gathered(&fragment(&one, 0, 4), 5), None);
    }

    #[test]
    fn the_sequence_is_read_from_the_submessage() {
        let mut bytes = [0; 32];
        bytes[4] = DATA;
        bytes[20..24].copy_from_slice(&1_i32.to_ne_bytes());
        bytes[24..28].copy_from_slice(&7_u32.to_ne_bytes());
        let packet = received(&bytes);
        let mut first = fragment(&packet, 0, 0);
        // SAFETY: the fragment is valid until the end of the test.
        let read = |first: &Fragment| unsafe { sequence(std::ptr::from_ref(first).cast()) };
        assert_eq!(read(&first), None);
        first.submessage_offset = 4;
        assert_eq!(read(&first), Some((1 << 32) + 7));
        first.submessage_offset = 8;
        assert_eq!(read(&first), None, "it is not a DATA submessage");
    }
}
