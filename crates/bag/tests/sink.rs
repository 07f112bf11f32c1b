//! The bag as a sink.

#[expect(dead_code, reason = "each test takes what it needs")]
mod session;

use std::path::Path;
use std::sync::Arc;

use session::{at, record};
use teampulse_bag::{Bag, BagSink, BagWriter, Options, STUDY_NAME};
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::sink::{Batch, Delivery, Sink, SinkError, queue};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{Origin, Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use tempfile::tempdir;

/// Gives a sink all records, and ends.
fn run(folder: &Path, options: Options, records: Vec<Record>) -> Result<(), SinkError> {
    let sink = BagSink { folder: folder.to_owned(), study: "# a study".into(), options };
    let (post, inbox) = queue(Delivery::Lossless, Streams::default());
    let batch: Batch = records.into();
    post.deliver(&batch);
    drop(post);
    Box::new(sink).run(inbox)
}

fn status(second: u64, lost_source: Option<u64>, lost_queue: u64) -> Record {
    let mut stream = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
    stream.origin = Origin::Derived;
    let status = StreamStatus {
        name: "/r1/odom".into(),
        state: State::Ok,
        reason: String::new(),
        rate_hz: 20.0,
        age_secs: 0.0,
        received: 20,
        lost_source,
        lost_queue,
        late: 0,
        duplicates: 0,
        clock: 0,
        epoch: 0,
        offset_secs: f64::NAN,
        skew_ppm: f64::NAN,
        jitter_secs: f64::NAN,
        sigma_secs: f64::NAN,
        latency_secs: f64::NAN,
    };
    let log_time = at(1_000_000_000 * second as i64);
    record(0, &Arc::new(stream), log_time, second, Data::Status(Arc::new(status)))
}

#[test]
fn losses_and_the_study_are_in_the_bag() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let records = vec![status(1, None, 0), status(2, Some(3), 0), status(3, Some(7), 2)];
    run(&path, Options::default(), records).unwrap();
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.notes()["lost_source:/r1/odom"], "7");
    assert_eq!(bag.notes()["lost_queue:/r1/odom"], "2");
    assert_eq!(bag.attachment(STUDY_NAME).unwrap().unwrap(), b"# a study");
    assert_eq!(bag.messages_count(), 3);
}

#[test]
fn losses_are_known_of_a_recording_that_was_never_finished() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let mut writer = BagWriter::create(&path, &Options::default()).unwrap();
    for record in [status(1, None, 0), status(2, Some(3), 1)] {
        writer.write(&record).unwrap();
    }
    writer.flush().unwrap();
    std::mem::forget(writer);
    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.notes()["lost_source:/r1/odom"], "3");
    assert_eq!(bag.notes()["lost_queue:/r1/odom"], "1");
}

#[test]
fn losses_that_cannot_be_counted_are_unknown() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    run(&path, Options::default(), vec![status(1, None, 0)]).unwrap();
    assert_eq!(Bag::open(&path).unwrap().notes()["lost_source:/r1/odom"], "unknown");
}

#[test]
fn a_disk_without_room_is_refused_at_once_and_leaves_nothing() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options { keep_free_bytes: u64::MAX, ..Options::default() };
    let Err(SinkError::Failed { message, hint }) = run(&path, options, Vec::new()) else {
        panic!("it was not refused");
    };
    assert!(message.contains("the disk is full"), "{message}");
    assert!(!hint.is_empty());
    assert!(!path.exists());
}
