//! The records of an MCAP file, in order.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use mcap::{McapError, McapResult};

/// The length of the prefix of a record: its opcode and its length [bytes].
pub(crate) const PREFIX_BYTES: usize = 9;
/// The most bytes in a record or a chunk: a damaged length must not exhaust the memory.
pub(crate) const LIMIT_BYTES: u64 = 256 << 20;

/// Iterates over the records in a buffer. The first incomplete record yields an error and ends the iteration.
#[derive(Clone, Debug)]
pub(crate) struct Records<'a> {
    bytes: &'a [u8],
    at: usize,
}

/// A record in a buffer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawRecord<'a> {
    /// The record's opcode.
    pub opcode: u8,
    /// The record's contents.
    pub body: &'a [u8],
    /// The offset of the contents in the buffer.
    pub body_at: usize,
}

impl<'a> Records<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Records<'a> {
        Records { bytes, at: 0 }
    }

    fn record(&mut self) -> McapResult<RawRecord<'a>> {
        let rest = &self.bytes[self.at..];
        let (prefix, rest) = rest.split_first_chunk().ok_or(McapError::UnexpectedEof)?;
        let (opcode, length) = split_prefix(prefix);
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let body = rest.get(..length).ok_or(McapError::UnexpectedEof)?;
        let body_at = self.at + PREFIX_BYTES;
        self.at = body_at + length;
        Ok(RawRecord { opcode, body, body_at })
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = McapResult<RawRecord<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.at == self.bytes.len() {
            return None;
        }
        let record = self.record();
        if record.is_err() {
            self.at = self.bytes.len();
        }
        Some(record)
    }
}

/// Splits a prefix into opcode and length.
pub(crate) fn split_prefix(prefix: &[u8; PREFIX_BYTES]) -> (u8, u64) {
    let [opcode, length @ ..] = *prefix;
    (opcode, u64::from_le_bytes(length))
}

/// Reads a part of a file; fails if it is too long, or extends beyond the end.
pub(crate) fn read_at(file: &File, offset: u64, length: u64) -> McapResult<Vec<u8>> {
    if length > LIMIT_BYTES {
        return Err(McapError::ChunkTooLarge(length));
    }
    let file_bytes = file.metadata()?.len();
    if offset.checked_add(length).is_none_or(|end| end > file_bytes) {
        return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
    }
    let mut bytes = vec![0; length as usize];
    file.read_exact_at(&mut bytes, offset)?;
    Ok(bytes)
}
