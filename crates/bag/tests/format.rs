//! Bags are MCAP as other programs read it, and writing one takes no more memory the longer it is.
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

mod memory;
mod session;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use mcap::records::op;
use memory::most_during;
use session::{at, battery, record, session, text};
use teampulse_bag::{Attachment, BagWriter, Compression, Options};
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::stream::Stream;
use tempfile::tempdir;

/// The bytes of a bag of one file, flushed now and then.
fn written(records: &[Record], compression: Compression) -> Vec<u8> {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options { compression, ..Options::default() };
    let mut writer = BagWriter::create(&path, &options).unwrap();
    let bytes = b"[session]\n";
    let (name, media_type, log_time) = ("study.toml", "application/toml", at(0));
    for portion in records.chunks(4000) {
        for record in portion {
            writer.write(record).unwrap();
        }
        writer.flush().unwrap();
        writer.attach(Attachment { name, media_type, log_time, bytes }).unwrap();
    }
    writer.finish().unwrap();
    fs::read(path.join("bag_0.mcap")).unwrap()
}

#[test]
fn others_find_every_message_by_the_index_and_without_it() {
    let records = session(10_000);
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let bytes = written(&records, compression);
        let read = mcap::MessageStream::new(&bytes).unwrap();
        let read: Vec<mcap::Message<'_>> = read.collect::<Result<_, _>>().unwrap();
        assert_eq!(read.len(), records.len());
        for (message, record) in read.iter().zip(&records) {
            assert_eq!(message.channel.topic, record.stream.name);
            assert_eq!(message.data, &record.cdr[..]);
            assert_eq!(message.log_time, record.sample.log_time.nanos() as u64);
            assert_eq!(u64::from(message.sequence), record.sample.index);
        }

        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let stats = summary.stats.as_ref().unwrap();
        assert_eq!((stats.message_count, stats.attachment_count), (records.len() as u64, 3));
        assert_eq!((stats.channel_count, stats.schema_count), (4, 4));
        assert_eq!(stats.chunk_count as usize, summary.chunk_indexes.len());
        assert_eq!(stats.message_start_time, records[0].sample.log_time.nanos() as u64);
        let mut counts = BTreeMap::new();
        for chunk in &summary.chunk_indexes {
            let indexes = summary.read_message_indexes(&bytes, chunk).unwrap().into_iter();
            let indexes = indexes.map(|(channel, places)| (channel.id, places));
            for (channel, places) in indexes.collect::<BTreeMap<_, _>>() {
                *counts.entry(channel).or_insert(0) += places.len() as u64;
                // Each look-up unpacks its chunk.
                for place in places.iter().step_by(100) {
                    let message = summary.seek_message(&bytes, chunk, place).unwrap();
                    assert_eq!((message.channel.id, message.log_time), (channel, place.log_time));
                }
            }
            let chunk = summary.stream_chunk(&bytes, chunk).unwrap();
            assert!(chunk.count() > 0);
        }
        assert_eq!(counts, stats.channel_message_counts);
        for index in &summary.attachment_indexes {
            assert_eq!(&*mcap::read::attachment(&bytes, index).unwrap().data, b"[session]\n");
        }
        for index in &summary.metadata_indexes {
            assert_eq!(mcap::read::metadata(&bytes, index).unwrap().name, index.name);
        }
        assert_eq!(summary.metadata_indexes.len(), 2);
    }
}

#[test]
fn the_index_says_where_each_kind_of_record_stands_in_it() {
    let bytes = written(&session(10), Compression::Zstd);
    let footer = mcap::read::footer(&bytes).unwrap();
    let end = bytes.len() as u64 - 37;
    let kinds = |from: u64, to: u64| {
        let records = mcap::read::LinearReader::sans_magic(&bytes[from as usize..to as usize]);
        records.map(|record| record.unwrap()).collect::<Vec<_>>()
    };
    let mut found = BTreeSet::new();
    for record in kinds(footer.summary_offset_start, end) {
        let mcap::records::Record::SummaryOffset(offset) = record else { panic!("{record:?}") };
        let of = kinds(offset.group_start, offset.group_start + offset.group_length);
        assert!(of.iter().all(|record| record.opcode() == offset.group_opcode));
        assert!(!of.is_empty());
        found.insert(offset.group_opcode);
    }
    let all = [
        op::SCHEMA,
        op::CHANNEL,
        op::STATISTICS,
        op::CHUNK_INDEX,
        op::ATTACHMENT_INDEX,
        op::METADATA_INDEX,
    ];
    assert_eq!(found, BTreeSet::from(all));
}

#[test]
fn a_large_message_is_not_copied() {
    let mut noise = 1_u64;
    let mut random = |_| {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        noise as u8
    };
    // What can be compressed to nearly nothing, and what can't be, with others around them.
    let large = [vec![7; 40 << 20], (0..40 << 20).map(&mut random).collect::<Vec<u8>>()];
    let stream = Arc::new(battery());
    let message = |k: i64, bytes: &[u8]| {
        let data = Data::Message(Bytes::copy_from_slice(bytes));
        record(0, &stream, at(k), k as u64, data)
    };
    let messages: Vec<Record> = (0..)
        .zip([b"one", &large[0][..], b"two", &large[1], b"three"])
        .map(|(k, it)| message(k, it))
        .collect();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let folder = tempdir().unwrap();
        let path = folder.path().join("bag");
        let options = Options { compression, ..Options::default() };
        let most = most_during(|| {
            let mut writer = BagWriter::create(&path, &options).unwrap();
            for message in &messages {
                writer.write(message).unwrap();
            }
            writer.finish().unwrap();
        });
        assert!(most < 80 << 20, "{most} bytes");
        let bytes = fs::read(path.join("bag_0.mcap")).unwrap();
        let is_packed = compression != Compression::None;
        assert_eq!(bytes.len() < 60 << 20, is_packed, "{compression:?}: {} bytes", bytes.len());
        let read = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
        assert!(
            read.map(|message| message.data.to_vec()).eq(messages.iter().map(|it| it.cdr.to_vec()))
        );
        assert_eq!(mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes.len(), 5);
    }
}

/// Records this many chunks of a hundred topics.
fn record_chunks(folder: &Path, chunks: i64) {
    let mut writer = BagWriter::create(folder, &Options::default()).unwrap();
    let stream = |k| Arc::new(Stream { name: format!("/r1/topic{k}"), ..battery() });
    let streams: Vec<_> = (0..100).map(stream).collect();
    for chunk in 0..chunks {
        for (id, stream) in (0..).zip(&streams) {
            let log_time = at(800_000_000 * chunk + i64::from(id));
            writer.write(&record(id, stream, log_time, chunk as u64, text("so"))).unwrap();
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_long_recording_takes_no_more_memory_than_a_short_one() {
    let folder = tempdir().unwrap();
    let most = |chunks| {
        let path = folder.path().join(format!("{chunks}"));
        most_during(|| record_chunks(&path, chunks))
    };
    // Two minutes, and twenty.
    let (short, long) = (most(150), most(1500));
    assert!(long - short < 100_000, "{short} and {long} bytes");
}
