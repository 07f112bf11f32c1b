//! The index at the end of a file.

use std::io::Write;

use mcap::records::op;
use mcap::{MAGIC, McapResult};

use super::out::Out;
use super::records::{number, numbers, record};

/// The index at the end of a file being written: the location of each group of records in it.
pub(super) struct Summary {
    begin: u64,
    groups: Vec<(u8, u64, u64)>,
}

impl Summary {
    pub(super) fn begin<W: Write>(out: &Out<W>) -> Summary {
        Summary { begin: out.len(), groups: Vec::new() }
    }

    /// Writes the records of one kind, and notes their location.
    pub(super) fn group<W: Write>(
        &mut self,
        out: &mut Out<W>,
        opcode: u8,
        put: impl FnOnce(&mut Out<W>) -> McapResult<()>,
    ) -> McapResult<()> {
        let begin = out.len();
        put(out)?;
        if out.len() > begin {
            self.groups.push((opcode, begin, out.len() - begin));
        }
        Ok(())
    }

    /// Writes the locations of the groups, and the footer.
    pub(super) fn end<W: Write>(self, out: &mut Out<W>) -> McapResult<()> {
        let offsets_at = out.len();
        for (opcode, begin, length) in self.groups {
            out.record(op::SUMMARY_OFFSET, |out| {
                out.push(opcode);
                numbers(out, [begin, length]);
            })?;
        }
        let mut footer = Vec::new();
        record(&mut footer, op::FOOTER, |out| {
            numbers(out, [self.begin, offsets_at]);
            number(out, [0; 4]);
        });
        // The checksum covers the index up to itself.
        footer.truncate(footer.len() - 4);
        out.put(&footer)?;
        let crc = out.restart_crc();
        out.put(&crc.to_le_bytes())?;
        out.put(MAGIC)
    }
}
