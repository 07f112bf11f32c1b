//! What is written can be read back.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

mod session;

use std::path::Path;
use std::sync::Arc;

use proptest::prelude::*;
use session::{at, battery, descriptions, record, session, text};
use teampulse_bag::{
    Attachment, Bag, BagError, BagWriter, Compression, Message, Options, Place, Version, recover,
};
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::stream::{Origin, Schema, Shape};
use tempfile::tempdir;

fn write(folder: &Path, options: &Options, records: &[Record]) {
    let mut writer = BagWriter::create(folder, options).unwrap();
    for record in records {
        writer.write(record).unwrap();
    }
    let summary = writer.finish().unwrap();
    assert!(summary.messages >= records.len() as u64);
}

fn read(bag: &Bag) -> Vec<Message> {
    bag.messages(None).collect::<Result<_, _>>().unwrap()
}

fn is_as_written(bag: &Bag, message: &Message, record: &Record) -> bool {
    let sample = &record.sample;
    bag.streams()[message.stream].stream.name == record.stream.name
        && message.log_time == sample.log_time
        && message.publish_time == sample.source_time.unwrap_or(sample.measured)
        && u64::from(message.sequence) == sample.index
        && message.cdr == record.cdr
}

fn all_are_as_written(bag: &Bag, messages: &[Message], records: &[Record]) -> bool {
    messages.len() == records.len()
        && messages.iter().zip(records).all(|(message, record)| is_as_written(bag, message, record))
}

#[test]
fn what_is_written_comes_back_in_its_order() {
    let folder = tempdir().unwrap();
    let records = session(5000);
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let path = folder.path().join(format!("{compression:?}"));
        write(&path, &Options { compression, ..Options::default() }, &records);
        let bag = Bag::open(&path).unwrap();
        assert!(all_are_as_written(&bag, &read(&bag), &records));
        assert_eq!(bag.damage().count(), 0);
        assert_eq!(bag.messages_count(), records.len() as u64);
        assert_eq!(bag.bounds().unwrap().1, records.last().unwrap().sample.log_time);
    }
}

#[test]
fn streams_come_back_as_they_were_described() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write(&path, &Options { session: "pilot".into(), ..Options::default() }, &session(9));
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.notes()["session"], "pilot");
    for expected in [battery(), session::ecg(), session::rate()] {
        let found = bag.streams().iter().find(|known| known.stream.name == expected.name).unwrap();
        assert_eq!(*found.stream, expected);
        assert_eq!(found.messages, 3);
    }
}

#[test]
fn reading_can_begin_anywhere() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let records = session(3000);
    write(&path, &Options::default(), &records);
    let bag = Bag::open(&path).unwrap();
    for skipped in [0, 1, 777, records.len() - 1] {
        let from = records[skipped].sample.log_time;
        let read: Vec<Message> = bag.messages(Some(from)).collect::<Result<_, _>>().unwrap();
        let expected = records.iter().filter(|record| record.sample.log_time >= from).count();
        assert_eq!(read.len(), expected);
    }
    assert_eq!(bag.messages(Some(at(i64::MAX / 2))).count(), 0);
}

#[test]
fn a_recording_never_overwrites_another() {
    let folder = tempdir().unwrap();
    let refused = BagWriter::create(folder.path(), &Options::default()).err().unwrap();
    assert!(matches!(refused, BagError::Exists { .. }));
    assert!(!refused.hint().is_empty());
}

#[test]
fn a_folder_that_was_made_for_a_bag_takes_one_and_no_second() {
    let folder = tempdir().unwrap();
    let claimed = Options { place: Place::Claimed, ..Options::default() };
    BagWriter::create(folder.path(), &claimed).unwrap().finish().unwrap();
    assert!(Bag::open(folder.path()).is_ok());
    let refused = BagWriter::create(folder.path(), &claimed).err().unwrap();
    assert!(matches!(refused, BagError::Exists { .. }));
    let nowhere = folder.path().join("nowhere");
    assert!(BagWriter::create(&nowhere, &claimed).is_err() && !nowhere.exists());
}

#[test]
fn every_file_of_a_bag_begins_with_the_descriptions() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let records = session(2000);
    write(&path, &Options { split_secs: Some(0.5), ..Options::default() }, &records);
    let bag = Bag::open(&path).unwrap();
    let is_description =
        |message: &&Message| bag.streams()[message.stream].stream.name == "/teampulse/streams";
    let messages = read(&bag);
    assert_eq!(messages.iter().filter(is_description).count(), 3 * 4);
    let data = messages.iter().filter(|message| !is_description(message));
    assert!(data.zip(&records[3..]).all(|(message, record)| is_as_written(&bag, message, record)));

    for number in 0..4 {
        let part = Bag::open(&path.join(format!("bag_{number}.mcap"))).unwrap();
        assert_eq!(part.messages(None).take(3).flatten().count(), 3);
        let ecg = part.streams().iter().find(|known| known.stream.name.ends_with("/ecg"));
        assert_eq!(*ecg.unwrap().stream, session::ecg());
    }
}

#[test]
fn a_large_file_is_followed_by_another() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options {
        split_bytes: Some(1 << 20),
        compression: Compression::None,
        ..Options::default()
    };
    let records = session(60_000);
    write(&path, &options, &records);
    let files = std::fs::read_dir(&path).unwrap().count();
    assert!(files > 3, "{files} files");
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.messages_count(), (records.len() + 3 * (files - 2)) as u64);
}

#[test]
fn two_types_on_one_topic_are_two_streams() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let mut other = battery();
    let schema = Schema {
        name: "std_msgs/msg/Header".into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    other.shape = Shape::Message(Arc::new(schema));
    let streams = [Arc::new(battery()), Arc::new(other)];
    let records: Vec<Record> = (0..10)
        .map(|k| record(k % 2, &streams[k as usize % 2], at(i64::from(k)), 0, text("x")))
        .collect();
    write(&path, &Options::default(), &records);
    let bag = Bag::open(&path).unwrap();
    let counts: Vec<u64> = bag.streams().iter().map(|known| known.messages).collect();
    assert_eq!(counts, [5, 5]);
    assert!(all_are_as_written(&bag, &read(&bag), &records));
}

#[test]
fn a_definition_that_becomes_known_is_kept_with_what_came_before() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let mut unknown = battery();
    let Shape::Message(schema) = &mut unknown.shape else { unreachable!() };
    Arc::make_mut(schema).text.clear();
    let streams = [Arc::new(unknown), Arc::new(battery())];
    let records: Vec<Record> =
        (0..4).map(|k| record(0, &streams[k / 2], at(k as i64), k as u64, text("x"))).collect();
    write(&path, &Options::default(), &records);
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.streams().len(), 1);
    assert_eq!(bag.streams()[0].stream.shape, battery().shape);
    let texts: Vec<bool> =
        read(&bag).iter().map(|message| message.schema.text.is_empty()).collect();
    assert_eq!(texts, [true, true, false, false]);
}

#[test]
fn an_attachment_comes_back() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let mut writer = BagWriter::create(&path, &Options::default()).unwrap();
    let study = Attachment {
        name: "study.toml",
        media_type: "application/toml",
        log_time: at(0),
        bytes: b"[session]",
    };
    writer.attach(study).unwrap();
    writer.finish().unwrap();
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.attachment("study.toml").unwrap().unwrap(), b"[session]");
    assert_eq!(bag.attachment("other").unwrap(), None);
    assert_eq!(bag.bounds(), None);
}

#[test]
fn a_whole_bag_is_left_as_it_is_by_recovery() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options { metadata_version: Version::V5, ..Options::default() };
    write(&path, &options, &session(100));
    let contents = |name: &str| std::fs::read(path.join(name)).unwrap();
    let before = (contents("bag_0.mcap"), contents("metadata.yaml"));
    let report = recover(&path).unwrap();
    assert!(report.files[0].damage.is_empty());
    assert!(before.0 == contents("bag_0.mcap"));
    assert_eq!(String::from_utf8(before.1), String::from_utf8(contents("metadata.yaml")));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn messages_of_any_order_come_back_by_time_and_place(
        times in prop::collection::vec(0_i64..50, 1..300),
        split_secs in prop::option::of(1e-9..50e-9),
    ) {
        let folder = tempdir().unwrap();
        let path = folder.path().join("bag");
        let stream = Arc::new(battery());
        let records: Vec<Record> = times.iter().enumerate()
            .map(|(k, time)| record(0, &stream, at(*time), k as u64, text(&"x".repeat(k))))
            .collect();
        write(&path, &Options { split_secs, ..Options::default() }, &records);
        let bag = Bag::open(&path).unwrap();
        let mut expected = records.clone();
        expected.sort_by_key(|record| record.sample.log_time);
        prop_assert!(all_are_as_written(&bag, &read(&bag), &expected));
    }
}

#[test]
fn raw_and_derived_are_distinguished() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let described = Arc::new(descriptions());
    let mut records = session(3);
    records.push(record(3, &described, at(9), 9, Data::Description(described.clone())));
    write(&path, &Options::default(), &records);
    let bag = Bag::open(&path).unwrap();
    let derived: Vec<&str> = bag
        .streams()
        .iter()
        .filter(|known| known.stream.origin == Origin::Derived)
        .map(|known| known.stream.name.as_str())
        .collect();
    assert_eq!(derived, ["/teampulse/streams", "/humans/persons/p001/strap/ecg/rate"]);
}

#[test]
fn a_bag_can_be_read_by_its_owner_alone() {
    use std::os::unix::fs::PermissionsExt;
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let folder = tempdir().unwrap();
    let (sessions, bag) = (folder.path().join("sessions"), folder.path().join("sessions/bag"));
    let split = Options { split_secs: Some(0.01), ..Options::default() };
    write(&bag, &split, &session(60));
    assert_eq!((mode(&sessions), mode(&bag)), (0o700, 0o700));
    let file = bag.join("bag_0.mcap");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 60]).unwrap();
    recover(&bag).unwrap();
    let files = std::fs::read_dir(&bag).unwrap().map(|entry| entry.unwrap().path());
    let modes: Vec<u32> = files.map(|path| mode(&path)).collect();
    assert!(modes.len() > 3 && modes.iter().all(|mode| *mode == 0o600), "{modes:?}");
}
