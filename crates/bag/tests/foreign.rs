//! Bags that others wrote.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use std::time::Duration;

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use teampulse_bag::Bag;
use teampulse_core::qos::Qos;
use teampulse_core::stream::{About, Origin, Shape};
use tempfile::tempdir;

/// Writes messages of two topics, the times of which cross, by the crate `mcap` alone.
fn write(path: &Path, options: WriteOptions) {
    let mut writer = options.create(BufWriter::new(File::create(path).unwrap())).unwrap();
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").unwrap();
    let qos = "- history: 1\n  depth: 5\n  reliability: 2\n  durability: 2\n  deadline:\n    \
               sec: 1\n    nsec: 500000000\n";
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
    let channels = ["/r2/words", "/r2/other"]
        .map(|topic| writer.add_channel(schema, topic, "cdr", &metadata).unwrap());
    for k in 0..1000_u64 {
        let header = MessageHeader {
            channel_id: channels[k as usize % 2],
            sequence: 0,
            log_time: 1_000 + 10 * (k ^ 7),
            publish_time: 900 + 10 * (k ^ 7),
        };
        writer.write_to_known_channel(&header, &k.to_le_bytes()).unwrap();
    }
    writer.finish().unwrap();
}

fn is_read_in_order(path: &Path) {
    let bag = Bag::open(path).unwrap();
    assert_eq!(bag.damage().count(), 0);
    assert_eq!(bag.messages_count(), 1000);
    let numbers = bag.messages(None).map(|message| {
        let message = message.unwrap();
        assert_eq!(message.log_time.nanos_since(message.publish_time), 100);
        u64::from_le_bytes(message.cdr.as_ref().try_into().unwrap())
    });
    assert!(numbers.eq((0..1000).map(|k| k ^ 7)));
}

#[test]
fn any_layout_of_mcap_is_read_in_order() {
    let folder = tempdir().unwrap();
    let options = || WriteOptions::new().compression(None);
    let layouts = [
        options(),
        options().chunk_size(Some(100)),
        options().use_chunks(false),
        options().emit_summary_records(false).emit_summary_offsets(false),
        options().emit_message_indexes(false),
        options().repeat_channels(false),
        options().emit_chunk_indexes(false).chunk_size(Some(1000)),
        options().calculate_chunk_crcs(false).calculate_summary_section_crc(false),
        options().compression(Some(mcap::Compression::Zstd)).chunk_size(Some(500)),
        options().compression(Some(mcap::Compression::Lz4)).chunk_size(Some(500)),
    ];
    for (k, layout) in layouts.into_iter().enumerate() {
        let path = folder.path().join(format!("{k}.mcap"));
        write(&path, layout);
        is_read_in_order(&path);
    }
}

#[test]
fn what_others_recorded_is_raw_and_about_a_robot() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    write(&path, WriteOptions::new());
    let bag = Bag::open(&path).unwrap();
    let words = &bag.streams()[0];
    assert_eq!(words.messages, 500);
    assert_eq!((words.stream.about, words.stream.id.as_str()), (About::Robot, "r2"));
    assert_eq!(words.stream.origin, Origin::Raw);
    let deadline = Some(Duration::from_millis(1500));
    assert_eq!(words.stream.qos, [Qos { deadline, ..Qos::best_effort(5) }]);
    let Shape::Message(schema) = &words.stream.shape else { panic!("{words:?}") };
    assert_eq!(
        (schema.name.as_str(), schema.text.as_str()),
        ("std_msgs/msg/String", "string data\n")
    );
}

#[test]
fn files_are_read_in_the_order_of_their_numbers() {
    let folder = tempdir().unwrap();
    for number in [10, 2, 9] {
        let mut writer = WriteOptions::new()
            .create(BufWriter::new(
                File::create(folder.path().join(format!("x_{number}.mcap"))).unwrap(),
            ))
            .unwrap();
        let channel = writer.add_channel(0, "/t", "cdr", &BTreeMap::new()).unwrap();
        let header =
            MessageHeader { channel_id: channel, sequence: number, log_time: 5, publish_time: 5 };
        writer.write_to_known_channel(&header, b"").unwrap();
        writer.finish().unwrap();
    }
    let sequences = |folder: &Path| -> Vec<u32> {
        let bag = Bag::open(folder).unwrap();
        bag.messages(None).map(|message| message.unwrap().sequence).collect()
    };
    assert_eq!(sequences(folder.path()), [2, 9, 10]);
    let yaml = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  \
                relative_file_paths:\n    - x_10.mcap\n    - x_2.mcap\n    - x_9.mcap\n";
    fs::write(folder.path().join("metadata.yaml"), yaml).unwrap();
    assert_eq!(sequences(folder.path()), [10, 2, 9]);
}
