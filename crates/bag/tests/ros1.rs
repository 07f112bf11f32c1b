//! ROS 1 bags, written byte by byte from their documentation: as `rosbag` leaves them, cut off, and damaged.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

use std::fs;
use std::io::{Read, Write};

use proptest::prelude::*;
use teampulse_bag::{Bag, BagError, Found, recover};
use teampulse_core::qos::Durability;
use tempfile::tempdir;

const COUNT: u32 = 20;
const DEFINITION: &str = "Header header\nfloat64 K\n\
    ================================================================================\n\
    MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

#[derive(Clone, Copy, Debug, PartialEq)]
enum Packing {
    None,
    Bz2,
    Lz4,
}

fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| {
        let length = (name.len() + 1 + value.len()) as u32;
        [&length.to_le_bytes(), name.as_bytes(), b"=", value].concat()
    };
    fields.iter().flat_map(field).collect()
}

fn record(header: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = fields(header);
    let lengths = [header.len() as u32, data.len() as u32].map(u32::to_le_bytes);
    [&lengths[0], &header[..], &lengths[1], data].concat()
}

fn connection(number: u32, topic: &str, kind: &str, definition: &str) -> Vec<u8> {
    let data = fields(&[
        ("topic", topic.as_bytes()),
        ("type", kind.as_bytes()),
        ("md5sum", b"*"),
        ("message_definition", definition.as_bytes()),
        ("latching", b"1"),
    ]);
    let header: [(&str, &[u8]); 3] =
        [("op", &[7]), ("conn", &number.to_le_bytes()), ("topic", topic.as_bytes())];
    record(&header, &data)
}

fn message(number: u32, at_secs: u32, data: &[u8]) -> Vec<u8> {
    let time = [at_secs.to_le_bytes(), 5_u32.to_le_bytes()].concat();
    record(&[("op", &[2]), ("conn", &number.to_le_bytes()), ("time", &time)], data)
}

/// A message with a header stamped half a second earlier.
fn gain(number: u32, at_secs: u32) -> Vec<u8> {
    let parts = [number, at_secs - 1, 500_000_000, 0].map(u32::to_le_bytes);
    [&parts.concat()[..], &f64::from(number).to_le_bytes()].concat()
}

fn packed(plain: &[u8], packing: Packing) -> Vec<u8> {
    match packing {
        Packing::None => plain.to_vec(),
        Packing::Bz2 => {
            let mut packed = Vec::new();
            let level = bzip2::Compression::best();
            bzip2::read::BzEncoder::new(plain, level).read_to_end(&mut packed).unwrap();
            packed
        }
        Packing::Lz4 => {
            let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
            encoder.write_all(plain).unwrap();
            encoder.finish().0
        }
    }
}

fn chunk(plain: &[u8], packing: Packing) -> Vec<u8> {
    let name: &[u8] = match packing {
        Packing::None => b"none",
        Packing::Bz2 => b"bz2",
        Packing::Lz4 => b"lz4",
    };
    let size = (plain.len() as u32).to_le_bytes();
    record(&[("op", &[5]), ("compression", name), ("size", &size)], &packed(plain, packing))
}

fn bag_header(index_at: u64) -> Vec<u8> {
    let none = 0_u32.to_le_bytes();
    let index_at = index_at.to_le_bytes();
    let header: [(&str, &[u8]); 4] =
        [("op", &[3]), ("index_pos", &index_at), ("conn_count", &none), ("chunk_count", &none)];
    record(&header, &[b' '; 4027])
}

/// A whole bag of two chunks, with its index.
fn whole(packing: Packing) -> Vec<u8> {
    let connected = connection(0, "/arm/gain", "own_msgs/Gain", DEFINITION);
    let of = |numbers: std::ops::Range<u32>| -> Vec<u8> {
        numbers.flat_map(|n| message(0, 1_700_000_000 + n, &gain(n, 1_700_000_000 + n))).collect()
    };
    let first = chunk(&[connected.clone(), of(0..COUNT / 2)].concat(), packing);
    let second = chunk(&of(COUNT / 2..COUNT), packing);
    let index = record(&[("op", &[4]), ("conn", &0_u32.to_le_bytes())], &[0; 12]);
    let chunks = [&first[..], &index, &second, &index].concat();
    let start = b"#ROSBAG V2.0\n";
    let index_at = (start.len() + bag_header(0).len() + chunks.len()) as u64;
    let info = record(&[("op", &[6])], &[0; 8]);
    [&start[..], &bag_header(index_at), &chunks, &connected, &info].concat()
}

fn opened(bytes: &[u8]) -> Result<Bag, BagError> {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.bag");
    fs::write(&path, bytes).unwrap();
    Bag::open(&path)
}

fn damage(bag: &Bag) -> String {
    bag.damage().map(|(_, damage)| damage.reason.clone()).collect::<Vec<_>>().join("; ")
}

#[test]
fn a_bag_of_ros_1_is_read_whatever_its_compression() {
    for packing in [Packing::None, Packing::Bz2, Packing::Lz4] {
        let bag = opened(&whole(packing)).unwrap();
        assert_eq!(damage(&bag), "", "{packing:?}");
        let [stream] = bag.streams() else { panic!("{:?}", bag.streams()) };
        assert_eq!(stream.stream.name, "/arm/gain");
        assert_eq!(stream.stream.qos[0].durability, Durability::TransientLocal);
        let messages: Vec<_> = bag.messages(None).map(Result::unwrap).collect();
        assert_eq!(messages.len(), COUNT as usize);
        for (number, message) in messages.iter().enumerate() {
            let secs = 1_700_000_000 + number as i64;
            assert_eq!(message.log_time.nanos(), secs * 1_000_000_000 + 5);
            let mut cdr = [0, 1, 0, 0].to_vec();
            cdr.extend([secs as u32 - 1, 500_000_000, 1].map(u32::to_le_bytes).concat());
            cdr.extend([0; 4]);
            cdr.extend((number as f64).to_le_bytes());
            assert_eq!(message.cdr[..], cdr);
        }
    }
}

#[test]
fn a_recording_that_was_not_closed_is_read_as_far_as_it_goes() {
    for packing in [Packing::None, Packing::Bz2, Packing::Lz4] {
        let plain = [
            connection(3, "/e", "std_msgs/Empty", ""),
            message(3, 1_700_000_000, &[]),
            message(3, 1_700_000_001, &[]),
        ]
        .concat();
        let mut open = chunk(&plain, packing);
        let length_at = open.len() - packed(&plain, packing).len() - 4;
        open[length_at..length_at + 4].fill(0);
        open.truncate(open.len() - if packing == Packing::None { 3 } else { 0 });
        let bag = opened(&[b"#ROSBAG V2.0\n", &bag_header(0)[..], &open].concat()).unwrap();
        let expected = if packing == Packing::None { 1 } else { 2 };
        assert_eq!(bag.messages_count(), expected, "{packing:?}");
        assert_eq!(damage(&bag), "it was truncated: its last chunk is read as far as possible");
    }
}

#[test]
fn messages_that_do_not_fit_their_definition_are_counted() {
    let plain = [
        connection(1, "/a", "std_msgs/String", "string data\n"),
        connection(2, "/b", "own/B", "own/C c\n"),
        message(1, 1, b"\x02\0\0\0ok"),
        message(1, 2, b"\x09\0\0\0no"),
        message(2, 3, b""),
        message(9, 4, b""),
    ]
    .concat();
    let bag =
        opened(&[b"#ROSBAG V2.0\n", &bag_header(0)[..], &chunk(&plain, Packing::None)].concat())
            .unwrap();
    assert_eq!(bag.messages_count(), 1);
    let expected = "1 message of /a can't be converted: failed to read 9 bytes at byte 4 of a \
        message: 2 are left; 1 message of /b can't be converted: failed to read the definition of \
        own/msg/C: it is not known; 1 message belongs to no known connection";
    assert_eq!(damage(&bag), expected);
}

#[test]
fn what_is_no_readable_bag_of_ros_1_is_named() {
    let found = |bytes: &[u8]| match opened(bytes) {
        Err(BagError::NotABag { found, .. }) => found,
        other => panic!("{other:?}"),
    };
    assert_eq!(found(b"#ROSBAG V1.2\n and so on"), Found::Ros1);
    assert_eq!(found(b"#ROSBAG V2.0\n"), Found::Ros1);
    let sealed = record(&[("op", &[3]), ("encryptor", b"rosbag/AesCbcEncryptor")], &[b' '; 100]);
    assert_eq!(found(&[b"#ROSBAG V2.0\n", &sealed[..]].concat()), Found::Encrypted);
}

#[test]
fn a_bag_of_ros_1_is_never_repaired() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.bag");
    fs::write(&path, whole(Packing::None)).unwrap();
    let error = recover(&path).unwrap_err();
    assert!(matches!(error, BagError::NotABag { found: Found::Foreign, .. }));
    assert_eq!(fs::read(&path).unwrap(), whole(Packing::None));
}

fn packings() -> impl Strategy<Value = Packing> {
    prop_oneof![Just(Packing::None), Just(Packing::Bz2), Just(Packing::Lz4)]
}

proptest! {
    #[test]
    fn a_bag_that_was_cut_off_keeps_what_is_before(packing in packings(), share in 0.0..1.0) {
        let mut bytes = whole(packing);
        bytes.truncate((bytes.len() as f64 * share) as usize);
        if let Ok(bag) = opened(&bytes) {
            prop_assert_eq!(bag.messages(None).flatten().count() as u64, bag.messages_count());
            prop_assert!(bag.messages_count() <= u64::from(COUNT));
        }
    }

    #[test]
    fn changed_bytes_give_a_bag_or_an_error(
        packing in packings(),
        changes in prop::collection::vec((4100_usize..5600, any::<u8>()), 1..8),
    ) {
        let mut bytes = whole(packing);
        for (at, byte) in changes {
            let at = at.min(bytes.len() - 1);
            bytes[at] = byte;
        }
        if let Ok(bag) = opened(&bytes) {
            prop_assert_eq!(bag.messages(None).flatten().count() as u64, bag.messages_count());
        }
    }
}

/// Chunks of a few bytes, each of which unpacks to 20 MB of zeros.
#[test]
fn chunks_that_unpack_without_end_are_given_up() {
    let bomb = chunk(&vec![0; 20_000_000], Packing::Bz2);
    let mut bytes = [b"#ROSBAG V2.0\n", &bag_header(0)[..]].concat();
    (0..30).for_each(|_| bytes.extend(&bomb));
    let bag = opened(&bytes).unwrap();
    assert_eq!(bag.messages_count(), 0);
    assert!(damage(&bag).contains("it unpacks to far more than its size"), "{}", damage(&bag));
}
