//! Converts ROS 1 bags (format 2.0, written by `rosbag` since 2010) to MCAP, and their messages to ROS 2 messages.
//!
//! | record | its header | its data |
//! |---|---|---|
//! | bag header | `index_pos` (0: it was not closed), `encryptor` | blanks |
//! | chunk | `compression` (`none`, `bz2`, `lz4`) | connections and messages |
//! | connection | `conn`, `topic` | `type`, `message_definition`, `latching`, as in a message header |
//! | message | `conn`, `time` | the message |
//! | index, chunk info | | not read: the file is read from its beginning, so that none is needed |
//!
//! Source: <http://wiki.ros.org/Bags/Format/2.0>.

mod records;
mod chunk;
mod connections;

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufWriter, Seek};
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};
use teampulse_core::counted::counted;

use crate::error::{BagError, Found};
use crate::read::foreign::{Opened, most_unpacked, unnamed};
use crate::read::records::LIMIT_BYTES;
use connections::{Connections, Out};
use records::{Fields, Head, Records, op};

/// The first bytes of a ROS 1 bag: of any version, and of the version that can be read.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V";
const VERSION: &[u8] = b"#ROSBAG V2.0\n";
/// The most damaged places that are listed.
const MOST_NOTES: usize = 10;
/// The values that mean "not encrypted".
const NOT_ENCRYPTED: [&[u8]; 2] = [b"", b"rosbag/NoEncryptor"];

/// Converts the messages of a ROS 1 bag to an MCAP file.
pub(crate) fn into_mcap(path: &Path, file: &File) -> Result<Opened, BagError> {
    let read = BagError::io("read", path);
    let not_a_bag = |found| BagError::NotABag { path: path.to_owned(), found };
    let most_bytes = most_unpacked(file).map_err(BagError::io("unpack", path))?;
    let index_at = checked(file).map_err(read)?.map_err(not_a_bag)?;
    let options = WriteOptions::new().profile("ros2").compression(None);
    let format = |error| BagError::Format { path: path.to_owned(), error };
    let out = options.create(BufWriter::new(unnamed(path)?)).map_err(format)?;
    let mut conversion = Conversion {
        out,
        connections: Connections::default(),
        left_bytes: most_bytes,
        damage: Vec::new(),
        unknown_count: 0,
        unlisted_count: 0,
        is_closed: index_at > 0,
    };
    conversion.index(file, index_at).map_err(format)?;
    conversion.records(file).map_err(format)?;
    conversion.finish(path)
}

/// The offset of a bag's index, 0 if it has none; or what the file is instead of a readable bag.
fn checked(file: &File) -> io::Result<Result<u64, Found>> {
    let mut records = Records::new(file, 0)?;
    if !records.data(VERSION.len() as u64).is_ok_and(|version| version == VERSION) {
        return Ok(Err(Found::Ros1));
    }
    let mut records = Records::new(file, VERSION.len() as u64)?;
    let Ok(Some(head)) = records.head() else { return Ok(Err(Found::Ros1)) };
    let fields = Fields::new(&head.header);
    if fields.op() != Some(op::BAG_HEADER) {
        return Ok(Err(Found::Ros1));
    }
    if fields.get("encryptor").is_some_and(|name| !NOT_ENCRYPTED.contains(&name)) {
        return Ok(Err(Found::Encrypted));
    }
    let index_at = fields.get("index_pos").and_then(|at| at.try_into().ok());
    Ok(Ok(index_at.map_or(0, u64::from_le_bytes)))
}

/// A bag being converted to MCAP.
struct Conversion {
    out: Out,
    connections: Connections,
    /// The number of bytes that may still be unpacked and written.
    left_bytes: u64,
    damage: Vec<String>,
    /// The number of messages whose connection is missing from the file.
    unknown_count: u64,
    /// The number of damaged places beyond those listed.
    unlisted_count: u64,
    /// Whether the recorder wrote an index.
    is_closed: bool,
}

/// Why reading ended early.
enum Stop {
    Read(io::Error),
    Write(McapError),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Stop {
        Stop::Read(error)
    }
}

impl From<McapError> for Stop {
    fn from(error: McapError) -> Stop {
        Stop::Write(error)
    }
}

impl Conversion {
    /// Reads the connections in the index, since a writer may have stored them only there.
    fn index(&mut self, file: &File, at: u64) -> Result<(), McapError> {
        if at == 0 {
            return Ok(());
        }
        let mut records = Records::new(file, at)?;
        while let Ok(Some(head)) = records.head() {
            let fields = Fields::new(&head.header);
            if fields.op() != Some(op::CONNECTION) {
                break;
            }
            let Ok(data) = records.data(head.data_bytes) else { break };
            self.connections.add(fields, &data, &mut self.out)?;
        }
        Ok(())
    }

    /// Reads all records from the beginning, up to the first invalid one.
    fn records(&mut self, file: &File) -> Result<(), McapError> {
        let mut at = VERSION.len() as u64;
        let mut read = |conversion: &mut Conversion| -> Result<(), Stop> {
            let mut records = Records::new(file, at)?;
            while let Some(head) = records.head()? {
                conversion.record(&mut records, &head)?;
                at = records.at;
            }
            Ok(())
        };
        match read(self) {
            Err(Stop::Read(error)) => {
                self.note(format!("it can't be read from byte {at} on: {error}"));
                Ok(())
            }
            Err(Stop::Write(error)) => Err(error),
            Ok(()) => Ok(()),
        }
    }

    fn record(&mut self, records: &mut Records, head: &Head) -> Result<(), Stop> {
        let fields = Fields::new(&head.header);
        match fields.op() {
            Some(op::CHUNK) => self.chunk(records, head)?,
            Some(op::CONNECTION | op::MESSAGE) => {
                let data = records.data(head.data_bytes)?;
                self.item(fields, &data)?;
            }
            Some(op::BAG_HEADER | op::INDEX | op::CHUNK_INFO) => records.pass(head)?,
            _ => return Err(io::Error::other("a record is of an unknown kind").into()),
        }
        Ok(())
    }

    /// Converts a chunk. Its stated length is 0 while it is being recorded, and too large in a truncated file.
    fn chunk(&mut self, records: &mut Records, head: &Head) -> Result<(), Stop> {
        let is_open = head.data_bytes == 0 && !self.is_closed;
        let is_cut = is_open || records.is_cut();
        let data = if is_cut { records.rest(head) } else { records.data(head.data_bytes) }?;
        let (fields, at) = (Fields::new(&head.header), head.data_at);
        let most_bytes = self.left_bytes.min(LIMIT_BYTES);
        let (contents, reason) = chunk::contents(&data, fields.get("compression"), most_bytes);
        if let Cow::Owned(unpacked) = &contents {
            self.left_bytes = self.left_bytes.saturating_sub(unpacked.len() as u64);
        }
        let is_whole = self.items(&contents)?;
        match reason {
            _ if is_cut => {
                self.note("it was truncated: its last chunk is read as far as possible".to_owned());
            }
            Some(reason) => {
                self.note(format!("the chunk at byte {at} can't be unpacked: {reason}"));
            }
            None if is_whole => {}
            None => self.note(format!("the chunk at byte {at} ends within a record")),
        }
        Ok(())
    }

    fn note(&mut self, damage: String) {
        if self.damage.len() < MOST_NOTES {
            self.damage.push(damage);
        } else {
            self.unlisted_count += 1;
        }
    }

    /// Converts the records of a chunk; returns whether the last one was complete.
    fn items(&mut self, contents: &[u8]) -> Result<bool, McapError> {
        let mut rest = contents;
        while !rest.is_empty() {
            let Some((fields, data)) = records::next(&mut rest) else { return Ok(false) };
            self.item(fields, data)?;
        }
        Ok(true)
    }

    /// Takes a connection or a message.
    fn item(&mut self, fields: Fields<'_>, data: &[u8]) -> Result<(), McapError> {
        match fields.op() {
            Some(op::CONNECTION) => self.connections.add(fields, data, &mut self.out),
            Some(op::MESSAGE) => self.message(fields, data),
            _ => Ok(()),
        }
    }

    fn message(&mut self, fields: Fields<'_>, data: &[u8]) -> Result<(), McapError> {
        let number = fields.number("conn");
        let connection = number.and_then(|number| self.connections.get(number));
        let (Some(connection), Some(time)) = (connection, fields.nanos("time")) else {
            self.unknown_count += 1;
            return Ok(());
        };
        let (channel_id, kind) = match &connection.kind {
            Ok((channel, kind)) => (*channel, kind),
            Err(reason) => {
                let reason = reason.clone();
                connection.missed(&reason);
                return Ok(());
            }
        };
        match kind.cdr(data) {
            Ok(cdr) if cdr.len() as u64 <= self.left_bytes => {
                self.left_bytes -= cdr.len() as u64;
                let header =
                    MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
                self.out.write_to_known_channel(&header, &cdr)
            }
            Ok(_) => {
                connection.missed(&"keep them: the bag unpacks to far more than its size");
                Ok(())
            }
            Err(error) => {
                connection.missed(&error);
                Ok(())
            }
        }
    }

    fn finish(mut self, path: &Path) -> Result<Opened, BagError> {
        let format = |error| BagError::Format { path: path.to_owned(), error };
        self.out.finish().map_err(format)?;
        let mut file = self.out.into_inner().into_inner().map_err(|error| {
            let error = error.into_error();
            BagError::Io { doing: "unpack", path: path.to_owned(), error }
        })?;
        file.rewind().map_err(BagError::io("unpack", path))?;
        let mut damage = self.damage;
        damage.extend(self.connections.damage());
        if self.unknown_count > 0 {
            damage.push(counted(
                self.unknown_count,
                "message belongs to no known connection",
                "messages belong to no known connection",
            ));
        }
        if self.unlisted_count > 0 {
            damage.push(counted(
                self.unlisted_count,
                "other place is damaged",
                "other places are damaged",
            ));
        }
        let damage = (!damage.is_empty()).then(|| damage.join("; "));
        Ok(Opened { file, is_made: true, damage })
    }
}
