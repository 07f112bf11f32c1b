//! An MCAP file being written. Its contents are written immediately; only the open chunk and the index of
//! the channels are in memory, so that a recording of many hours needs no more memory than a short one.

use std::collections::{BTreeMap, HashMap};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use mcap::records::{MessageHeader, op};
use mcap::{MAGIC, McapError, McapResult};
use teampulse_core::stream::Schema;

use super::chunk::{Chunk, Compression, LARGE_BYTES, Packer};
use super::out::Out;
use super::part::Attachment;
use super::records::{all, counted, number, numbers, record, text};
use super::summary::Summary;
use crate::channel::Channel;
use crate::spill::Spill;

/// The size at which a chunk is closed [bytes], uncompressed.
pub(super) const CHUNK_BYTES: u64 = 768 << 10;

/// An MCAP file being written. Chunks are built in memory and written as a whole.
///
/// Format: <https://mcap.dev/spec>.
pub(super) struct McapFile<W: Write> {
    out: Out<W>,
    packer: Packer,
    chunk: Chunk,
    schemas: Vec<Arc<Schema>>,
    channels: Vec<CountedChannel>,
    /// The indices of the schemas and channels with each name.
    named_schemas: HashMap<String, Vec<usize>>,
    named_channels: HashMap<String, Vec<usize>>,
    /// The log times of the first and of the last message.
    times: Option<(u64, u64)>,
    chunks: Indexes,
    attachments: Indexes,
    metadata: Indexes,
}

/// A channel of the file, with its message count.
struct CountedChannel {
    channel: Channel,
    schema_id: u16,
    messages: u64,
}

/// The index entries of the file, by kind of record.
struct Indexes {
    entries: Spill,
    count: u32,
}

impl<W: Write> McapFile<W> {
    /// Starts a file that is written to `to`; its buffers spill to the disk of `folder`.
    pub(super) fn begin(to: W, folder: &Path, compression: Compression) -> McapResult<McapFile<W>> {
        let indexes = || Indexes { entries: Spill::new(folder), count: 0 };
        let mut file = McapFile {
            out: Out::new(to),
            packer: Packer::new(compression)?,
            chunk: Chunk::default(),
            schemas: Vec::new(),
            channels: Vec::new(),
            named_schemas: HashMap::new(),
            named_channels: HashMap::new(),
            times: None,
            chunks: indexes(),
            attachments: indexes(),
            metadata: indexes(),
        };
        file.out.put(MAGIC)?;
        file.out.record(op::HEADER, |out| {
            text(out, "ros2");
            text(out, concat!("teampulse/", env!("CARGO_PKG_VERSION")));
        })?;
        Ok(file)
    }

    /// Adds a channel, or finds an identical one.
    pub(super) fn channel(&mut self, channel: &Channel) -> McapResult<u16> {
        let mut named = self.named_channels.get(&channel.topic).into_iter().flatten();
        if let Some(place) = named.find(|place| self.channels[**place].channel == *channel) {
            return Ok(*place as u16);
        }
        let schema_id = self.schema(&channel.schema)?;
        let place = self.channels.len();
        let id = u16::try_from(place).ok().ok_or(McapError::TooManyChannels)?;
        self.chunk.add(op::CHANNEL, |out| put_channel(out, id, schema_id, channel));
        self.named_channels.entry(channel.topic.clone()).or_default().push(place);
        self.channels.push(CountedChannel { channel: channel.clone(), schema_id, messages: 0 });
        Ok(id)
    }

    /// The id of a schema; 0 if it has no name.
    fn schema(&mut self, schema: &Arc<Schema>) -> McapResult<u16> {
        if schema.name.is_empty() {
            return Ok(0);
        }
        let mut named = self.named_schemas.get(&schema.name).into_iter().flatten();
        let is_same =
            |known: &Schema| known.encoding == schema.encoding && known.text == schema.text;
        if let Some(place) = named.find(|place| is_same(&self.schemas[**place])) {
            return Ok(*place as u16 + 1);
        }
        let place = self.schemas.len();
        let id = u16::try_from(place + 1).ok().ok_or(McapError::TooManySchemas)?;
        self.chunk.add(op::SCHEMA, |out| put_schema(out, id, schema));
        self.named_schemas.entry(schema.name.clone()).or_default().push(place);
        self.schemas.push(Arc::clone(schema));
        Ok(id)
    }

    /// Appends a message to a channel of this file.
    pub(super) fn message(&mut self, header: &MessageHeader, data: &[u8]) -> McapResult<()> {
        self.out.check()?;
        if self.chunk.len() > CHUNK_BYTES {
            self.end_chunk()?;
        }
        let MessageHeader { channel_id, sequence, log_time, .. } = *header;
        let channel = self.channels.get_mut(usize::from(channel_id));
        channel.ok_or(McapError::UnknownChannel(sequence, channel_id))?.messages += 1;
        let (first, last) = self.times.unwrap_or((log_time, log_time));
        self.times = Some((first.min(log_time), last.max(log_time)));
        if data.len() <= LARGE_BYTES {
            self.chunk.add_message(header, data);
            return Ok(());
        }
        self.end_chunk()?;
        self.chunk.add_large(header, data.len());
        self.end_chunk_with(data)
    }

    /// Appends an attachment.
    pub(super) fn attach(&mut self, attachment: &Attachment<'_>) -> McapResult<()> {
        self.end_chunk()?;
        let Attachment { name, media_type, bytes, .. } = *attachment;
        let nanos = super::part::nanos(attachment.log_time);
        let begin = self.out.len();
        self.out.record(op::ATTACHMENT, |out| {
            let head = out.len();
            numbers(out, [nanos, nanos]);
            text(out, name);
            text(out, media_type);
            numbers(out, [bytes.len() as u64]);
            out.extend_from_slice(bytes);
            let crc = crc32fast::hash(&out[head..]);
            number(out, crc.to_le_bytes());
        })?;
        let length = self.out.len() - begin;
        self.attachments.add(op::ATTACHMENT_INDEX, |out| {
            numbers(out, [begin, length, nanos, nanos, bytes.len() as u64]);
            text(out, name);
            text(out, media_type);
        });
        Ok(())
    }

    /// Appends a metadata record.
    pub(super) fn annotate(
        &mut self,
        name: &str,
        metadata: &BTreeMap<String, String>,
    ) -> McapResult<()> {
        self.end_chunk()?;
        let begin = self.out.len();
        self.out.record(op::METADATA, |out| {
            text(out, name);
            put_words(out, metadata);
        })?;
        let length = self.out.len() - begin;
        self.metadata.add(op::METADATA_INDEX, |out| {
            numbers(out, [begin, length]);
            text(out, name);
        });
        Ok(())
    }

    /// Flushes all written data to the operating system.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.end_chunk()?;
        self.out.flush()
    }

    /// The most bytes that the index of the file needs, including the open chunk.
    pub(super) fn index_bytes(&self) -> u64 {
        let kinds = [&self.chunks, &self.attachments, &self.metadata];
        let ended: u64 = kinds.into_iter().map(|kind| kind.entries.len()).sum();
        ended + self.chunk.index_bytes()
    }

    /// Finishes the file with its index.
    pub(super) fn finish(&mut self) -> McapResult<()> {
        self.end_chunk()?;
        let crc = self.out.restart_crc();
        self.out.record(op::DATA_END, |out| number(out, crc.to_le_bytes()))?;
        self.out.restart_crc();
        let mut summary = Summary::begin(&self.out);
        let schemas = self.schemas.iter().zip(1_u16..);
        summary.group(&mut self.out, op::SCHEMA, |out| {
            schemas.clone().try_for_each(|(schema, id)| {
                out.record(op::SCHEMA, |out| put_schema(out, id, schema))
            })
        })?;
        let channels = self.channels.iter().zip(0_u16..);
        summary.group(&mut self.out, op::CHANNEL, |out| {
            channels.clone().try_for_each(|(CountedChannel { channel, schema_id, .. }, id)| {
                out.record(op::CHANNEL, |out| put_channel(out, id, *schema_id, channel))
            })
        })?;
        let statistics = self.statistics();
        summary.group(&mut self.out, op::STATISTICS, |out| {
            out.record(op::STATISTICS, |out| out.extend_from_slice(&statistics))
        })?;
        for (opcode, kind) in [
            (op::CHUNK_INDEX, &self.chunks),
            (op::ATTACHMENT_INDEX, &self.attachments),
            (op::METADATA_INDEX, &self.metadata),
        ] {
            summary.group(&mut self.out, opcode, |out| {
                Ok(kind.entries.read(|portion| out.write(portion))?)
            })?;
        }
        summary.end(&mut self.out)?;
        self.out.flush()
    }

    /// The statistics record of the file.
    fn statistics(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let (first, last) = self.times.unwrap_or((0, 0));
        let counts = self.channels.iter().zip(0_u16..);
        let counts = counts.map(|(channel, id)| (id, channel.messages));
        let counts = counts.filter(|(_, messages)| *messages > 0);
        numbers(&mut out, [counts.clone().map(|(_, messages)| messages).sum()]);
        number(&mut out, (self.schemas.len() as u16).to_le_bytes());
        let kinds = [self.attachments.count, self.metadata.count, self.chunks.count];
        for count in [self.channels.len() as u32].into_iter().chain(kinds) {
            number(&mut out, count.to_le_bytes());
        }
        numbers(&mut out, [first, last]);
        all(&mut out, counts, |out, (id, messages)| {
            number(out, id.to_le_bytes());
            numbers(out, [messages]);
        });
        out
    }

    fn end_chunk(&mut self) -> McapResult<()> {
        self.out.check()?;
        if self.chunk.is_empty() { Ok(()) } else { self.end_chunk_with(&[]) }
    }

    /// Closes the chunk with the contents of a large message, if it has one.
    fn end_chunk_with(&mut self, large: &[u8]) -> McapResult<()> {
        let out = &mut self.out;
        let begin = out.len();
        let ended = self.chunk.end(begin, large, &mut self.packer, |bytes| out.write(bytes));
        let entry = ended.inspect_err(|_| out.fail())?;
        self.chunks.entries.append(|kept| kept.extend_from_slice(&entry));
        self.chunks.count += 1;
        Ok(())
    }
}

impl Indexes {
    fn add(&mut self, opcode: u8, fill: impl FnOnce(&mut Vec<u8>)) {
        self.entries.append(|out| record(out, opcode, fill));
        self.count += 1;
    }
}

fn put_schema(out: &mut Vec<u8>, id: u16, schema: &Schema) {
    // In MCAP, a schema without text has no encoding either.
    let encoding = if schema.text.is_empty() { "" } else { &schema.encoding };
    number(out, id.to_le_bytes());
    text(out, &schema.name);
    text(out, encoding);
    counted(out, schema.text.as_bytes());
}

fn put_channel(out: &mut Vec<u8>, id: u16, schema_id: u16, channel: &Channel) {
    number(out, id.to_le_bytes());
    number(out, schema_id.to_le_bytes());
    text(out, &channel.topic);
    text(out, &channel.encoding);
    put_words(out, &channel.metadata);
}

fn put_words(out: &mut Vec<u8>, words: &BTreeMap<String, String>) {
    all(out, words, |out, (key, value)| {
        text(out, key);
        text(out, value);
    });
}
