//! The contents of one file of a bag: from its index or, if there is none, by reading the whole file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use mcap::records::op;
use mcap::{MAGIC, McapError, McapResult};
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;

use crate::channel::{Channel, type_hash};
use crate::claim::is_claimed;
use crate::error::{BagError, Found};
use crate::metadata::{ParsedMetadata, ROSBAG2_RECORD, SERIALIZED_KEY, Span};
use crate::read::block::Block;
use crate::read::foreign::{self, Opened, is_packed};
use crate::read::parse::{self, ChannelRecord, Statistics};
use crate::read::records::{PREFIX_BYTES, RawRecord, Records, read_at, split_prefix};
use crate::read::scan::scan;
use crate::schema::is_description;

/// The length of the footer and the magic bytes after it [bytes].
const FOOTER_BYTES: u64 = 37;

/// The contents of one file, with their locations.
#[derive(Debug)]
pub(crate) struct Index {
    pub path: PathBuf,
    pub file: File,
    /// Whether `file` was converted from the file at `path`.
    pub is_made: bool,
    /// Whether the file was still being written when it was opened, so that its end may be missing.
    pub is_open: bool,
    /// Whether any of the file's messages have no checksum; known once the file was checked.
    pub lacks_checksums: bool,
    pub blocks: Vec<Block>,
    pub channels: BTreeMap<u16, Arc<Channel>>,
    pub counts: BTreeMap<u16, u64>,
    pub span: Span,
    /// The indices of blocks that contain stream descriptions.
    pub describing: Vec<usize>,
    /// Attachments and metadata records.
    pub extras: Vec<Extra>,
    pub damage: Vec<Damage>,
    /// The number of messages according to the statistics of the file.
    pub stated_messages: Option<u64>,
    schemas: BTreeMap<u16, Arc<Schema>>,
}

/// A record other than a message: an attachment or a metadata record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Extra {
    pub opcode: u8,
    pub offset: u64,
    /// The length of the record, including the prefix [bytes].
    pub length: u64,
}

/// A damaged part of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The offset of the damage in the file [bytes].
    pub offset: u64,
    /// The number of bytes that can't be read; 0 if only the index is missing.
    pub lost_bytes: u64,
    /// What was expected and found.
    pub reason: String,
    /// Whether only the end of an unfinished file is missing.
    pub is_tail: bool,
}

impl Index {
    /// Finds the contents of a file; a truncated or damaged file is read as far as possible.
    pub(crate) fn open(path: &Path) -> Result<Index, BagError> {
        let index = Index::of(path, foreign::open(path)?)?;
        if !index.begins_packed() {
            return Ok(index);
        }
        let mut plain = Index::of(path, foreign::with_plain_messages(&index)?)?;
        plain.damage.splice(0..0, index.damage);
        Ok(plain)
    }

    fn of(path: &Path, opened: Opened) -> Result<Index, BagError> {
        let Opened { file, is_made, damage } = opened;
        check_magic(path, &file)?;
        let mut index = Index::read(path, file)?;
        index.is_made = is_made;
        index.damage.extend(damage.map(|reason| Damage {
            offset: 0,
            lost_bytes: 0,
            reason,
            is_tail: false,
        }));
        Ok(index)
    }

    /// Whether the file has no bytes, and nobody is writing it.
    pub(crate) fn is_empty_file(&self) -> bool {
        !self.is_open && self.file.metadata().is_ok_and(|file| file.len() == 0)
    }

    /// Whether the first message, and so every message, was compressed individually.
    fn begins_packed(&self) -> bool {
        let is_own = |channel: &Arc<Channel>| !channel.is_foreign();
        if self.channels.values().any(is_own) {
            return false;
        }
        let first = self.blocks.iter().find_map(|block| block.load(&self.file).ok());
        first.is_some_and(|contents| {
            let entry = contents.entries.first();
            entry.is_some_and(|entry| is_packed(&contents.records[entry.start..entry.end]))
        })
    }

    fn read(path: &Path, file: File) -> Result<Index, BagError> {
        let is_open = is_claimed(&file);
        let mut index = Index::empty(path, file);
        let Err(error) = index.read_summary() else { return Ok(index) };
        let scanned = scan(Index::empty(path, index.file));
        let mut index = scanned.map_err(BagError::io("read", path))?;
        if is_open {
            index.is_open = true;
            index.damage.retain(|damage| !damage.is_tail);
            return Ok(index);
        }
        // An index is optional. A file that should have one but does not is damaged.
        if index.damage.is_empty() && !matches!(error, McapError::BadIndex) {
            index.damage.push(Damage {
                offset: index.file.metadata().map_err(BagError::io("read", path))?.len(),
                lost_bytes: 0,
                reason: error.to_string(),
                is_tail: true,
            });
        }
        Ok(index)
    }

    fn empty(path: &Path, file: File) -> Index {
        Index {
            path: path.to_owned(),
            file,
            is_made: false,
            is_open: false,
            lacks_checksums: false,
            blocks: Vec::new(),
            channels: BTreeMap::new(),
            counts: BTreeMap::new(),
            span: Span::default(),
            describing: Vec::new(),
            extras: Vec::new(),
            damage: Vec::new(),
            stated_messages: None,
            schemas: BTreeMap::new(),
        }
    }

    /// Reads the summary at the end of the file. Fails if it is missing or incomplete.
    fn read_summary(&mut self) -> McapResult<()> {
        let summary = read_summary(&self.file)?;
        let (mut chunks, mut statistics) = (Vec::new(), None);
        for record in Records::new(&summary) {
            let RawRecord { opcode, body, .. } = record?;
            match opcode {
                op::CHUNK_INDEX => chunks.push(parse::chunk_index(body)?),
                op::STATISTICS => statistics = Some(parse::statistics(body)?),
                op::ATTACHMENT_INDEX => self.extra(op::ATTACHMENT, parse::extra_index(body)?),
                op::METADATA_INDEX => self.extra(op::METADATA, parse::extra_index(body)?),
                _ => self.define(opcode, body)?,
            }
        }
        let statistics = statistics.ok_or(McapError::BadIndex)?;
        if !self.is_complete(&statistics, chunks.len()) {
            return Err(McapError::BadIndex);
        }
        chunks.sort_by_key(|(chunk, _)| chunk.offset);
        for (chunk, channels) in chunks {
            if channels.keys().any(|id| self.describes(*id)) {
                self.describing.push(self.blocks.len());
            }
            self.blocks.push(chunk);
        }
        self.span = span(&statistics);
        self.stated_messages = Some(statistics.messages);
        self.counts = statistics.counts;
        Ok(())
    }

    /// Whether the summary lists everything in the file.
    fn is_complete(&self, statistics: &Statistics, chunks: usize) -> bool {
        statistics.channels as usize == self.channels.len()
            && statistics.chunks as usize == chunks
            && (statistics.messages == 0 || chunks > 0)
            && statistics.counts.values().try_fold(0_u64, |all, count| all.checked_add(*count))
                == Some(statistics.messages)
    }

    /// Reads all messages. Records unreadable blocks as damage, and whether any messages lack a checksum.
    pub(crate) fn check(&mut self) {
        // Neither SQLite files nor ROS 1 bags have checksums.
        let is_mcap = |path: &Path| path.to_string_lossy().ends_with(".mcap.zstd");
        self.lacks_checksums = self.is_made && !is_mcap(&self.path);
        for block in &self.blocks {
            self.lacks_checksums |= !block.has_checksum(&self.file);
            if let Err(error) = block.load(&self.file) {
                self.damage.push(Damage {
                    offset: block.offset,
                    lost_bytes: block.length,
                    reason: error.to_string(),
                    is_tail: false,
                });
            }
        }
    }

    /// Whether a channel carries stream descriptions.
    pub(crate) fn describes(&self, id: u16) -> bool {
        let channel = self.channels.get(&id);
        channel.is_some_and(|channel| is_description(&channel.topic, &channel.schema.name))
    }

    /// Stores a schema or a channel; other records are ignored.
    pub(crate) fn define(&mut self, opcode: u8, body: &[u8]) -> McapResult<()> {
        match opcode {
            op::SCHEMA => {
                let (id, schema) = parse::schema(body)?;
                self.schemas.entry(id).or_insert_with(|| Arc::new(schema));
            }
            op::CHANNEL => {
                let record = parse::channel(body)?;
                let id = record.id;
                let channel = self.channel(record);
                self.channels.entry(id).or_insert_with(|| Arc::new(channel));
            }
            _ => {}
        }
        Ok(())
    }

    fn channel(&self, record: ChannelRecord) -> Channel {
        let ChannelRecord { schema_id, topic, encoding, metadata, .. } = record;
        let mut schema = match self.schemas.get(&schema_id) {
            Some(schema) => Schema::clone(schema),
            None => Schema {
                name: String::new(),
                encoding: String::new(),
                text: String::new(),
                hash: String::new(),
            },
        };
        schema.hash = type_hash(&metadata);
        Channel { topic, schema: Arc::new(schema), encoding, metadata }
    }

    pub(crate) fn extra(&mut self, opcode: u8, (offset, length): (u64, u64)) {
        self.extras.push(Extra { opcode, offset, length });
    }

    /// The contents of an attachment or metadata record.
    pub(crate) fn read_extra(&self, extra: &Extra) -> McapResult<Bytes> {
        let bytes = Bytes::from(read_at(&self.file, extra.offset, extra.length)?);
        let record = Records::new(&bytes).next().ok_or(McapError::UnexpectedEof)??;
        if record.opcode != extra.opcode {
            return Err(McapError::BadIndex);
        }
        Ok(bytes.slice_ref(record.body))
    }

    /// The notes of a recording in a metadata record with a copy of `metadata.yaml`.
    pub(crate) fn read_notes(&self, extra: &Extra) -> Option<BTreeMap<String, String>> {
        let body = (extra.opcode == op::METADATA).then(|| self.read_extra(extra).ok())??;
        let (name, record) = parse::metadata(&body).ok()?;
        let text = record.get(SERIALIZED_KEY).filter(|_| name == ROSBAG2_RECORD)?;
        Some(ParsedMetadata::read_body(text).custom)
    }
}

fn span(statistics: &Statistics) -> Span {
    let time = |nanos: u64| Time::from_nanos(nanos as i64);
    Span {
        messages: statistics.messages,
        first: time(statistics.first),
        last: time(statistics.last),
    }
}

/// Checks that a file is MCAP, also one that is truncated within its first bytes; identifies other formats.
fn check_magic(path: &Path, file: &File) -> Result<(), BagError> {
    let length = file.metadata().map_err(BagError::io("open", path))?.len();
    let start = match read_at(file, 0, length.min(16)) {
        Ok(start) => start,
        Err(McapError::Io(error)) if error.kind() != ErrorKind::UnexpectedEof => {
            return Err(BagError::io("open", path)(error));
        }
        Err(_) => Vec::new(),
    };
    let found = match start.as_slice() {
        start if start.iter().zip(MAGIC).all(|(is, expected)| is == expected) => return Ok(()),
        start if start.starts_with(b"SQLite format 3") => Found::Sqlite,
        // The magic number of a Zstandard frame.
        [0x28, 0xb5, 0x2f, 0xfd, ..] => Found::Compressed,
        _ => Found::Other,
    };
    Err(BagError::NotABag { path: path.to_owned(), found })
}

/// Reads the summary section, and verifies its checksum.
fn read_summary(file: &File) -> McapResult<Vec<u8>> {
    let footer_at = file.metadata()?.len().checked_sub(FOOTER_BYTES);
    let footer_at = footer_at.ok_or(McapError::UnexpectedEof)?;
    let footer = read_at(file, footer_at, FOOTER_BYTES)?;
    let (record, magic) = footer.split_at(PREFIX_BYTES + 20);
    if magic != MAGIC {
        return Err(McapError::BadMagic);
    }
    let (prefix, body) = record.split_first_chunk().ok_or(McapError::BadFooter)?;
    let (op::FOOTER, 20) = split_prefix(prefix) else { return Err(McapError::BadFooter) };
    let (summary_start, summary_crc) = parse::footer(body)?;
    // In MCAP, zero means that there is no summary.
    if summary_start == 0 {
        return Err(McapError::BadIndex);
    }
    let length = footer_at.checked_sub(summary_start).ok_or(McapError::BadFooter)?;
    let summary = read_at(file, summary_start, length)?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(&summary);
    crc.update(&record[..record.len() - 4]);
    let calculated = crc.finalize();
    match summary_crc {
        0 => Ok(summary),
        saved if saved == calculated => Ok(summary),
        saved => Err(McapError::BadSummaryCrc { saved, calculated }),
    }
}
