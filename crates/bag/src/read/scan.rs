//! Scans a whole file, if it has no index.

use std::io;

use mcap::records::op;
use mcap::{MAGIC, McapError, McapResult};
use teampulse_core::time::Time;

use crate::read::block::Block;
use crate::read::chunk::Extent;
use crate::read::index::{Damage, Index};
use crate::read::landmark::{is_known, is_record, next_landmark, prefix_at};
use crate::read::parse;
use crate::read::records::{PREFIX_BYTES, Records, read_at};

/// The approximate size of the blocks in which messages outside of chunks are read [bytes].
const RUN_BYTES: u64 = 1 << 20;

/// Finds the contents of a file by reading it from the start; after invalid bytes it continues with the
/// next intact chunk.
pub(crate) fn scan(index: Index) -> io::Result<Index> {
    let file_bytes = index.file.metadata()?.len();
    let at = MAGIC.len() as u64;
    let mut scan = Scan { index, file_bytes, at, checked: at, is_over: false, run: None };
    let ended = loop {
        match scan.step() {
            Ok(true) => {}
            Ok(false) => break scan.end_run(),
            Err(error) => break scan.end_run().and(Err(error)),
        }
    };
    if let Err(McapError::Io(error)) = ended
        && error.kind() != io::ErrorKind::UnexpectedEof
    {
        return Err(error);
    }
    Ok(scan.index)
}

struct Scan {
    index: Index,
    file_bytes: u64,
    at: u64,
    /// The offset up to which the messages are known to be intact [bytes].
    checked: u64,
    /// Whether the end of the data was reached, so that the summary follows.
    is_over: bool,
    /// The offset of a block of messages outside of chunks.
    run: Option<u64>,
}

impl Scan {
    /// Reads the next record; returns whether another may follow.
    fn step(&mut self) -> McapResult<bool> {
        match prefix_at(&self.index.file, self.at)? {
            None => self.resume("the file ends without an index", true),
            Some((opcode, _)) if !is_known(opcode) => {
                self.resume(&format!("0x{opcode:02x} is not a kind of record"), false)
            }
            Some((_, length)) if length > self.left_bytes() => {
                self.resume("the file ends inside a record", true)
            }
            Some((opcode, length)) => self.take(opcode, length),
        }
    }

    /// Handles a complete record.
    fn take(&mut self, opcode: u8, length: u64) -> McapResult<bool> {
        if opcode == op::MESSAGE {
            self.extend_run(length)?;
            return Ok(true);
        }
        self.end_run()?;
        match opcode {
            op::CHUNK => return self.take_chunk(length),
            op::SCHEMA | op::CHANNEL => self.define(length)?,
            op::ATTACHMENT | op::METADATA => self.index.extra(opcode, (self.at, length)),
            op::STATISTICS => self.take_statistics(length)?,
            op::DATA_END => self.is_over = true,
            op::FOOTER => return Ok(false),
            _ => {}
        }
        self.at += length;
        Ok(true)
    }

    /// Handles a chunk; the length of an unreadable chunk is trusted if a record follows it.
    fn take_chunk(&mut self, length: u64) -> McapResult<bool> {
        match self.add(self.block(length, Extent::Whole)) {
            Err(McapError::Io(error)) => return Err(error.into()),
            Err(error) if !is_record(&self.index.file, self.at + length)? => {
                return self.resume(&error.to_string(), false);
            }
            Err(error) => self.damaged(self.at, length, &error.to_string()),
            Ok(()) => {}
        }
        self.at += length;
        Ok(true)
    }

    /// Continues at the next landmark after invalid bytes. If there is none, the file ends here; `is_cut` marks it as
    /// unfinished rather than damaged.
    fn resume(&mut self, reason: &str, is_cut: bool) -> McapResult<bool> {
        self.end_run()?;
        if self.is_over {
            return Ok(false);
        }
        if let Some(found) = next_landmark(&self.index.file, self.checked)? {
            let lost_from = if found < self.at { self.checked } else { self.at };
            self.damaged(lost_from, found - lost_from, reason);
            (self.at, self.checked) = (found, found + 1);
            return Ok(true);
        }
        if is_cut {
            self.take_cut()?;
        }
        self.damaged(self.at, self.left_bytes(), reason);
        if let Some(damage) = self.index.damage.last_mut() {
            damage.is_tail = is_cut;
        }
        Ok(false)
    }

    /// Handles a chunk truncated by the end of the file.
    fn take_cut(&mut self) -> McapResult<()> {
        match prefix_at(&self.index.file, self.at)? {
            Some((op::CHUNK, _)) => match self.add(self.block(self.left_bytes(), Extent::Cut)) {
                Err(McapError::Io(error)) => Err(error.into()),
                // The chunk is truncated before its first record: `resume` reports the missing end once.
                _ => Ok(()),
            },
            _ => Ok(()),
        }
    }

    fn take_statistics(&mut self, length: u64) -> McapResult<()> {
        let bytes = read_at(&self.index.file, self.at, length)?;
        self.index.stated_messages =
            parse::statistics(&bytes[PREFIX_BYTES..]).ok().map(|t| t.messages);
        Ok(())
    }

    fn extend_run(&mut self, length: u64) -> McapResult<()> {
        let begun = *self.run.get_or_insert(self.at);
        self.at += length;
        if self.at - begun >= RUN_BYTES { self.end_run() } else { Ok(()) }
    }

    /// Closes the block of messages since the last chunk.
    fn end_run(&mut self) -> McapResult<()> {
        let Some(begun) = self.run.take() else { return Ok(()) };
        let end = std::mem::replace(&mut self.at, begun);
        let taken = self.take_block(end - begun, Extent::Whole);
        self.at = end;
        taken
    }

    /// Adds a block at the current offset; an unreadable block is recorded as damage.
    fn take_block(&mut self, length: u64, extent: Extent) -> McapResult<()> {
        match self.add(self.block(length, extent)) {
            Err(McapError::Io(error)) => Err(error.into()),
            Err(error) => {
                self.damaged(self.at, length, &error.to_string());
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    fn block(&self, length: u64, extent: Extent) -> Block {
        Block { offset: self.at, length, first: 0, last: 0, extent }
    }

    fn add(&mut self, mut block: Block) -> McapResult<()> {
        let contents = block.load(&self.index.file)?;
        self.checked = block.offset + block.length;
        for record in Records::new(&contents.records).map_while(Result::ok) {
            if matches!(record.opcode, op::SCHEMA | op::CHANNEL) {
                self.index.define(record.opcode, record.body)?;
            }
        }
        let (Some(first), Some(last)) = (contents.entries.first(), contents.entries.last()) else {
            return Ok(());
        };
        (block.first, block.last) = (first.log_time, last.log_time);
        let mut describes = false;
        for entry in &contents.entries {
            *self.index.counts.entry(entry.channel).or_default() += 1;
            self.index.span.take(Time::from_nanos(entry.log_time as i64));
            describes |= self.index.describes(entry.channel);
        }
        if describes {
            self.index.describing.push(self.index.blocks.len());
        }
        self.index.blocks.push(block);
        Ok(())
    }

    fn define(&mut self, length: u64) -> McapResult<()> {
        let bytes = read_at(&self.index.file, self.at, length)?;
        let (_, body) = bytes.split_at(PREFIX_BYTES);
        self.index.define(bytes[0], body)
    }

    fn left_bytes(&self) -> u64 {
        self.file_bytes.saturating_sub(self.at)
    }

    fn damaged(&mut self, offset: u64, lost_bytes: u64, reason: &str) {
        let reason = reason.to_owned();
        self.index.damage.push(Damage { offset, lost_bytes, reason, is_tail: false });
    }
}
