//! Finds the records of a file again after invalid bytes.

use std::fs::File;

use mcap::McapResult;
use mcap::records::op;

use crate::read::block::Block;
use crate::read::chunk::Extent;
use crate::read::records::{PREFIX_BYTES, read_at, split_prefix};

/// The number of bytes searched at a time.
const WINDOW_BYTES: u64 = 4 << 20;
/// The length of the data end record, including the prefix [bytes].
const DATA_END_BYTES: u64 = PREFIX_BYTES as u64 + 4;

/// Whether this is the opcode of a known kind of record; opcodes from 0x80 on are private.
pub(crate) fn is_known(opcode: u8) -> bool {
    matches!(opcode, op::HEADER..=op::DATA_END | 0x80..)
}

/// The opcode and the length of the record at an offset, including the prefix; `None` if the file ends
/// before it.
pub(crate) fn prefix_at(file: &File, offset: u64) -> McapResult<Option<(u8, u64)>> {
    if file.metadata()?.len() < offset.saturating_add(PREFIX_BYTES as u64) {
        return Ok(None);
    }
    let bytes = read_at(file, offset, PREFIX_BYTES as u64)?;
    Ok(bytes.first_chunk().map(|prefix| with_prefix(split_prefix(prefix))))
}

fn with_prefix((opcode, body_bytes): (u8, u64)) -> (u8, u64) {
    (opcode, body_bytes.saturating_add(PREFIX_BYTES as u64))
}

/// Whether there appears to be a record of a known kind at an offset.
pub(crate) fn is_record(file: &File, offset: u64) -> McapResult<bool> {
    let left_bytes = file.metadata()?.len().saturating_sub(offset);
    let prefix = prefix_at(file, offset)?;
    Ok(prefix.is_some_and(|(opcode, length)| is_known(opcode) && length <= left_bytes))
}

/// The offset of the next intact chunk with messages, or of the record that ends the data.
pub(crate) fn next_landmark(file: &File, from: u64) -> McapResult<Option<u64>> {
    let file_bytes = file.metadata()?.len();
    let mut begin = from;
    while begin + (PREFIX_BYTES as u64) < file_bytes {
        let window = read_at(file, begin, WINDOW_BYTES.min(file_bytes - begin))?;
        let prefixes = window.windows(PREFIX_BYTES).filter_map(<[u8]>::first_chunk);
        for (offset, prefix) in (begin..).zip(prefixes) {
            let (opcode, length) = with_prefix(split_prefix(prefix));
            if length <= file_bytes - offset && is_landmark(file, offset, opcode, length)? {
                return Ok(Some(offset));
            }
        }
        begin += (window.len() - PREFIX_BYTES + 1) as u64;
    }
    Ok(None)
}

fn is_landmark(file: &File, offset: u64, opcode: u8, length: u64) -> McapResult<bool> {
    match opcode {
        op::CHUNK => {
            let block = Block { offset, length, first: 0, last: 0, extent: Extent::Whole };
            Ok(block.load(file).is_ok_and(|contents| !contents.entries.is_empty()))
        }
        op::DATA_END if length == DATA_END_BYTES => is_record(file, offset + length),
        _ => Ok(false),
    }
}
