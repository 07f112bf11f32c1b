//! The records of a ROS 1 bag, and the fields of their headers.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use crate::read::records::LIMIT_BYTES;

/// The most bytes in the header of a record, which has a few short fields.
const HEADER_LIMIT_BYTES: u32 = 1 << 20;

/// The kinds of records.
pub(super) mod op {
    pub const MESSAGE: u8 = 2;
    pub const BAG_HEADER: u8 = 3;
    pub const INDEX: u8 = 4;
    pub const CHUNK: u8 = 5;
    pub const CHUNK_INFO: u8 = 6;
    pub const CONNECTION: u8 = 7;
}

/// The fields of a header: `name=value`, each prefixed with its length.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub fn new(header: &'a [u8]) -> Fields<'a> {
        Fields(header)
    }

    /// The bytes of a field; `None` if it is missing, or if the fields before it are damaged.
    pub fn get(self, name: &str) -> Option<&'a [u8]> {
        let mut rest = self.0;
        while !rest.is_empty() {
            let field = counted(&mut rest)?;
            let equals = field.iter().position(|byte| *byte == b'=')?;
            if &field[..equals] == name.as_bytes() {
                return Some(&field[equals + 1..]);
            }
        }
        None
    }

    pub fn text(self, name: &str) -> Option<String> {
        self.get(name).map(|text| String::from_utf8_lossy(text).into_owned())
    }

    pub fn number(self, name: &str) -> Option<u32> {
        self.get(name)?.try_into().ok().map(u32::from_le_bytes)
    }

    /// The time in a field [ns]; it is stored as seconds and nanoseconds.
    pub fn nanos(self, name: &str) -> Option<u64> {
        let (secs, nanos) = self.get(name)?.split_first_chunk::<4>()?;
        let nanos = u32::from_le_bytes(nanos.try_into().ok()?);
        Some(u64::from(u32::from_le_bytes(*secs)) * 1_000_000_000 + u64::from(nanos))
    }

    /// The kind of the record.
    pub fn op(self) -> Option<u8> {
        let [op] = self.get("op")? else { return None };
        Some(*op)
    }
}

/// The next bytes, prefixed with their 32-bit count.
fn counted<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (count, behind) = rest.split_first_chunk::<4>()?;
    let (bytes, behind) = behind.split_at_checked(u32::from_le_bytes(*count) as usize)?;
    *rest = behind;
    Some(bytes)
}

/// The next record in a chunk; `None` if it is incomplete.
pub(super) fn next<'a>(rest: &mut &'a [u8]) -> Option<(Fields<'a>, &'a [u8])> {
    Some((Fields(counted(rest)?), counted(rest)?))
}

/// The records of a file.
pub(super) struct Records {
    file: BufReader<File>,
    /// The offset of the next record.
    pub at: u64,
    length: u64,
}

/// The header of a record; its data follows in the file.
pub(super) struct Head {
    pub header: Vec<u8>,
    /// The offset of the record's data in the file.
    pub data_at: u64,
    pub data_bytes: u64,
}

impl Records {
    pub fn new(file: &File, at: u64) -> io::Result<Records> {
        let mut file = file.try_clone()?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(at))?;
        Ok(Records { file: BufReader::new(file), at, length })
    }

    /// The header of the next record; `None` at the end of the file.
    pub fn head(&mut self) -> io::Result<Option<Head>> {
        if self.at >= self.length {
            return Ok(None);
        }
        let header_bytes = self.count()?;
        if header_bytes > HEADER_LIMIT_BYTES {
            return Err(io::Error::other(format!(
                "the header of a record is too large: {header_bytes} bytes"
            )));
        }
        let header = self.data(u64::from(header_bytes))?;
        let data_bytes = u64::from(self.count()?);
        let data_at = self.at + 8 + u64::from(header_bytes);
        self.at = data_at + data_bytes;
        Ok(Some(Head { header, data_at, data_bytes }))
    }

    /// Reads the data of the record whose header was read last.
    pub fn data(&mut self, bytes: u64) -> io::Result<Vec<u8>> {
        if bytes > LIMIT_BYTES {
            return Err(io::Error::other(format!("a record is too large: {bytes} bytes")));
        }
        let mut data = Vec::new();
        (&mut self.file).take(bytes).read_to_end(&mut data)?;
        if (data.len() as u64) < bytes {
            return Err(io::Error::other("the file ends within a record"));
        }
        Ok(data)
    }

    /// Whether the file ends within the data of the record whose header was read last.
    pub fn is_cut(&self) -> bool {
        self.at > self.length
    }

    /// Skips the data of the record whose header was read last.
    pub fn pass(&mut self, head: &Head) -> io::Result<()> {
        if self.is_cut() {
            return Err(io::Error::other("the file ends within a record"));
        }
        self.file.seek_relative(head.data_bytes as i64)
    }

    /// Reads the rest of the file as the data of the record whose header was read last.
    pub fn rest(&mut self, head: &Head) -> io::Result<Vec<u8>> {
        self.at = self.length;
        self.data(self.length.saturating_sub(head.data_at).min(LIMIT_BYTES))
    }

    fn count(&mut self) -> io::Result<u32> {
        let mut count = [0; 4];
        let short = |_| io::Error::other("the file ends within a record");
        self.file.read_exact(&mut count).map_err(short)?;
        Ok(u32::from_le_bytes(count))
    }
}
