//! The chunks of a file.

use super::MAGIC;
use crate::cursor::Cursor;
use crate::error::FormatError;

/// The kind of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tag {
    FileHeader,
    StreamHeader,
    Samples,
    ClockOffset,
    Other,
}

/// A chunk.
pub(super) struct Chunk<'a> {
    pub(super) tag: Tag,
    pub(super) content: Cursor<'a>,
}

/// The chunks in order.
pub(super) struct Chunks<'a> {
    file: Cursor<'a>,
    is_cut_off: bool,
}

impl<'a> Chunks<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Result<Chunks<'a>, FormatError> {
        let mut file = Cursor::new(bytes, "a chunk");
        if file.take(MAGIC.len())? != MAGIC {
            return Err(FormatError::malformed("its first bytes", "", "XDF:"));
        }
        Ok(Chunks { file, is_cut_off: false })
    }

    pub(super) fn is_cut_off(&self) -> bool {
        self.is_cut_off
    }

    /// The next chunk; `None` at the end, or if a chunk is incomplete.
    pub(super) fn next(&mut self) -> Option<Chunk<'a>> {
        if self.file.is_empty() || self.is_cut_off {
            return None;
        }
        let chunk = self.read().ok();
        self.is_cut_off = chunk.is_none();
        chunk
    }

    fn read(&mut self) -> Result<Chunk<'a>, FormatError> {
        let length = length(&mut self.file)?;
        let mut content = Cursor::new(self.file.length(length)?, "a chunk");
        let tag = match content.u16()? {
            1 => Tag::FileHeader,
            2 => Tag::StreamHeader,
            3 => Tag::Samples,
            4 => Tag::ClockOffset,
            _ => Tag::Other,
        };
        Ok(Chunk { tag, content })
    }
}

/// A length of one, four or eight bytes, preceded by that number.
pub(super) fn length(file: &mut Cursor<'_>) -> Result<u64, FormatError> {
    match file.u8()? {
        1 => file.u8().map(u64::from),
        4 => file.u32().map(u64::from),
        8 => file.array().map(u64::from_le_bytes),
        other => {
            let found = other.to_string();
            Err(FormatError::malformed("the size of a length", &found, "1, 4 or 8 bytes"))
        }
    }
}
