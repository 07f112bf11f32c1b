//! Recordings that are not plain MCAP: rosbag2 recordings in `SQLite`, compressed files and messages, and ROS 1 bags.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write};
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use teampulse_core::counted::counted;

use crate::error::{BagError, Found};
use crate::read::block::Entry;
use crate::read::index::Index;
use crate::read::records::LIMIT_BYTES;
use crate::read::{ros1, sqlite};

const SQLITE: &[u8] = b"SQLite format 3\0";
const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// The file extensions of recordings.
pub(crate) const KINDS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"];
/// A file may decompress to this many times its size, plus an allowance [bytes]; anything larger is taken for a
/// decompression bomb.
const MOST_TIMES: u64 = 1000;
const MOST_MORE: u64 = 64 << 20;

/// Whether rosbag2 compressed this message: CDR never starts with these bytes.
pub(crate) fn is_packed(message: &[u8]) -> bool {
    message.starts_with(ZSTD)
}

/// Decompresses a message; an uncompressed message is returned unchanged.
pub(crate) fn unpacked(message: &[u8]) -> io::Result<Cow<'_, [u8]>> {
    if !is_packed(message) {
        return Ok(Cow::Borrowed(message));
    }
    let mut plain = Vec::new();
    zstd::Decoder::new(message)?.take(LIMIT_BYTES + 1).read_to_end(&mut plain)?;
    if plain.len() as u64 > LIMIT_BYTES {
        return Err(io::Error::other("it unpacks to more than the largest allowed message"));
    }
    Ok(Cow::Owned(plain))
}

/// The most bytes to which a file may decompress.
pub(crate) fn most_unpacked(file: &File) -> io::Result<u64> {
    Ok(file.metadata()?.len().saturating_mul(MOST_TIMES).saturating_add(MOST_MORE))
}

/// The note about messages that can't be decompressed.
pub(crate) fn unreadable(count: u64) -> Option<String> {
    (count > 0).then(|| format!("{} can't be unpacked", counted(count, "message", "messages")))
}

/// Converts a file with individually compressed messages into one with plain messages.
pub(crate) fn with_plain_messages(index: &Index) -> Result<Opened, BagError> {
    let format = |error| BagError::Format { path: index.path.clone(), error };
    let most = most_unpacked(&index.file).map_err(BagError::io("unpack", &index.path))?;
    let options = WriteOptions::new().profile("ros2").compression(None);
    let mut out = options.create(BufWriter::new(unnamed(&index.path)?)).map_err(format)?;
    let unreadable_count = copy_plain(index, &mut out, most).map_err(format)?;
    out.finish().map_err(format)?;
    let mut file = out.into_inner().into_inner().map_err(|error| BagError::Io {
        doing: "unpack",
        path: index.path.clone(),
        error: error.into_error(),
    })?;
    file.rewind().map_err(BagError::io("unpack", &index.path))?;
    Ok(Opened { file, is_made: true, damage: unreadable(unreadable_count) })
}

/// Copies all messages in file order, decompressed; returns the number that could not be decompressed.
fn copy_plain(
    index: &Index,
    out: &mut Writer<BufWriter<File>>,
    most_bytes: u64,
) -> Result<u64, McapError> {
    let mut channels = BTreeMap::new();
    for (id, channel) in &index.channels {
        let schema = &channel.schema;
        let (encoding, text) = (schema.encoding.as_str(), schema.text.as_bytes());
        let schema = out.add_schema(&schema.name, encoding, text)?;
        let own = out.add_channel(schema, &channel.topic, &channel.encoding, &channel.metadata)?;
        channels.insert(*id, own);
    }
    let (mut unreadable_count, mut bytes) = (0, 0);
    for block in &index.blocks {
        // Damage of this block was noted when the file was opened.
        let Ok(contents) = block.load(&index.file) else { continue };
        let mut entries = contents.entries;
        entries.sort_by_key(|entry| entry.start);
        for Entry { channel, sequence, log_time, publish_time, start, end } in entries {
            let Some(&channel_id) = channels.get(&channel) else { continue };
            let header = MessageHeader { channel_id, sequence, log_time, publish_time };
            match unpacked(&contents.records[start..end]) {
                Ok(message) if bytes <= most_bytes => {
                    bytes += message.len() as u64;
                    out.write_to_known_channel(&header, &message)?;
                }
                _ => unreadable_count += 1,
            }
        }
    }
    Ok(unreadable_count)
}

/// A file opened as MCAP.
pub(crate) struct Opened {
    pub file: File,
    /// Whether it was converted from the original.
    pub is_made: bool,
    /// The part of the original that can't be read, if any.
    pub damage: Option<String>,
}

/// Opens a file. A file that is not MCAP is converted to an unnamed file, which is deleted when it is closed: it is
/// decompressed, and a database or a ROS 1 bag is copied message by message.
pub(crate) fn open(path: &Path) -> Result<Opened, BagError> {
    let file = File::open(path).map_err(BagError::io("open", path))?;
    if !begins_with(&file, ZSTD) {
        if begins_with(&file, SQLITE) {
            return sqlite::into_mcap(path, path);
        }
        if begins_with(&file, ros1::MAGIC) {
            return ros1::into_mcap(path, &file);
        }
        return Ok(Opened { file, is_made: false, damage: None });
    }
    let mut unpacked = tempfile::NamedTempFile::new().map_err(BagError::io("unpack", path))?;
    let damage = unpack(&file, unpacked.as_file_mut()).map_err(BagError::io("unpack", path))?;
    let length = unpacked.as_file().metadata().map_err(BagError::io("unpack", path))?.len();
    if length == 0 && damage.is_some() {
        return Err(BagError::NotABag { path: path.to_owned(), found: Found::Compressed });
    }
    if !begins_with(unpacked.as_file(), SQLITE) {
        return Ok(Opened { file: unpacked.into_file(), is_made: true, damage });
    }
    let opened = sqlite::into_mcap(path, unpacked.path())?;
    Ok(Opened { damage: damage.or(opened.damage), ..opened })
}

/// Creates an unnamed file for a conversion.
pub(crate) fn unnamed(path: &Path) -> Result<File, BagError> {
    tempfile::tempfile().map_err(BagError::io("unpack", path))
}

fn begins_with(file: &File, magic: &[u8]) -> bool {
    let mut start = vec![0; magic.len()];
    let mut at = file;
    let is_read = at.rewind().and_then(|()| at.read_exact(&mut start));
    at.rewind().and(is_read).is_ok() && start == magic
}

/// Decompresses as much as possible; returns the reason why the rest can't be decompressed, if any.
fn unpack(file: &File, out: &mut File) -> io::Result<Option<String>> {
    let most_bytes = most_unpacked(file)?;
    let mut decoder = zstd::Decoder::new(BufReader::new(file))?;
    let mut out = BufWriter::new(out);
    let (mut block, mut bytes) = (vec![0; 1 << 17], 0);
    let damage = loop {
        match decoder.read(&mut block) {
            Ok(0) => break None,
            Ok(read) => {
                bytes += read as u64;
                if bytes > most_bytes {
                    break Some(format!("it unpacks to more than {MOST_TIMES} times its size"));
                }
                out.write_all(&block[..read])?;
            }
            Err(error) => break Some(format!("it can't be unpacked completely: {error}")),
        }
    };
    out.flush()?;
    Ok(damage)
}
