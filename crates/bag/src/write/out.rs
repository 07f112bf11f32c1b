//! The output of a file, with its length and checksum.

use std::io::{self, BufWriter, Write};

use mcap::{McapError, McapResult};

use super::records::record;

/// The size of the buffer for small records [bytes].
const BUFFER_BYTES: usize = 64 << 10;

/// The output of a file. After a failed write everything is refused, as it is unknown how many of the bytes
/// were written.
pub(super) struct Out<W: Write> {
    to: BufWriter<W>,
    at: u64,
    crc: crc32fast::Hasher,
    has_failed: bool,
}

impl<W: Write> Out<W> {
    pub(super) fn new(to: W) -> Out<W> {
        let to = BufWriter::with_capacity(BUFFER_BYTES, to);
        Out { to, at: 0, crc: crc32fast::Hasher::new(), has_failed: false }
    }

    /// The number of bytes written.
    pub(super) fn len(&self) -> u64 {
        self.at
    }

    /// Fails if an earlier write failed.
    pub(super) fn check(&self) -> McapResult<()> {
        if self.has_failed { Err(McapError::AttemptedWriteAfterFailure) } else { Ok(()) }
    }

    /// Appends a record.
    pub(super) fn record(&mut self, opcode: u8, fill: impl FnOnce(&mut Vec<u8>)) -> McapResult<()> {
        let mut bytes = Vec::new();
        record(&mut bytes, opcode, fill);
        self.put(&bytes)
    }

    /// Appends bytes.
    pub(super) fn put(&mut self, bytes: &[u8]) -> McapResult<()> {
        self.check()?;
        Ok(self.write(bytes)?)
    }

    /// Appends bytes without checking for earlier failures.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = self.to.write_all(bytes);
        self.has_failed |= written.is_err();
        self.crc.update(bytes);
        self.at += bytes.len() as u64;
        written
    }

    /// Refuses all further writes.
    pub(super) fn fail(&mut self) {
        self.has_failed = true;
    }

    /// Flushes all written data to the operating system.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.check()?;
        let flushed = self.to.flush();
        self.has_failed |= flushed.is_err();
        Ok(flushed?)
    }

    /// The checksum of the bytes since the last call.
    pub(super) fn restart_crc(&mut self) -> u32 {
        std::mem::replace(&mut self.crc, crc32fast::Hasher::new()).finalize()
    }
}
