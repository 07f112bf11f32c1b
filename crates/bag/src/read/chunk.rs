//! Chunks: records that are compressed together and protected by a checksum.

use std::io::Read;

use bytes::Bytes;
use mcap::{McapError, McapResult};

use crate::read::fields::Fields;
use crate::read::records::LIMIT_BYTES;

/// Whether a chunk is completely in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    /// Complete: the checksum must match.
    Whole,
    /// Truncated by the end of the file: whatever can be read is used.
    Cut,
}

/// The end of the checksum in a chunk: after two times and a length [bytes].
pub(crate) const CHECKSUM_END: u64 = 28;

/// Whether a chunk has a checksum. In MCAP, zero means that there is none.
pub(crate) fn has_checksum(body: &[u8]) -> bool {
    let mut fields = Fields::new(body);
    fields.bytes(24).and_then(|_| fields.u32()).is_ok_and(|crc| crc != 0)
}

/// Decompresses the records of a chunk.
pub(crate) fn unpack(body: &Bytes, extent: Extent) -> McapResult<Bytes> {
    let (header, packed_at) = Header::read(body)?;
    let packed = body.slice(packed_at..);
    let packed = match usize::try_from(header.packed_bytes) {
        Ok(length) if length <= packed.len() => packed.slice(..length),
        _ if extent == Extent::Cut => packed,
        _ => return Err(McapError::UnexpectedEoc),
    };
    if header.unpacked_bytes > LIMIT_BYTES {
        return Err(McapError::ChunkTooLarge(header.unpacked_bytes));
    }
    let records = header.decompress(packed, extent)?;
    match extent {
        Extent::Whole => header.check(records),
        Extent::Cut => Ok(records),
    }
}

struct Header<'a> {
    unpacked_bytes: u64,
    crc: u32,
    compression: &'a [u8],
    packed_bytes: u64,
}

impl<'a> Header<'a> {
    /// Parses the header of a chunk; also returns the offset of its records.
    fn read(body: &'a [u8]) -> McapResult<(Header<'a>, usize)> {
        let mut fields = Fields::new(body);
        let _times = fields.bytes(16)?;
        let header = Header {
            unpacked_bytes: fields.u64()?,
            crc: fields.u32()?,
            compression: fields.counted()?,
            packed_bytes: fields.u64()?,
        };
        Ok((header, body.len() - fields.rest().len()))
    }

    fn decompress(&self, packed: Bytes, extent: Extent) -> McapResult<Bytes> {
        let unpacked = match self.compression {
            b"" => return Ok(packed),
            b"zstd" if extent == Extent::Whole => self.unpack_zstd(&packed),
            b"zstd" => {
                read_all(zstd::stream::read::Decoder::with_buffer(&*packed), self.unpacked_bytes)
            }
            b"lz4" => read_all(lz4::Decoder::new(&*packed), self.unpacked_bytes),
            other => {
                let name = String::from_utf8_lossy(other).into_owned();
                return Err(McapError::UnsupportedCompression(name));
            }
        };
        match unpacked {
            (records, Ok(())) => Ok(records.into()),
            (records, Err(_)) if extent == Extent::Cut => Ok(records.into()),
            (_, Err(error)) => Err(McapError::DecompressionError(error.to_string())),
        }
    }

    /// Decompresses directly into a buffer of the stated size, whose memory is used only as it is filled; a
    /// separate decompression window would need additional memory.
    fn unpack_zstd(&self, packed: &[u8]) -> (Vec<u8>, std::io::Result<()>) {
        let mut records = Vec::with_capacity(self.unpacked_bytes as usize);
        let unpacked = zstd::bulk::Decompressor::new()
            .and_then(|mut unpacker| unpacker.decompress_to_buffer(packed, &mut records));
        (records, unpacked.map(|_| ()))
    }

    fn check(&self, records: Bytes) -> McapResult<Bytes> {
        if records.len() as u64 != self.unpacked_bytes {
            return Err(McapError::UnexpectedEoc);
        }
        let calculated = crc32fast::hash(&records);
        match self.crc {
            // In MCAP, zero means that there is no checksum.
            0 => Ok(records),
            saved if saved == calculated => Ok(records),
            saved => Err(McapError::BadChunkCrc { saved, calculated }),
        }
    }
}

/// Reads the output of a decoder up to the stated length; also returns how it ended.
fn read_all(
    decoder: std::io::Result<impl Read>,
    announced_bytes: u64,
) -> (Vec<u8>, std::io::Result<()>) {
    let mut records = Vec::with_capacity(announced_bytes as usize);
    let read = decoder.and_then(|decoder| decoder.take(announced_bytes).read_to_end(&mut records));
    (records, read.map(|_| ()))
}
