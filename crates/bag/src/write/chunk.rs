//! Chunks: records that are compressed together, and the offset of each message in them.

use std::io::{self, ErrorKind, Write};

use mcap::records::{MessageHeader, op};

use super::records::{all, number, numbers, record, text};

/// The most buffer space that is kept for the next chunk after a larger one [bytes].
const ROOM_BYTES: usize = 4 << 20;
/// The size from which a message gets its own chunk, without being copied [bytes].
pub(super) const LARGE_BYTES: usize = 8 << 20;
/// The compressed size from which a large message is stored uncompressed [bytes].
const MOST_PACKED_BYTES: usize = 32 << 20;
/// The fastest level of Zstandard, except for the negative ones.
const ZSTD_LEVEL: i32 = 1;

/// The compression of the chunks of a bag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// No compression: the fastest.
    None,
    /// LZ4: about half the size.
    Lz4,
    /// Zstandard at level 1: smaller than its default level on sensor data, and faster.
    #[default]
    Zstd,
}

/// The chunk that is being filled.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    records: Vec<u8>,
    messages: Vec<Place>,
}

/// The position of a message in its chunk.
#[derive(Clone, Copy, Debug)]
struct Place {
    channel: u16,
    log_time: u64,
    at: u64,
}

/// The location of a chunk in its file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    first: u64,
    last: u64,
    unpacked_bytes: u64,
    packed_bytes: u64,
    compression: &'static str,
    /// The offset of the chunk in the file, and its length including the prefix [bytes].
    begin: u64,
    length: u64,
}

impl Chunk {
    pub(super) fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// The uncompressed size of the chunk [bytes].
    pub(super) fn len(&self) -> u64 {
        self.records.len() as u64
    }

    /// The most bytes that the chunk will need in the index of its file.
    pub(super) fn index_bytes(&self) -> u64 {
        128 + 10 * self.messages.len() as u64
    }

    /// Adds a record other than a message.
    pub(super) fn add(&mut self, opcode: u8, fill: impl FnOnce(&mut Vec<u8>)) {
        record(&mut self.records, opcode, fill);
    }

    pub(super) fn add_message(&mut self, header: &MessageHeader, data: &[u8]) {
        self.messages.push(Place {
            channel: header.channel_id,
            log_time: header.log_time,
            at: self.len(),
        });
        record(&mut self.records, op::MESSAGE, |out| {
            put_header(out, header);
            out.extend_from_slice(data);
        });
    }

    /// Adds a message without its contents, whose length is `bytes`; the contents are passed to [`end`](Chunk::end).
    pub(super) fn add_large(&mut self, header: &MessageHeader, bytes: usize) {
        self.add_message(header, &[]);
        let header_bytes = 22;
        let length_at = self.records.len() - header_bytes - 8;
        let length = (header_bytes + bytes) as u64;
        self.records[length_at..length_at + 8].copy_from_slice(&length.to_le_bytes());
    }

    /// Closes the chunk, which starts at `begin` in its file, with the contents of a large message, if it
    /// has one. Passes the parts of its record and of its message index to `put`; returns its entry in the
    /// index of the file.
    pub(super) fn end(
        &mut self,
        begin: u64,
        large: &[u8],
        packer: &mut Packer,
        mut put: impl FnMut(&[u8]) -> io::Result<()>,
    ) -> io::Result<Vec<u8>> {
        let mut crc = crc32fast::Hasher::new();
        crc.update(&self.records);
        crc.update(large);
        let crc = crc.finalize();
        let Packed { compression, parts } = packer.pack([&self.records, large])?;
        let times = self.messages.iter().map(|message| message.log_time);
        let (first, last) = (times.clone().min().unwrap_or(0), times.max().unwrap_or(0));
        let unpacked_bytes = (self.records.len() + large.len()) as u64;
        let packed_bytes = parts.iter().map(|part| part.len() as u64).sum();

        let mut head = Vec::new();
        record(&mut head, op::CHUNK, |out| {
            numbers(out, [first, last, unpacked_bytes]);
            number(out, crc.to_le_bytes());
            text(out, compression);
            numbers(out, [packed_bytes]);
        });
        let length = head.len() as u64 + packed_bytes;
        // The compressed data are part of the record, too.
        head[1..9].copy_from_slice(&(length - 9).to_le_bytes());
        put(&head)?;
        parts.into_iter().try_for_each(&mut put)?;

        let span = Span { first, last, unpacked_bytes, packed_bytes, compression, begin, length };
        let entry = self.end_index(&span, put)?;
        self.records.clear();
        self.records.shrink_to(ROOM_BYTES);
        Ok(entry)
    }

    /// Writes the message index of each channel; returns the chunk's entry in the index of the file.
    fn end_index(
        &mut self,
        span: &Span,
        mut put: impl FnMut(&[u8]) -> io::Result<()>,
    ) -> io::Result<Vec<u8>> {
        self.messages.sort_by_key(|message| message.channel);
        let indexes_at = span.begin + span.length;
        let (mut indexes, mut places) = (Vec::new(), Vec::new());
        for of_channel in self.messages.chunk_by(|one, next| one.channel == next.channel) {
            let channel = of_channel[0].channel;
            places.push((channel, indexes_at + indexes.len() as u64));
            record(&mut indexes, op::MESSAGE_INDEX, |out| {
                number(out, channel.to_le_bytes());
                all(out, of_channel, |out, message| numbers(out, [message.log_time, message.at]));
            });
        }
        put(&indexes)?;
        self.messages.clear();
        let mut entry = Vec::new();
        record(&mut entry, op::CHUNK_INDEX, |out| {
            numbers(out, [span.first, span.last, span.begin, span.length]);
            all(out, places, |out, (channel, at)| {
                number(out, channel.to_le_bytes());
                numbers(out, [at]);
            });
            numbers(out, [indexes.len() as u64]);
            text(out, span.compression);
            numbers(out, [span.packed_bytes, span.unpacked_bytes]);
        });
        Ok(entry)
    }
}

fn put_header(out: &mut Vec<u8>, header: &MessageHeader) {
    number(out, header.channel_id.to_le_bytes());
    number(out, header.sequence.to_le_bytes());
    numbers(out, [header.log_time, header.publish_time]);
}

/// A compressed chunk: its compression, and its bytes in two parts.
struct Packed<'a> {
    compression: &'static str,
    parts: [&'a [u8]; 2],
}

/// The compressor for the chunks of a file.
pub(super) struct Packer {
    how: How,
    packed: Vec<u8>,
}

enum How {
    Not,
    Lz4,
    Zstd(zstd::bulk::Compressor<'static>),
}

impl Packer {
    pub(super) fn new(compression: Compression) -> io::Result<Packer> {
        let how = match compression {
            Compression::None => How::Not,
            Compression::Lz4 => How::Lz4,
            Compression::Zstd => How::Zstd(zstd::bulk::Compressor::new(ZSTD_LEVEL)?),
        };
        Ok(Packer { how, packed: Vec::new() })
    }

    /// Compresses the parts of a chunk; the second is empty except for a large message.
    fn pack<'a>(&'a mut self, parts: [&'a [u8]; 2]) -> io::Result<Packed<'a>> {
        let (compression, most_bytes) = (self.how.name(), self.how.most_packed(parts));
        let mut packed = Bounded { bytes: std::mem::take(&mut self.packed), most_bytes };
        packed.bytes.clear();
        packed.bytes.shrink_to(ROOM_BYTES);
        let is_packed = match (&mut self.how, parts) {
            (How::Not, _) => false,
            (How::Zstd(zstd), [records, []]) => {
                packed.bytes.reserve(most_bytes);
                zstd.compress_to_buffer(records, &mut packed.bytes)?;
                true
            }
            (How::Zstd(_), _) => {
                let mut encoder = zstd::Encoder::new(&mut packed, ZSTD_LEVEL)?;
                let written = parts.into_iter().try_for_each(|part| encoder.write_all(part));
                written.and_then(|()| encoder.finish().map(drop)).is_ok()
            }
            (How::Lz4, _) => {
                let mut encoder = lz4_frame(&mut packed)?;
                let written = parts.into_iter().try_for_each(|part| encoder.write_all(part));
                let (_, ended) = encoder.finish();
                written.and(ended).is_ok()
            }
        };
        self.packed = packed.bytes;
        if is_packed {
            return Ok(Packed { compression, parts: [&self.packed, &[]] });
        }
        Ok(Packed { compression: "", parts })
    }
}

impl How {
    /// The name of the compression in MCAP.
    fn name(&self) -> &'static str {
        match self {
            How::Not => "",
            How::Lz4 => "lz4",
            How::Zstd(_) => "zstd",
        }
    }

    /// The most bytes that the compressed parts of a chunk may have.
    fn most_packed(&self, [records, large]: [&[u8]; 2]) -> usize {
        match self {
            _ if !large.is_empty() => MOST_PACKED_BYTES,
            How::Zstd(_) => zstd::zstd_safe::compress_bound(records.len()),
            How::Not | How::Lz4 => usize::MAX,
        }
    }
}

/// A bounded buffer in memory: writes beyond the bound fail.
struct Bounded {
    bytes: Vec<u8>,
    most_bytes: usize,
}

impl Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.bytes.len() + bytes.len() > self.most_bytes {
            return Err(ErrorKind::OutOfMemory.into());
        }
        self.bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Creates an LZ4 encoder without block checksums, which not all MCAP tools can read; the chunk has its own checksum.
fn lz4_frame<W: Write>(to: W) -> io::Result<lz4::Encoder<W>> {
    lz4::EncoderBuilder::new().block_checksum(lz4::liblz4::BlockChecksum::NoBlockChecksum).build(to)
}
