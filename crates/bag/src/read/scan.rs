//! Reading a whole file for what it holds: the way into files without an index.

use std::io;
use std::os::unix::fs::FileExt;

use mcap::records::op;
use mcap::{MAGIC, McapError, McapResult};
use teampulse_core::time::Time;

use crate::read::block::Block;
use crate::read::chunk::Extent;
use crate::read::index::{Damage, Index};
use crate::read::records::{PREFIX_BYTES, Records, read_at, split_prefix};

/// Messages that stand between chunks are read in runs of about this [bytes].
const RUN_BYTES: u64 = 1 << 20;

/// Finds out what a file holds by reading it from its beginning, to where it makes no more sense.
pub(crate) fn scan(index: Index) -> io::Result<Index> {
    let file_bytes = index.file.metadata()?.len();
    let mut scan = Scan { index, file_bytes, at: MAGIC.len() as u64, run: None };
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
    /// Where a run of messages between chunks began.
    run: Option<u64>,
}

impl Scan {
    /// Takes the next record; says whether another may follow.
    fn step(&mut self) -> McapResult<bool> {
        let left_bytes = self.file_bytes.saturating_sub(self.at);
        if left_bytes < PREFIX_BYTES as u64 {
            self.damaged(left_bytes, "the file ends without an index");
            return Ok(false);
        }
        let mut prefix = [0; PREFIX_BYTES];
        self.index.file.read_exact_at(&mut prefix, self.at)?;
        let (opcode, body_bytes) = split_prefix(&prefix);
        let length = body_bytes.saturating_add(PREFIX_BYTES as u64);
        if length > left_bytes {
            return self.take_cut(opcode, left_bytes).map(|()| false);
        }
        self.take(opcode, length)
    }

    /// Takes a record that is all there.
    fn take(&mut self, opcode: u8, length: u64) -> McapResult<bool> {
        if opcode == op::MESSAGE {
            self.extend_run(length)?;
            return Ok(true);
        }
        self.end_run()?;
        match opcode {
            op::CHUNK => self.take_block(length, Extent::Whole)?,
            op::SCHEMA | op::CHANNEL => self.define(length)?,
            op::ATTACHMENT | op::METADATA => self.index.extra(opcode, (self.at, length)),
            op::DATA_END => return Ok(false),
            op::HEADER | op::MESSAGE_INDEX | 0x80.. => {}
            other => {
                let left_bytes = self.file_bytes - self.at;
                self.damaged(left_bytes, &format!("there is no kind of record 0x{other:02x}"));
                return Ok(false);
            }
        }
        self.at += length;
        Ok(true)
    }

    /// Takes what is there of a record that the file ends in.
    fn take_cut(&mut self, opcode: u8, left_bytes: u64) -> McapResult<()> {
        self.end_run()?;
        if opcode == op::CHUNK {
            self.take_block(left_bytes, Extent::Cut)?;
        }
        self.damaged(left_bytes, "the file ends inside a record");
        Ok(())
    }

    fn extend_run(&mut self, length: u64) -> McapResult<()> {
        let begun = *self.run.get_or_insert(self.at);
        self.at += length;
        if self.at - begun >= RUN_BYTES { self.end_run() } else { Ok(()) }
    }

    /// Makes a block of the messages since the last chunk.
    fn end_run(&mut self) -> McapResult<()> {
        let Some(begun) = self.run.take() else { return Ok(()) };
        let end = std::mem::replace(&mut self.at, begun);
        let taken = self.take_block(end - begun, Extent::Whole);
        self.at = end;
        taken
    }

    /// Takes a block at the current place; one that can't be read is noted as damage.
    fn take_block(&mut self, length: u64, extent: Extent) -> McapResult<()> {
        let block = Block { offset: self.at, length, first: 0, last: 0, extent };
        match self.add(block) {
            Err(McapError::Io(error)) => Err(error.into()),
            Err(error) => {
                self.damaged(length, &error.to_string());
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    fn add(&mut self, mut block: Block) -> McapResult<()> {
        let contents = block.load(&self.index.file)?;
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

    fn damaged(&mut self, lost_bytes: u64, reason: &str) {
        self.index.damage.push(Damage { offset: self.at, lost_bytes, reason: reason.to_owned() });
    }
}
