//! Parsers for records other than messages and chunks.

use std::collections::BTreeMap;

use mcap::McapResult;
use teampulse_core::stream::Schema;

use super::block::Block;
use super::chunk::Extent;
use super::fields::Fields;

/// A channel record, with the id of its schema.
#[derive(Debug)]
pub(crate) struct ChannelRecord {
    pub id: u16,
    pub schema_id: u16,
    pub topic: String,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

/// The statistics at the end of a file.
#[derive(Debug)]
pub(crate) struct Statistics {
    pub messages: u64,
    pub channels: u32,
    pub chunks: u32,
    pub first: u64,
    pub last: u64,
    pub counts: BTreeMap<u16, u64>,
}

/// An attachment record.
#[derive(Debug)]
pub(crate) struct AttachmentRecord<'a> {
    pub log_time: u64,
    pub name: String,
    pub media_type: String,
    pub bytes: &'a [u8],
}

/// Parses a schema record: the schema and its id.
pub(crate) fn schema(body: &[u8]) -> McapResult<(u16, Schema)> {
    let mut fields = Fields::new(body);
    let id = fields.u16()?;
    let (name, encoding, text) = (fields.string()?, fields.string()?, fields.string()?);
    Ok((id, Schema { name, encoding, text, hash: String::new() }))
}

pub(crate) fn channel(body: &[u8]) -> McapResult<ChannelRecord> {
    let mut fields = Fields::new(body);
    Ok(ChannelRecord {
        id: fields.u16()?,
        schema_id: fields.u16()?,
        topic: fields.string()?,
        encoding: fields.string()?,
        metadata: fields.map(Fields::string, Fields::string)?,
    })
}

/// Parses a chunk index record: the location of the chunk, and the channels with messages in it.
pub(crate) fn chunk_index(body: &[u8]) -> McapResult<(Block, BTreeMap<u16, u64>)> {
    let mut fields = Fields::new(body);
    let (first, last) = (fields.u64()?, fields.u64()?);
    let (offset, length) = (fields.u64()?, fields.u64()?);
    let channels = fields.map(Fields::u16, Fields::u64)?;
    Ok((Block { offset, length, first, last, extent: Extent::Whole }, channels))
}

pub(crate) fn statistics(body: &[u8]) -> McapResult<Statistics> {
    let mut fields = Fields::new(body);
    let messages = fields.u64()?;
    let _schemas = fields.u16()?;
    let channels = fields.u32()?;
    let _attachments = fields.u32()?;
    let _metadata = fields.u32()?;
    Ok(Statistics {
        messages,
        channels,
        chunks: fields.u32()?,
        first: fields.u64()?,
        last: fields.u64()?,
        counts: fields.map(Fields::u16, Fields::u64)?,
    })
}

/// Parses the offset and the length of an attachment or a metadata record.
pub(crate) fn extra_index(body: &[u8]) -> McapResult<(u64, u64)> {
    let mut fields = Fields::new(body);
    Ok((fields.u64()?, fields.u64()?))
}

pub(crate) fn attachment(body: &[u8]) -> McapResult<AttachmentRecord<'_>> {
    let mut fields = Fields::new(body);
    let log_time = fields.u64()?;
    let _create_time = fields.u64()?;
    let (name, media_type) = (fields.string()?, fields.string()?);
    let length = fields.u64()?;
    Ok(AttachmentRecord { log_time, name, media_type, bytes: fields.bytes(length)? })
}

/// Parses a metadata record: its name and its contents.
pub(crate) fn metadata(body: &[u8]) -> McapResult<(String, BTreeMap<String, String>)> {
    let mut fields = Fields::new(body);
    Ok((fields.string()?, fields.map(Fields::string, Fields::string)?))
}

/// Parses the footer: the offset of the summary and its checksum.
pub(crate) fn footer(body: &[u8]) -> McapResult<(u64, u32)> {
    let mut fields = Fields::new(body);
    let summary_start = fields.u64()?;
    let _summary_offset_start = fields.u64()?;
    Ok((summary_start, fields.u32()?))
}
