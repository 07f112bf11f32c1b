//! Recordings of rosbag2 in `SQLite` (`.db3`), from Dashing to Rolling.
//!
//! Uses the bundled `SQLite` library (`rusqlite`, which takes half a minute to build): an unclosed recording has its
//! newest messages in a journal file, and foreign files may contain anything.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Seek};
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags, Row};

use crate::error::{BagError, Found};
use crate::read::foreign::{Opened, most_unpacked, unnamed, unpacked, unreadable};
use crate::read::records::LIMIT_BYTES;

/// The tables of a recording that are read; only the first two always exist.
const TABLES: [&str; 3] = ["topics", "messages", "message_definitions"];

/// The flags for a recording that nobody is writing.
const READ_ONLY: OpenFlags =
    OpenFlags::SQLITE_OPEN_READ_ONLY.union(OpenFlags::SQLITE_OPEN_NO_MUTEX);

/// A topic with its channel.
struct Topic {
    name: String,
    type_name: String,
    format: String,
    /// The offered QoS profiles; empty before Foxy.
    qos: String,
    /// The hash of the type; empty before Iron.
    hash: String,
}

/// Topics by id.
type Topics = BTreeMap<i64, Topic>;

/// Converts the messages of a database at `database` to an MCAP file; errors name `path`.
pub(crate) fn into_mcap(path: &Path, database: &Path) -> Result<Opened, BagError> {
    let (tables, topics) = open(path, database)?;
    let definitions = tables.definitions().unwrap_or_default();
    let format = |error| BagError::Format { path: path.to_owned(), error };
    let most_bytes = File::open(database).and_then(|file| most_unpacked(&file));
    let most_bytes = most_bytes.map_err(BagError::io("unpack", path))?;
    let options = WriteOptions::new().profile("ros2").compression(None);
    let mut out = options.create(BufWriter::new(unnamed(path)?)).map_err(format)?;
    let channels = channels(&mut out, &topics, &definitions).map_err(format)?;
    let (damage, unreadable_count) =
        tables.copy(&channels, &mut out, most_bytes).map_err(format)?;
    out.finish().map_err(format)?;
    let mut file = out.into_inner().into_inner().map_err(|error| BagError::Io {
        doing: "unpack",
        path: path.to_owned(),
        error: error.into_error(),
    })?;
    file.rewind().map_err(BagError::io("unpack", path))?;
    let damage = damage.map(|error| format!("the rest of the database can't be read: {error}"));
    Ok(Opened { file, is_made: true, damage: damage.or(unreadable(unreadable_count)) })
}

/// The suffixes of the files that `SQLite` keeps beside an open database: while they exist, an interrupted transaction
/// may have to be rolled back, or they contain new data.
const BESIDE: [&str; 2] = ["-journal", "-wal"];

/// Opens the tables of a database, and its topics. An interrupted recording may need recovery first, which is done on a
/// copy, as the original must not change.
fn open(path: &Path, database: &Path) -> Result<(Tables, Topics), BagError> {
    let read = |tables: Tables| tables.topics().map(|topics| (tables, topics));
    let is_cut_off = || BESIDE.iter().any(|kind| beside(database, kind).exists());
    match Tables::open(database).and_then(read) {
        Ok(opened) => return Ok(opened),
        Err(_) if is_cut_off() => {}
        Err(_) => return Tables::open_torn(database).and_then(read).map_err(not_a_bag(path)),
    }
    let folder = tempfile::tempdir().map_err(BagError::io("unpack", path))?;
    let copy = folder.path().join("cut_off.db3");
    fs::copy(database, &copy).map_err(BagError::io("unpack", path))?;
    for kind in BESIDE {
        let from = beside(database, kind);
        if from.exists() {
            fs::copy(from, beside(&copy, kind)).map_err(BagError::io("unpack", path))?;
        }
    }
    // The copy is deleted with its folder; its open files stay until they are closed.
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    Tables::open_with(&copy, flags).and_then(read).map_err(not_a_bag(path))
}

fn not_a_bag(path: &Path) -> impl Fn(rusqlite::Error) -> BagError {
    move |_| BagError::NotABag { path: path.to_owned(), found: Found::Sqlite }
}

fn beside(database: &Path, kind: &str) -> PathBuf {
    let mut name = database.as_os_str().to_owned();
    name.push(kind);
    PathBuf::from(name)
}

/// Adds a channel for each topic; returns them by topic id.
fn channels(
    out: &mut Writer<BufWriter<File>>,
    topics: &Topics,
    definitions: &BTreeMap<String, (String, String)>,
) -> Result<BTreeMap<i64, u16>, McapError> {
    let mut channels = BTreeMap::new();
    for (id, topic) in topics {
        let known = definitions.get(&topic.type_name);
        let (encoding, text) =
            known.map_or(("ros2msg", ""), |(encoding, text)| (encoding.as_str(), text.as_str()));
        let schema = out.add_schema(&topic.type_name, encoding, text.as_bytes())?;
        let metadata = [("offered_qos_profiles", &topic.qos), ("topic_type_hash", &topic.hash)];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value.clone())).into();
        let channel = out.add_channel(schema, &topic.name, &topic.format, &metadata)?;
        channels.insert(*id, channel);
    }
    Ok(channels)
}

/// The tables of a recording.
struct Tables {
    connection: Connection,
    /// The columns of each table.
    columns: BTreeMap<String, Vec<String>>,
}

impl Tables {
    fn open(database: &Path) -> rusqlite::Result<Tables> {
        Tables::open_with(database, READ_ONLY)
    }

    /// Opens a truncated file: the library reads as much as possible only when tables are declared to be
    /// under repair.
    fn open_torn(database: &Path) -> rusqlite::Result<Tables> {
        let connection = Connection::open_with_flags(database, READ_ONLY)?;
        connection.set_db_config(DbConfig::SQLITE_DBCONFIG_WRITABLE_SCHEMA, true)?;
        Tables::of(connection)
    }

    fn open_with(database: &Path, flags: OpenFlags) -> rusqlite::Result<Tables> {
        Tables::of(Connection::open_with_flags(database, flags)?)
    }

    fn of(connection: Connection) -> rusqlite::Result<Tables> {
        connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, LIMIT_BYTES as i32)?;
        let mut tables = Tables { connection, columns: BTreeMap::new() };
        for name in TABLES {
            // A view or a computed column could run forever.
            let kind = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?1 \
                        AND sql NOT LIKE 'CREATE VIRTUAL%' AND sql NOT LIKE '% AS %(%'";
            let count: i64 = tables.connection.query_row(kind, [name], |row| row.get(0))?;
            if count == 1 {
                let mut info =
                    tables.connection.prepare("SELECT name FROM pragma_table_info(?1)")?;
                let columns =
                    info.query_map([name], |row| row.get(0))?.collect::<Result<_, _>>()?;
                tables.columns.insert(name.to_owned(), columns);
            }
        }
        Ok(tables)
    }

    /// The name of a column, or its substitute in files of older versions.
    fn column(&self, table: &str, name: &'static str, or: &'static str) -> &'static str {
        let columns = self.columns.get(table);
        let is_there = columns.is_some_and(|columns| columns.iter().any(|column| column == name));
        if is_there { name } else { or }
    }

    fn topics(&self) -> rusqlite::Result<Topics> {
        let qos = self.column("topics", "offered_qos_profiles", "''");
        let hash = self.column("topics", "type_description_hash", "''");
        let query =
            format!("SELECT id, name, type, serialization_format, {qos}, {hash} FROM topics");
        let topic = |row: &Row<'_>| {
            let topic = Topic {
                name: text(row, 1)?,
                type_name: text(row, 2)?,
                format: text(row, 3)?,
                qos: text(row, 4)?,
                hash: text(row, 5)?,
            };
            Ok((row.get(0)?, topic))
        };
        self.known("topics")?;
        self.known("messages")?;
        self.connection.prepare(&query)?.query_map([], topic)?.collect()
    }

    /// The encoding and the text of each type's definition.
    fn definitions(&self) -> rusqlite::Result<BTreeMap<String, (String, String)>> {
        self.known("message_definitions")?;
        let query =
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
        let definition = |row: &Row<'_>| Ok((text(row, 0)?, (text(row, 1)?, text(row, 2)?)));
        self.connection.prepare(query)?.query_map([], definition)?.collect()
    }

    /// Copies the messages in recorded order; returns the error that prevented the rest, and the number
    /// that could not be decompressed.
    fn copy(
        &self,
        channels: &BTreeMap<i64, u16>,
        out: &mut Writer<BufWriter<File>>,
        most_bytes: u64,
    ) -> Result<(Option<rusqlite::Error>, u64), McapError> {
        let sent = self.column("messages", "send_timestamp", "timestamp");
        let received = self.column("messages", "recv_timestamp", "timestamp");
        let query = format!("SELECT topic_id, {received}, {sent}, data FROM messages ORDER BY id");
        let mut statement = match self.connection.prepare(&query) {
            Ok(statement) => statement,
            Err(error) => return Ok((Some(error), 0)),
        };
        let mut rows = match statement.query([]) {
            Ok(rows) => rows,
            Err(error) => return Ok((Some(error), 0)),
        };
        let (mut unreadable_count, mut bytes) = (0, 0);
        loop {
            let row = match rows.next() {
                Ok(Some(row)) => row,
                Ok(None) => return Ok((None, unreadable_count)),
                Err(error) => return Ok((Some(error), unreadable_count)),
            };
            let number = |place| row.get::<_, i64>(place).ok();
            let channel_id = number(0).and_then(|topic| channels.get(&topic));
            let (Some(&channel_id), Ok(ValueRef::Blob(data))) = (channel_id, row.get_ref(3)) else {
                continue;
            };
            let nanos = |place| u64::try_from(number(place).unwrap_or(0)).unwrap_or(0);
            let header = MessageHeader {
                channel_id,
                sequence: 0,
                log_time: nanos(1),
                publish_time: nanos(2),
            };
            match unpacked(data) {
                Ok(message) if bytes <= most_bytes => {
                    bytes += message.len() as u64;
                    out.write_to_known_channel(&header, &message)?;
                }
                _ => unreadable_count += 1,
            }
        }
    }

    fn known(&self, table: &str) -> rusqlite::Result<()> {
        let is_known = self.columns.contains_key(table);
        is_known.then_some(()).ok_or(rusqlite::Error::QueryReturnedNoRows)
    }
}

/// A cell as text, whatever its type.
fn text(row: &Row<'_>, place: usize) -> rusqlite::Result<String> {
    Ok(match row.get_ref(place)? {
        ValueRef::Text(bytes) | ValueRef::Blob(bytes) => {
            String::from_utf8_lossy(bytes).into_owned()
        }
        _ => String::new(),
    })
}
