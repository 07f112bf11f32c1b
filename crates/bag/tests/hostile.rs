//! Bags that were changed at random, and bags made to do harm: they are read as far as possible, in bounded memory.
//! `PROPTEST_CASES=5000` tries more of them.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

mod memory;
mod session;

use std::fs;
use std::path::Path;

use memory::most_during;
use proptest::prelude::*;
use session::session;
use teampulse_bag::{Bag, BagWriter, Compression, Options, recover};
use tempfile::tempdir;

/// The most memory for reading one bag [B].
const MOST_BYTES: i64 = 300_000_000;

/// The bytes of a bag of one file.
fn whole(compression: Compression) -> Vec<u8> {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let mut writer =
        BagWriter::create(&path, &Options { compression, ..Options::default() }).unwrap();
    for (number, record) in session(90).iter().enumerate() {
        writer.write(record).unwrap();
        if number % 30 == 29 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    fs::read(path.join("bag_0.mcap")).unwrap()
}

/// A change to a file, at a share of its length.
#[derive(Clone, Debug)]
enum Change {
    Flip { at: f64, bit: u32 },
    Number { at: f64, number: u64 },
    Zeros { at: f64, length: usize },
    Cut { at: f64 },
    Leave { at: f64, length: usize },
    Repeat { at: f64, length: usize },
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let place =
            |at: &f64| ((bytes.len() as f64 * at) as usize).min(bytes.len().saturating_sub(1));
        match self {
            Change::Flip { at, bit } => {
                let place = place(at);
                bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= 1 << bit);
            }
            Change::Number { at, number } => {
                let place = place(at);
                let number = number.to_le_bytes();
                bytes.iter_mut().skip(place).zip(number).for_each(|(byte, new)| *byte = new);
            }
            Change::Zeros { at, length } => {
                let place = place(at);
                bytes.iter_mut().skip(place).take(*length).for_each(|byte| *byte = 0);
            }
            Change::Cut { at } => bytes.truncate(place(at)),
            Change::Leave { at, length } => {
                let place = place(at);
                drop(bytes.drain(place..(place + length).min(bytes.len())));
            }
            Change::Repeat { at, length } => {
                let place = place(at);
                let again = bytes[place..(place + length).min(bytes.len())].to_vec();
                drop(bytes.splice(place..place, again));
            }
        }
    }
}

fn changes() -> impl Strategy<Value = Vec<Change>> {
    let number = prop_oneof![
        any::<u64>(),
        prop::sample::select(vec![
            0,
            1,
            u64::MAX,
            1 << 62,
            255 << 20,
            300 << 20,
            u64::from(u32::MAX)
        ]),
    ];
    let at = || 0.0..1.0;
    let change = prop_oneof![
        6 => (at(), 0_u32..8).prop_map(|(at, bit)| Change::Flip { at, bit }),
        2 => (at(), number).prop_map(|(at, number)| Change::Number { at, number }),
        1 => (at(), 1_usize..64).prop_map(|(at, length)| Change::Zeros { at, length }),
        1 => at().prop_map(|at| Change::Cut { at }),
        1 => (at(), 1_usize..64).prop_map(|(at, length)| Change::Leave { at, length }),
        1 => (at(), 1_usize..512).prop_map(|(at, length)| Change::Repeat { at, length }),
    ];
    prop::collection::vec(change, 1..4)
}

/// Reads everything that can be read from a file.
fn read(path: &Path) -> usize {
    let Ok(mut bag) = Bag::open(path) else { return 0 };
    bag.check();
    drop(bag.attachment("study.toml"));
    drop(bag.lost_to_damage());
    bag.messages(None).flatten().count()
}

proptest! {
    #[test]
    fn a_bag_that_was_changed_at_random_is_read_in_bounded_memory(
        which in 0_usize..3, changes in changes(), is_mended in any::<bool>(),
    ) {
        let compression = [Compression::None, Compression::Lz4, Compression::Zstd][which];
        let mut bytes = whole(compression);
        for change in &changes {
            change.apply(&mut bytes);
        }
        let folder = tempdir().unwrap();
        let path = folder.path().join("x.mcap");
        fs::write(&path, bytes).unwrap();
        let most = most_during(|| read(&path));
        prop_assert!(most < MOST_BYTES, "{most} bytes");
        if is_mended && recover(&path).is_ok() {
            prop_assert!(Bag::open(&path).is_ok());
        }
    }
}

/// A record of a file.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// A file with one chunk that claims this uncompressed size.
fn with_chunk(compression: &str, packed: &[u8], unpacked_bytes: u64) -> Vec<u8> {
    let name = [&(compression.len() as u32).to_le_bytes()[..], compression.as_bytes()].concat();
    let chunk = [
        &[0; 16][..],
        &unpacked_bytes.to_le_bytes(),
        &[0; 4],
        &name,
        &(packed.len() as u64).to_le_bytes(),
        packed,
    ]
    .concat();
    [&b"\x89MCAP0\r\n"[..], &record(1, &[0; 8]), &record(6, &chunk)].concat()
}

fn most_of(bytes: &[u8]) -> i64 {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    fs::write(&path, bytes).unwrap();
    most_during(|| read(&path))
}

#[test]
fn a_chunk_that_unpacks_to_far_more_than_it_is_takes_bounded_memory() {
    let length = 250_usize << 20;
    let mut zeros = vec![0; length];
    // One record as long as all of it.
    zeros[0] = 0x80;
    zeros[1..9].copy_from_slice(&(length as u64 - 9).to_le_bytes());
    let packed = zstd::bulk::compress(&zeros, 1).unwrap();
    assert!(packed.len() < 100_000);
    for said in [length as u64, 1000, u64::MAX, 256 << 20] {
        let most = most_of(&with_chunk("zstd", &packed, said));
        assert!(most < MOST_BYTES, "{most} bytes for {said}");
    }
}

#[test]
fn a_chunk_of_millions_of_empty_messages_takes_bounded_memory() {
    let messages = record(5, &[0; 22]).repeat(2_000_001);
    let most = most_of(&with_chunk("", &messages, messages.len() as u64));
    assert!(most < MOST_BYTES, "{most} bytes");
}
