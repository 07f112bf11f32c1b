//! Any bytes, read as a recording, then mended, and as a bag of ROS 1: an error or a bag, never a panic.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use teampulse_bag::{Bag, recover};

/// How an MCAP file begins.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// How a bag of ROS 1 begins, with the header that it needs.
const ROS1: &[u8] = b"#ROSBAG V2.0\n\x08\0\0\0\x04\0\0\0op=\x03\0\0\0\0";

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path = folder.path().join("x.mcap");
    fs::write(&path, [ROS1, bytes].concat()).expect("it can be written to");
    if let Ok(bag) = Bag::open(&path) {
        assert_eq!(bag.messages(None).flatten().count() as u64, bag.messages_count());
    }
    fs::write(&path, [MAGIC, bytes].concat()).expect("it can be written to");
    let Ok(bag) = Bag::open(&path) else { return };
    let read = bag.messages(None).flatten().count();
    drop(bag.attachment("study.toml"));
    if recover(&path).is_ok() && bag.damage().count() > 0 {
        let mended = Bag::open(&path).expect("what was mended opens");
        assert_eq!(mended.messages(None).flatten().count(), read);
    }
});
