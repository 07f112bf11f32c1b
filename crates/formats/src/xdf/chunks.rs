//! The chunks of a file.

use super::MAGIC;
use super::unread::Unread;
use crate::cursor::Cursor;
use crate::error::FormatError;

/// The content of a boundary chunk, which `LabRecorder` writes about every 10 s, so that readers can continue after
/// damage.
const BOUNDARY: [u8; 16] = [
    0x43, 0xA5, 0x46, 0xDC, 0xCB, 0xF5, 0x41, 0x0F, 0xB3, 0x0E, 0xD5, 0x46, 0x73, 0x83, 0xCB, 0xE4,
];

/// The kind of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tag {
    FileHeader,
    StreamHeader,
    Samples,
    ClockOffset,
    Boundary,
    StreamFooter,
}

/// A chunk.
pub(super) struct Chunk<'a> {
    pub(super) tag: Tag,
    pub(super) content: Cursor<'a>,
}

/// Reads the chunks in order.
pub(super) struct Chunks<'a> {
    file: &'a [u8],
    /// The offset of the last chunk.
    start: usize,
    /// The offset of the next chunk; the same as `start` if the length of the last chunk can't be read.
    end: usize,
    /// Whether the file ends within the last chunk, according to its length.
    is_cut: bool,
    unread: Unread,
}

impl<'a> Chunks<'a> {
    pub(super) fn new(file: &'a [u8]) -> Result<Chunks<'a>, FormatError> {
        if !file.starts_with(MAGIC) {
            return Err(FormatError::malformed("its first bytes", "", "XDF:"));
        }
        let at = MAGIC.len();
        Ok(Chunks { file, start: at, end: at, is_cut: false, unread: Unread::default() })
    }

    /// The next chunk; `None` at the end. Call [`Chunks::skip`] after a chunk that can't be read, or whose content
    /// can't.
    pub(super) fn next(&mut self) -> Option<Result<Chunk<'a>, FormatError>> {
        self.start = self.end;
        let rest = &self.file[self.start..];
        if rest.is_empty() {
            return None;
        }
        let frame = Frame::read(rest);
        self.is_cut = matches!(frame, Err(FormatError::Short(_)));
        Some(frame.and_then(|frame| {
            self.end += frame.length;
            frame.chunk()
        }))
    }

    /// Skips a chunk that can't be read: its length is trusted if another chunk follows it; otherwise everything up to
    /// the next boundary is skipped. Without a boundary, the rest of the file is unreadable.
    pub(super) fn skip(&mut self) {
        let is_followed = self.end > self.start
            && Frame::read(&self.file[self.end..]).and_then(Frame::chunk).is_ok();
        if is_followed {
            self.unread.skipped(self.start..self.end);
        } else if let Some(boundary) = self.boundary() {
            self.unread.skipped(self.start..boundary);
            self.end = boundary + BOUNDARY.len();
        } else {
            self.end = self.file.len();
            self.unread.rest(self.start..self.end, self.is_cut);
        }
    }

    /// The bytes that were skipped.
    pub(super) fn unread(&self) -> &Unread {
        &self.unread
    }

    /// The offset of the next boundary after the start of the last chunk.
    fn boundary(&self) -> Option<usize> {
        let mut places = self.file[self.start..].windows(BOUNDARY.len());
        Some(self.start + places.position(|bytes| bytes == BOUNDARY)?)
    }
}

/// A chunk whose tag may be unknown.
struct Frame<'a> {
    tag: u16,
    content: &'a [u8],
    /// The length of the chunk, including its prefix [bytes].
    length: usize,
}

impl<'a> Frame<'a> {
    /// Reads the first chunk of `bytes`; the error is [`FormatError::Short`] only if they end within it.
    fn read(bytes: &'a [u8]) -> Result<Frame<'a>, FormatError> {
        let mut rest = Cursor::new(bytes, "a chunk");
        let length = length(&mut rest)?.checked_sub(2).ok_or_else(|| {
            FormatError::malformed(
                "the length of a chunk",
                "0 or 1",
                "2 bytes or more, for its tag",
            )
        })?;
        let tag = rest.u16()?;
        let content = rest.length(length).or_else(|short| Tag::of(tag).and(Err(short)))?;
        Ok(Frame { tag, content, length: bytes.len() - rest.rest().len() })
    }

    fn chunk(self) -> Result<Chunk<'a>, FormatError> {
        let tag = Tag::of(self.tag)?;
        if tag == Tag::Boundary && self.content != BOUNDARY {
            return Err(FormatError::malformed("a boundary", "other bytes", "its fixed bytes"));
        }
        Ok(Chunk { tag, content: Cursor::new(self.content, "a chunk") })
    }
}

impl Tag {
    fn of(number: u16) -> Result<Tag, FormatError> {
        Ok(match number {
            1 => Tag::FileHeader,
            2 => Tag::StreamHeader,
            3 => Tag::Samples,
            4 => Tag::ClockOffset,
            5 => Tag::Boundary,
            6 => Tag::StreamFooter,
            other => {
                return Err(FormatError::malformed(
                    "the tag of a chunk",
                    &other.to_string(),
                    "1 to 6",
                ));
            }
        })
    }
}

/// Reads a length of one, four or eight bytes, preceded by its size.
pub(super) fn length(file: &mut Cursor<'_>) -> Result<u64, FormatError> {
    match file.u8()? {
        1 => file.u8().map(u64::from),
        4 => file.u32().map(u64::from),
        8 => file.array().map(u64::from_le_bytes),
        other => {
            let found = other.to_string();
            Err(FormatError::malformed("the width of a length field", &found, "1, 4 or 8 bytes"))
        }
    }
}
