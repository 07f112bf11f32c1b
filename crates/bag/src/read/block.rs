//! A block of records in a file: a chunk, or consecutive messages outside of chunks.

use std::fs::File;

use bytes::Bytes;
use mcap::records::op;
use mcap::{McapError, McapResult};

use crate::read::chunk::{CHECKSUM_END, Extent, has_checksum, unpack};
use crate::read::fields::Fields;
use crate::read::records::{PREFIX_BYTES, RawRecord, Records, read_at};

/// The most messages in a chunk: writers close a chunk after a few megabytes.
const MOST_MESSAGES: usize = 2_000_000;

/// The location and the time range of a block of records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    /// The block's offset in the file [bytes].
    pub offset: u64,
    /// The block's length [bytes].
    pub length: u64,
    /// The first log time in the block [ns].
    pub first: u64,
    /// The last log time in the block [ns].
    pub last: u64,
    /// Whether the block is completely in the file.
    pub extent: Extent,
}

/// The messages of a block by log time; those with equal times are in file order.
#[derive(Clone, Debug)]
pub(crate) struct Contents {
    pub entries: Vec<Entry>,
    pub records: Bytes,
}

/// One message of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub channel: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    /// The start of the message's bytes in the contents.
    pub start: usize,
    /// The end of the message's bytes in the contents.
    pub end: usize,
}

impl Entry {
    /// Parses the header of a message record.
    fn read(body: &[u8], body_at: usize) -> McapResult<Entry> {
        let mut fields = Fields::new(body);
        Ok(Entry {
            channel: fields.u16()?,
            sequence: fields.u32()?,
            log_time: fields.u64()?,
            publish_time: fields.u64()?,
            start: body_at + body.len() - fields.rest().len(),
            end: body_at + body.len(),
        })
    }
}

impl Block {
    /// Reads the records of the block; a chunk is decompressed.
    pub(crate) fn records(&self, file: &File) -> McapResult<Bytes> {
        let bytes = Bytes::from(read_at(file, self.offset, self.length)?);
        match bytes.first() {
            Some(&op::CHUNK) if bytes.len() >= PREFIX_BYTES => {
                unpack(&bytes.slice(PREFIX_BYTES..), self.extent)
            }
            Some(&op::MESSAGE) => Ok(bytes),
            _ => Err(McapError::BadIndex),
        }
    }

    /// Whether a checksum protects the block's messages.
    pub(crate) fn has_checksum(&self, file: &File) -> bool {
        let head = PREFIX_BYTES as u64 + CHECKSUM_END;
        let head = read_at(file, self.offset, self.length.min(head)).unwrap_or_default();
        head.first() == Some(&op::CHUNK) && has_checksum(&head[PREFIX_BYTES.min(head.len())..])
    }

    /// Reads the messages of the block.
    pub(crate) fn load(&self, file: &File) -> McapResult<Contents> {
        let records = self.records(file)?;
        let is_message = |record: &McapResult<RawRecord<'_>>| {
            record.as_ref().is_ok_and(|record| record.opcode == op::MESSAGE)
        };
        let count = Records::new(&records).filter(is_message).count();
        if count > MOST_MESSAGES {
            return Err(McapError::ChunkTooLarge(records.len() as u64));
        }
        let mut entries = Vec::with_capacity(count);
        for record in Records::new(&records) {
            match record {
                Ok(record) if record.opcode == op::MESSAGE => {
                    entries.push(Entry::read(record.body, record.body_at)?);
                }
                Ok(_) => {}
                Err(_) if self.extent == Extent::Cut => break,
                Err(error) => return Err(error),
            }
        }
        // Messages with equal times stay in file order; sorting in place needs no memory.
        entries.sort_unstable_by_key(|entry: &Entry| (entry.log_time, entry.start));
        Ok(Contents { entries, records })
    }
}
