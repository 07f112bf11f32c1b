//! Recordings of rosbag2 that are not MCAP: databases of every version, and files compressed as a whole.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::{Connection, params};
use teampulse_bag::{Bag, BagError, Found, recover};
use teampulse_core::stream::{Shape, Signal, Stream, Subject};
use teampulse_messages::catalogue::shipped;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::sensor_msgs::BatteryState;
use tempfile::{TempDir, tempdir};

const TOPIC: &str = "/robot1/battery_state";
const COUNT: i64 = 50;

/// Tables as the ROS 2 distributions create them.
const DASHING: &str = "
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
        serialization_format TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
        data BLOB NOT NULL);";
const FOXY: &str = "
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
        serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
        data BLOB NOT NULL);
    CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
const HUMBLE: &str = "
    CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
    INSERT INTO schema VALUES (3, 'humble');
    CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);";
const JAZZY: &str = "
    CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
    INSERT INTO schema VALUES (4, 'jazzy');
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
        serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,
        type_description_hash TEXT NOT NULL);
    CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
        encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
        data BLOB NOT NULL);";

fn battery(number: i64) -> Vec<u8> {
    BatteryState { voltage: 12.0 + number as f32 / 100.0, ..BatteryState::default() }
        .encode()
        .to_vec()
}

/// A database with a topic and its messages, two of them out of order, as can happen.
fn database(path: &Path, tables: &str) -> Connection {
    let database = Connection::open(path).expect("a database can be made");
    database.execute_batch(tables).expect("a database can be made");
    let columns: i64 = database
        .query_row("SELECT count(*) FROM pragma_table_info('topics')", [], |row| row.get(0))
        .expect("a database can be made");
    let extra = &["", ", '- history: 1\n  depth: 7\n  reliability: 2\n'", ", 'RIHS01_00'"];
    let extra = extra[..columns as usize - 3].concat();
    let topic =
        format!("INSERT INTO topics VALUES (1, '{TOPIC}', '{}', 'cdr'{extra})", BatteryState::NAME);
    database.execute(&topic, []).expect("a database can be made");
    for number in 0..COUNT {
        let at_ns = 1_700_000_000_000_000_000 + (number ^ 1) * 100_000_000;
        let message = params![number + 1, at_ns, battery(number ^ 1)];
        database
            .execute("INSERT INTO messages VALUES (?1, 1, ?2, ?3)", message)
            .expect("a database can be made");
    }
    if columns == 6 {
        let text = &shipped(BatteryState::NAME).expect("a database can be made").text;
        let definition = "INSERT INTO message_definitions VALUES (1, ?1, 'ros2msg', ?2, '')";
        database
            .execute(definition, params![BatteryState::NAME, text])
            .expect("a database can be made");
    }
    database
}

fn written(tables: &str) -> (TempDir, PathBuf) {
    let folder = tempdir().expect("a database can be made");
    let path = folder.path().join("bag_0.db3");
    database(&path, tables).close().expect("a database can be made");
    (folder, path)
}

#[track_caller]
fn is_whole(bag: &Bag) {
    let messages: Vec<_> = bag.messages(None).map(Result::unwrap).collect();
    assert_eq!((messages.len(), bag.damage().count()), (COUNT as usize, 0));
    assert!(messages.windows(2).all(|pair| pair[0].log_time < pair[1].log_time));
    assert_eq!(messages[3].log_time.nanos(), 1_700_000_000_300_000_000);
    assert_eq!(messages[3].cdr, battery(3));
    let streams = bag.streams();
    assert_eq!(
        (streams.len(), &*streams[0].stream.name, streams[0].messages),
        (1, TOPIC, COUNT as u64)
    );
}

#[test]
fn databases_of_every_distribution_are_read() {
    let humble = format!("{FOXY}{HUMBLE}");
    for (name, tables) in
        [("dashing", DASHING), ("foxy", FOXY), ("humble", &humble), ("jazzy", JAZZY)]
    {
        let (folder, path) = written(tables);
        let bag = Bag::open(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        is_whole(&bag);
        let stream = &bag.streams()[0].stream;
        let Shape::Message(schema) = &stream.shape else { panic!("{name}: {:?}", stream.shape) };
        assert_eq!(schema.name, BatteryState::NAME, "{name}");
        assert_eq!(stream.qos.len(), usize::from(name != "dashing"), "{name}");
        assert_eq!(schema.hash, if name == "jazzy" { "RIHS01_00" } else { "" });
        // So is its folder, with and without a description.
        is_whole(&Bag::open(folder.path()).unwrap());
        let yaml = "rosbag2_bagfile_information:\n  version: 4\n  storage_identifier: sqlite3\n  \
                    relative_file_paths:\n    - bag_0.db3\n  compression_mode: \"\"\n";
        fs::write(folder.path().join("metadata.yaml"), yaml).unwrap();
        is_whole(&Bag::open(folder.path()).unwrap());
    }
}

#[test]
fn what_is_still_in_the_journal_is_read() {
    let (folder, path) = (tempdir().unwrap(), "bag_0.db3");
    let path = folder.path().join(path);
    let open = Connection::open(&path).unwrap();
    open.pragma_update(None, "journal_mode", "wal").unwrap();
    let writer = database(&path, FOXY);
    assert!(folder.path().join("bag_0.db3-wal").metadata().unwrap().len() > 0);
    is_whole(&Bag::open(&path).unwrap());
    drop((open, writer));
}

#[test]
fn a_file_that_was_compressed_as_a_whole_is_read() {
    let (folder, path) = written(JAZZY);
    let packed = zstd::encode_all(&*fs::read(&path).unwrap(), 3).unwrap();
    fs::write(folder.path().join("bag_0.db3.zstd"), &packed).unwrap();
    // Unpacked beside it, as `ros2 bag play` leaves it: it counts once.
    is_whole(&Bag::open(folder.path()).unwrap());
    fs::remove_file(&path).unwrap();
    is_whole(&Bag::open(folder.path()).unwrap());
    let yaml = "rosbag2_bagfile_information:\n  storage_identifier: sqlite3\n  \
                relative_file_paths:\n    - bag_0.db3.zstd\n  compression_format: zstd\n  \
                compression_mode: FILE\n";
    fs::write(folder.path().join("metadata.yaml"), yaml).unwrap();
    is_whole(&Bag::open(folder.path()).unwrap());

    // A cut one is read as far as it can be, and says so.
    let path = folder.path().join("bag_0.db3.zstd");
    fs::write(&path, &packed[..packed.len() - 8]).unwrap();
    match Bag::open(&path) {
        Ok(bag) => assert!(bag.damage().count() > 0),
        Err(error) => assert!(matches!(error, BagError::NotABag { .. }), "{error}"),
    }
}

/// Compresses every message of a database individually, as rosbag2 does in the mode `MESSAGE`.
fn pack_messages(path: &Path) {
    let database = Connection::open(path).expect("a database can be made");
    for id in 1..=COUNT {
        let query = "SELECT data FROM messages WHERE id = ?1";
        let plain: Vec<u8> =
            database.query_row(query, [id], |row| row.get(0)).expect("a database can be made");
        let packed = zstd::encode_all(&plain[..], 3).expect("a database can be made");
        let update = "UPDATE messages SET data = ?2 WHERE id = ?1";
        database.execute(update, params![id, packed]).expect("a database can be made");
    }
    database.close().expect("a database can be made");
}

/// The same in an MCAP file.
fn packed_mcap(path: &Path) {
    let options = mcap::WriteOptions::new().profile("ros2").compression(None);
    write_mcap(path, options, |cdr| zstd::encode_all(cdr, 3).expect("bytes can be packed"));
}

/// Messages in an MCAP file.
fn write_mcap(path: &Path, options: mcap::WriteOptions, packed: impl Fn(&[u8]) -> Vec<u8>) {
    let mut writer = options
        .create(fs::File::create(path).expect("a file can be made"))
        .expect("a file can be made");
    let text = shipped(BatteryState::NAME).expect("a file can be made").text.clone();
    let schema = writer
        .add_schema(BatteryState::NAME, "ros2msg", text.as_bytes())
        .expect("a file can be made");
    let channel_id =
        writer.add_channel(schema, TOPIC, "cdr", &BTreeMap::new()).expect("a file can be made");
    for number in 0..COUNT {
        let at_ns = 1_700_000_000_000_000_000 + number as u64 * 100_000_000;
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: number as u32,
            log_time: at_ns,
            publish_time: at_ns,
        };
        let packed = packed(&battery(number));
        writer.write_to_known_channel(&header, &packed).expect("a file can be made");
    }
    writer.finish().expect("a file can be made");
}

#[test]
fn a_file_without_checksums_is_known_as_one() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag_0.mcap");
    let lacks_checksums = |path: &Path| {
        let mut bag = Bag::open(path).unwrap();
        bag.check();
        is_whole(&bag);
        bag.lacks_checksums()
    };
    for has_checksums in [true, false] {
        let options = mcap::WriteOptions::new().calculate_chunk_crcs(has_checksums);
        write_mcap(&path, options, <[u8]>::to_vec);
        assert_eq!(lacks_checksums(&path), !has_checksums);
    }
    write_mcap(&path, mcap::WriteOptions::new().use_chunks(false), <[u8]>::to_vec);
    assert!(lacks_checksums(&path));
    let (_folder, database) = written(JAZZY);
    assert!(lacks_checksums(&database));
}

#[test]
fn messages_that_were_compressed_one_by_one_are_read() {
    let yaml = |storage: &str, file: &str| {
        format!(
            "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: {storage}\n  \
             relative_file_paths:\n    - {file}\n  compression_format: zstd\n  \
             compression_mode: MESSAGE\n"
        )
    };
    let (folder, path) = written(JAZZY);
    pack_messages(&path);
    is_whole(&Bag::open(&path).unwrap());
    fs::write(folder.path().join("metadata.yaml"), yaml("sqlite3", "bag_0.db3")).unwrap();
    is_whole(&Bag::open(folder.path()).unwrap());

    let folder = tempdir().unwrap();
    let path = folder.path().join("bag_0.mcap");
    packed_mcap(&path);
    let bytes = fs::read(&path).unwrap();
    is_whole(&Bag::open(&path).unwrap());
    fs::write(folder.path().join("metadata.yaml"), yaml("mcap", "bag_0.mcap")).unwrap();
    is_whole(&Bag::open(folder.path()).unwrap());
    assert!(recover(&path).is_err(), "what is no plain MCAP is not written over");
    assert_eq!(fs::read(&path).unwrap(), bytes);
}

#[test]
fn a_message_that_cannot_be_unpacked_is_damage_and_the_others_are_read() {
    let (_folder, path) = written(JAZZY);
    pack_messages(&path);
    let database = Connection::open(&path).unwrap();
    let torn = "UPDATE messages SET data = substr(data, 1, 20) WHERE id = 7";
    database.execute(torn, []).unwrap();
    database.close().unwrap();
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.messages(None).flatten().count(), COUNT as usize - 1);
    let reasons: Vec<&str> = bag.damage().map(|(_, damage)| &*damage.reason).collect();
    assert_eq!(reasons, ["1 message can't be unpacked"]);
}

/// The writer was killed within a transaction: the file contains its incomplete changes, and a file beside it the
/// previous contents.
#[test]
fn a_database_that_was_cut_off_is_read_up_to_its_last_whole_transaction() {
    let (folder, path) = written(FOXY);
    let database = Connection::open(&path).unwrap();
    for (name, value) in [("journal_mode", "delete"), ("synchronous", "full")] {
        database.pragma_update(None, name, value).unwrap();
    }
    // So little memory that the transaction is on the disk before it is whole.
    database.pragma_update(None, "cache_size", 1).unwrap();
    database.execute_batch("BEGIN; UPDATE messages SET topic_id = 9;").unwrap();
    let insert = "INSERT INTO messages VALUES (?1, 1, 5, ?2)";
    for id in 1000..1400 {
        database.execute(insert, params![id, vec![0_u8; 4096]]).unwrap();
    }
    let cut = folder.path().join("cut");
    fs::create_dir(&cut).unwrap();
    for file in ["bag_0.db3", "bag_0.db3-journal"] {
        fs::copy(folder.path().join(file), cut.join(file)).unwrap();
    }
    drop(database);
    let bytes = fs::read(cut.join("bag_0.db3")).unwrap();
    is_whole(&Bag::open(&cut.join("bag_0.db3")).unwrap());
    assert_eq!(fs::read(cut.join("bag_0.db3")).unwrap(), bytes, "it is left as it was");
}

#[test]
fn a_bomb_does_not_fill_the_disk() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag_0.mcap.zstd");
    let zeros = std::io::Read::take(std::io::repeat(0), 256 << 20);
    let bomb = zstd::encode_all(zeros, 1).unwrap();
    assert!(bomb.len() < 1 << 20);
    fs::write(&path, bomb).unwrap();
    assert!(Bag::open(&path).is_err());
}

#[test]
fn what_is_no_recording_is_refused() {
    let folder = tempdir().unwrap();
    let endless = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
        CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n)
        SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM n;";
    for (name, tables) in [("other", "CREATE TABLE x(y);"), ("empty", ""), ("endless", endless)] {
        let path = folder.path().join(format!("{name}.db3"));
        let database = Connection::open(&path).unwrap();
        database.execute_batch("PRAGMA user_version = 1;").unwrap();
        database.execute_batch(tables).unwrap();
        database.close().unwrap();
        let error = Bag::open(&path).unwrap_err();
        assert!(matches!(error, BagError::NotABag { found: Found::Sqlite, .. }), "{name}: {error}");
    }
}

#[test]
fn a_broken_database_is_read_as_far_as_it_goes_and_never_replaced() {
    let (_folder, path) = written(FOXY);
    let mut bytes = fs::read(&path).unwrap();
    let message = battery(40);
    let place = bytes.windows(message.len()).position(|each| each == message).unwrap();
    let page = place / 4096 * 4096;
    bytes[page..page + 4096].fill(0xff);
    fs::write(&path, &bytes).unwrap();
    match Bag::open(&path) {
        Ok(bag) => assert!(bag.damage().count() > 0),
        Err(error) => assert!(matches!(error, BagError::NotABag { .. }), "{error}"),
    }
    assert!(recover(&path).is_err());
    assert_eq!(fs::read(&path).unwrap(), bytes);
}

#[test]
fn streams_of_others_can_be_described_by_their_types() {
    let (_folder, path) = written(FOXY);
    let mut bag = Bag::open(&path).unwrap();
    bag.describe_foreign(|topic, type_name| {
        assert_eq!((topic, type_name), (TOPIC, BatteryState::NAME));
        let stream = Stream::raw(topic, Subject::robot("robot1"), Shape::Event);
        Some(Stream { signal: Signal::Battery, ..stream }.with_channels(&[("voltage", "V")]))
    });
    let stream = &bag.streams()[0].stream;
    assert_eq!((stream.signal, &*stream.channels[0].name), (Signal::Battery, "voltage"));
    assert!(matches!(stream.shape, Shape::Message(_)));
}
