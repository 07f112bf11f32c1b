//! Any bytes, read as a recording, then mended: an error or a bag, never a panic.
#![no_main]

use std::fs;

use libfuzzer_sys::fuzz_target;
use teampulse_bag::{Bag, recover};

/// How an MCAP file begins.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path = folder.path().join("x.mcap");
    fs::write(&path, [MAGIC, bytes].concat()).expect("it can be written to");
    let Ok(bag) = Bag::open(&path) else { return };
    let read = bag.messages(None).flatten().count();
    drop(bag.attachment("study.toml"));
    if recover(&path).is_ok() && bag.damage().count() > 0 {
        let mended = Bag::open(&path).expect("what was mended opens");
        assert_eq!(mended.messages(None).flatten().count(), read);
    }
});
