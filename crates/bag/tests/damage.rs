//! A recording that was cut off or damaged, and files that are not recordings.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

mod session;

use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use session::session;
use teampulse_bag::{
    Bag, BagError, BagWriter, Compression, Found, Message, Options, Version, recover,
};
use teampulse_core::sample::Record;
use tempfile::tempdir;

/// Writes a bag of one file as a killed process leaves it: flushed, never finished.
fn write_and_die(folder: &Path, compression: Compression, records: &[Record]) {
    let options = Options { compression, ..Options::default() };
    let mut writer = BagWriter::create(folder, &options).unwrap();
    for (k, record) in records.iter().enumerate() {
        writer.write(record).unwrap();
        if k % 40 == 39 {
            writer.flush().unwrap();
        }
    }
    std::mem::forget(writer);
    unlock(&folder.join("bag_0.mcap"));
}

/// Makes a file one of a process that ended, which is no longer locked.
fn unlock(part: &Path) {
    let copy = part.with_extension("copy");
    fs::copy(part, &copy).unwrap();
    fs::rename(&copy, part).unwrap();
}

/// Writes a whole bag of one file; returns the length of the file after each flush.
fn write(folder: &Path, compression: Compression, records: &[Record]) -> Vec<u64> {
    let options = Options { compression, ..Options::default() };
    let mut writer = BagWriter::create(folder, &options).unwrap();
    let mut lengths = Vec::new();
    for batch in records.chunks(40) {
        for record in batch {
            writer.write(record).unwrap();
        }
        writer.flush().unwrap();
        lengths.push(fs::metadata(folder.join("bag_0.mcap")).unwrap().len());
    }
    writer.finish().unwrap();
    lengths
}

fn read(path: &Path) -> Vec<Message> {
    Bag::open(path).unwrap().messages(None).map(Result::unwrap).collect()
}

#[test]
fn a_bag_that_is_being_recorded_is_read_and_never_repaired() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let mut writer = BagWriter::create(&path, &Options::default()).unwrap();
    for record in session(100) {
        writer.write(&record).unwrap();
    }
    writer.flush().unwrap();
    let bag = Bag::open(&path).unwrap();
    assert_eq!((bag.messages_count() > 50, bag.damage().count(), bag.missing()), (true, 0, 0));
    assert!(bag.is_being_recorded() && !bag.can_be_repaired());
    let before = fs::read(path.join("bag_0.mcap")).unwrap();
    assert!(matches!(recover(&path), Err(BagError::InUse { .. })));
    assert_eq!(fs::read(path.join("bag_0.mcap")).unwrap(), before);
    let messages = writer.finish().unwrap().messages;
    let bag = Bag::open(&path).unwrap();
    assert_eq!((bag.messages_count(), bag.is_being_recorded()), (messages, false));
    assert_eq!(recover(&path).unwrap().files[0].damage, []);
}

#[test]
fn an_empty_file_is_not_a_bag_but_one_beside_others_is_only_damaged() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write(&path, Compression::Zstd, &session(100));
    let empty = path.join("bag_1.mcap");
    fs::write(&empty, "").unwrap();
    let refused = Bag::open(&empty).unwrap_err();
    assert!(matches!(refused, BagError::NotABag { found: Found::Empty, .. }), "{refused}");
    let bag = Bag::open(&path).unwrap();
    assert_eq!((bag.messages_count() > 50, bag.damage().count()), (true, 1));
}

#[test]
fn what_was_flushed_survives_the_process() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let records = session(117);
    write_and_die(&path, Compression::Zstd, &records);
    assert_eq!(read(&path).len(), 120);
    let report = recover(&path).unwrap();
    assert_eq!(report.files[0].messages, 120);
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.damage().count(), 0);
    assert!(read(&path).iter().zip(&records).all(|(message, record)| message.cdr == record.cdr));
}

#[test]
fn a_recording_that_died_at_once_is_an_empty_bag() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write_and_die(&path, Compression::Zstd, &[]);
    assert_eq!(read(&path).len(), 0);
    fs::write(path.join("bag_0.mcap"), b"").unwrap();
    assert_eq!(read(&path).len(), 0);
    recover(&path).unwrap();
    assert_eq!(Bag::open(&path).unwrap().damage().count(), 0);
}

#[test]
fn a_bag_cut_at_any_byte_of_its_last_chunk_opens_with_what_is_before_the_cut() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let folder = tempdir().unwrap();
        let path = folder.path().join("bag");
        let flushed = write(&path, compression, &session(60));
        let whole = read(&path);
        let bytes = fs::read(path.join("bag_0.mcap")).unwrap();
        let last_chunk = flushed[0] as usize..=flushed[1] as usize;
        let mut known = 0;
        for length in last_chunk.chain((flushed[1] as usize..bytes.len()).step_by(53)) {
            let cut = folder.path().join("cut.mcap");
            fs::write(&cut, &bytes[..length]).unwrap();
            let bag = Bag::open(&cut).unwrap();
            let left: Vec<Message> = bag.messages(None).map(Result::unwrap).collect();
            assert!(whole.iter().zip(&left).all(|(whole, left)| whole.cdr == left.cdr));
            assert!(left.len() >= known.max(40), "a longer file holds no less: {length}");
            assert!(bag.damage().count() > 0);
            known = left.len();
        }
        assert_eq!(known, whole.len());
    }
}

#[test]
fn a_cut_bag_that_was_recovered_is_whole() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write(&path, Compression::Zstd, &session(120));
    let file = path.join("bag_0.mcap");
    let bytes = fs::read(&file).unwrap();
    for length in (0..bytes.len()).step_by(97) {
        fs::write(&file, &bytes[..length]).unwrap();
        fs::remove_file(path.join("metadata.yaml")).unwrap();
        let before = read(&path);
        let report = recover(&path).unwrap();
        assert_eq!(report.files[0].messages, before.len() as u64);
        assert_eq!(read(&path), before);
        let bag = Bag::open(&path).unwrap();
        assert_eq!(bag.damage().count(), 0);
        assert_eq!(bag.messages_count(), before.len() as u64);
    }
    assert_eq!(fs::read_dir(&path).unwrap().count(), 2);
}

#[test]
fn a_chunk_with_a_wrong_checksum_is_left_out_and_reported() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write(&path, Compression::None, &session(120));
    let file = path.join("bag_0.mcap");
    let mut bytes = fs::read(&file).unwrap();
    let place = bytes.windows(10).position(|text| text == b"message 63").unwrap();
    bytes[place] ^= 1;
    fs::write(&file, &bytes).unwrap();
    let bag = Bag::open(&path).unwrap();
    let (good, bad): (Vec<_>, Vec<_>) = bag.messages(None).partition(Result::is_ok);
    assert_eq!((good.len(), bad.len()), (83, 1));
    assert!(matches!(bad[0], Err(BagError::Damaged { .. })));
}

#[test]
fn what_was_lost_to_damage_is_reported_before_and_after_a_bag_was_made_whole() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write(&path, Compression::None, &session(120));
    let lost = |path: &Path| {
        let mut bag = Bag::open(path).unwrap();
        bag.check();
        bag.lost_to_damage()
    };
    assert_eq!(lost(&path), None);
    let file = path.join("bag_0.mcap");
    let mut bytes = fs::read(&file).unwrap();
    let place = bytes.windows(10).position(|text| text == b"message 63").unwrap();
    bytes[place] ^= 1;
    fs::write(&file, &bytes).unwrap();
    assert!(lost(&path).unwrap().ends_with(" bytes can't be read (parts: 1)"));
    recover(&path).unwrap();
    let noted = "bag_0.mcap: 40 messages were lost to damage";
    assert_eq!(lost(&path).as_deref(), Some(noted));
    recover(&path).unwrap();
    assert_eq!(lost(&path).as_deref(), Some(noted), "it is reported once");
}

/// The length of the file after each flush of a bag that is then damaged by `spoil`.
fn spoil(path: &Path, compression: Compression, spoil: impl Fn(&mut Vec<u8>, &[u64])) -> PathBuf {
    let flushed = write(path, compression, &session(197));
    let file = path.join("bag_0.mcap");
    let mut bytes = fs::read(&file).unwrap();
    spoil(&mut bytes, &flushed);
    fs::write(&file, &bytes).unwrap();
    file
}

#[test]
fn a_bag_cut_in_the_middle_keeps_every_whole_chunk() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        for (begin, bytes, kept) in [(100, 300, 160), (100, 1, 160), (-30, 60, 160), (-3, 3, 160)] {
            let folder = tempdir().unwrap();
            let path = folder.path().join("bag");
            let file = spoil(&path, compression, |file, flushed| {
                let begin = (flushed[1] as i64 + begin) as usize;
                file.drain(begin..begin + bytes);
            });
            let torn = fs::read(&file).unwrap();
            let report = recover(&path).unwrap();
            let recovered = &report.files[0];
            let lost = recovered.lost_messages.unwrap();
            assert!(recovered.messages >= kept - 40 && recovered.messages + lost == 200);
            assert!(recovered.messages >= kept || begin < 0, "{compression:?} {begin} {lost}");
            assert!(recovered.is_lossy());
            assert_eq!(fs::read(recovered.original.as_ref().unwrap()).unwrap(), torn);
            assert_eq!(read(&path).len() as u64, recovered.messages);
            assert_eq!(Bag::open(&path).unwrap().damage().count(), 0);
        }
    }
}

#[test]
fn an_unfinished_bag_cut_in_the_middle_keeps_every_whole_chunk() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let file = spoil(&path, Compression::Zstd, |file, flushed| {
        file.truncate(flushed[4] as usize);
        let begin = flushed[1] as usize + 100;
        file.drain(begin..begin + 300);
    });
    fs::remove_file(path.join("metadata.yaml")).unwrap();
    let report = recover(&path).unwrap();
    assert_eq!((report.files[0].messages, report.files[0].lost_messages), (160, None));
    assert!(file.with_extension("mcap.orig").exists());
}

#[test]
fn an_unfinished_bag_with_a_damaged_middle_has_lost_an_unknown_number() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write_and_die(&path, Compression::None, &session(157));
    let file = path.join("bag_0.mcap");
    let mut bytes = fs::read(&file).unwrap();
    let place = bytes.windows(10).position(|text| text == b"message 63").unwrap();
    bytes[place..place + 200].fill(0);
    fs::write(&file, &bytes).unwrap();
    let report = recover(&path).unwrap();
    assert_eq!((report.files[0].messages, report.files[0].lost_messages), (120, None));
    assert!(report.files[0].is_lossy());
    let noted = "bag_0.mcap: an unknown number of messages were lost to damage";
    assert_eq!(Bag::open(&path).unwrap().lost_to_damage().as_deref(), Some(noted));
}

#[test]
fn an_unfinished_bag_of_which_all_bytes_are_read_has_lost_nothing() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    write_and_die(&path, Compression::Zstd, &session(157));
    let report = recover(&path).unwrap();
    assert_eq!((report.files[0].messages, report.files[0].lost_messages), (160, Some(0)));
    assert!(!report.files[0].is_lossy());
}

#[test]
fn metadata_of_an_unfinished_file_does_not_state_its_messages() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options { split_secs: Some(0.5), ..Options::default() };
    let mut writer = BagWriter::create(&path, &options).unwrap();
    for record in &session(700) {
        writer.write(record).unwrap();
    }
    writer.flush().unwrap();
    std::mem::forget(writer);
    let last = path.join("bag_1.mcap");
    unlock(&last);
    fs::OpenOptions::new().write(true).open(&last).unwrap().set_len(300).unwrap();
    let report = recover(&path).unwrap();
    let lost: Vec<_> = report.files.iter().map(|file| file.lost_messages).collect();
    assert_eq!((lost, report.files[1].messages), (vec![Some(0), None], 0));
}

#[test]
fn a_chunk_that_went_bad_unseen_is_left_out_by_recover() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let folder = tempdir().unwrap();
        let path = folder.path().join("bag");
        spoil(&path, compression, |file, flushed| {
            let begin = flushed[1] as usize + 60;
            file[begin..begin + 200].fill(0);
        });
        assert_eq!(Bag::open(&path).unwrap().damage().count(), 0);
        let report = recover(&path).unwrap();
        let recovered = &report.files[0];
        assert_eq!((recovered.messages, recovered.lost_messages), (160, Some(40)));
        assert!(recovered.is_lossy());
        assert_eq!(read(&path).len(), 160);
    }
}

#[test]
fn a_recovered_bag_is_found_whole_and_left_as_it_is() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    spoil(&path, Compression::Zstd, |file, flushed| file[flushed[1] as usize + 60] ^= 1);
    recover(&path).unwrap();
    let report = recover(&path).unwrap();
    assert_eq!(
        (report.files[0].damage.as_slice(), report.files[0].lost_messages),
        (&[][..], Some(0))
    );
    assert!(!report.files[0].is_lossy());
}

#[test]
fn a_file_is_repaired_with_its_folder_and_a_lone_one_notes_its_losses() {
    let folder = tempdir().unwrap();
    let (path, lone) = (folder.path().join("bag"), folder.path().join("lone.mcap"));
    spoil(&path, Compression::Zstd, |file, flushed| file[flushed[1] as usize + 60] ^= 1);
    fs::copy(path.join("bag_0.mcap"), &lone).unwrap();
    for file in [path.join("bag_0.mcap"), lone.clone()] {
        assert_eq!(recover(&file).unwrap().files[0].messages, 160);
    }
    let lost = |path: &Path| Bag::open(path).unwrap().lost_to_damage();
    let text = "_0.mcap: 40 messages were lost to damage";
    assert_eq!(lost(&path).unwrap(), format!("bag{text}"));
    assert!(fs::read_to_string(path.join("metadata.yaml")).unwrap().contains("message_count: 160"));
    assert_eq!(lost(&lone).unwrap(), "lone.mcap: 40 messages were lost to damage");
}

#[test]
fn what_metadata_reports_and_is_not_there_is_lost() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    spoil(&path, Compression::Zstd, |file, _| file.clear());
    assert_eq!(Bag::open(&path).unwrap().missing(), 200);
    let report = recover(&path).unwrap();
    assert_eq!((report.files[0].messages, report.files[0].lost_messages), (0, Some(200)));
}

#[test]
fn a_file_that_is_missing_is_named_and_the_others_are_read() {
    for version in [Version::V5, Version::V9] {
        misses_a_file(version);
    }
}

fn misses_a_file(metadata_version: Version) {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options { split_secs: Some(0.2), metadata_version, ..Options::default() };
    let mut writer = BagWriter::create(&path, &options).unwrap();
    for record in &session(700) {
        writer.write(record).unwrap();
    }
    writer.finish().unwrap();
    let files = Bag::open(&path).unwrap().files_count();
    let all = read(&path).len();
    assert!(files >= 3, "{files}");
    fs::remove_file(path.join("bag_1.mcap")).unwrap();
    let lost = format!("bag_1.mcap, one of its {files} files, is missing");
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.absent(), [path.join("bag_1.mcap")]);
    assert_eq!(bag.lost_to_damage().as_ref(), Some(&lost));
    let hidden = folder.path().join("metadata.yaml");
    fs::rename(path.join("metadata.yaml"), &hidden).unwrap();
    assert_eq!(Bag::open(&path).unwrap().absent(), bag.absent());
    fs::rename(hidden, path.join("metadata.yaml")).unwrap();
    let left = read(&path).len();
    assert!((1..all).contains(&left), "{left} of {all}");
    assert_eq!(recover(&path).unwrap().absent, [path.join("bag_1.mcap")]);
    let bag = Bag::open(&path).unwrap();
    assert_eq!((bag.absent().len(), bag.lost_to_damage()), (0, Some(lost)));
    assert_eq!(read(&path).len(), left);
}

#[test]
fn another_kind_of_file_is_named() {
    let folder = tempdir().unwrap();
    let open = |contents: &[u8]| {
        let path = folder.path().join("x.mcap");
        fs::write(&path, contents).unwrap();
        match Bag::open(&path) {
            Err(BagError::NotABag { found, .. }) => found,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(open(b"SQLite format 3\0 and so on"), Found::Sqlite);
    assert_eq!(open(b"#ROSBAG V1.2\n"), Found::Ros1);
    assert_eq!(open(b"(\xb5/\xfdcompressed"), Found::Compressed);
    assert_eq!(open(b"time,value\n"), Found::Other);
    fs::remove_file(folder.path().join("x.mcap")).unwrap();
    let error = Bag::open(folder.path()).unwrap_err();
    assert!(matches!(error, BagError::NotABag { found: Found::NoFiles, .. }));
}

#[test]
fn a_rosbag2_folder_that_is_not_mcap_is_named() {
    let folder = tempdir().unwrap();
    let open = |yaml: &str| {
        fs::write(folder.path().join("metadata.yaml"), yaml).unwrap();
        match Bag::open(folder.path()) {
            Err(BagError::NotABag { found, .. }) => found,
            other => panic!("{other:?}"),
        }
    };
    let sqlite = "rosbag2_bagfile_information:\n  storage_identifier: sqlite3\n";
    assert_eq!(open(sqlite), Found::NoFiles);
    let compressed = "rosbag2_bagfile_information:\n  compression_mode: MESSAGE\n";
    assert_eq!(open(compressed), Found::NoFiles);
    let by_another = format!("{compressed}  compression_format: lz4\n");
    assert_eq!(open(&by_another), Found::Compressed);
}

#[test]
fn a_lone_file_keeps_the_notes_of_its_recording() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let file = spoil(&path, Compression::Zstd, |_, _| {});
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.missing(), 0);
    assert!(bag.notes().contains_key("session"));
    assert_eq!(Bag::open(&file).unwrap().notes(), bag.notes());
}

/// Reads everything that can be read.
fn exhaust(path: &Path) {
    if let Ok(bag) = Bag::open(path) {
        let read = bag.messages(None).flatten().count();
        assert!(read as u64 <= bag.messages_count().max(100_000));
        drop(bag.attachment("study.toml"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]
    #[test]
    fn any_bytes_are_read_without_a_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..500),
    ) {
        let folder = tempdir().unwrap();
        let path = folder.path().join("x.mcap");
        fs::write(&path, [b"\x89MCAP0\r\n", bytes.as_slice()].concat()).unwrap();
        exhaust(&path);
    }

    #[test]
    fn a_bag_with_any_bytes_changed_is_read_without_a_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        compression in prop::sample::select(vec![
            Compression::None, Compression::Lz4, Compression::Zstd,
        ]),
        is_finished: bool,
    ) {
        let folder = tempdir().unwrap();
        let path = folder.path().join("bag");
        if is_finished {
            write(&path, compression, &session(60));
        } else {
            write_and_die(&path, compression, &session(60));
        }
        let file = path.join("bag_0.mcap");
        let mut bytes = fs::read(&file).unwrap();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        fs::write(&file, &bytes).unwrap();
        exhaust(&file);
        drop(recover(&path));
    }
}
