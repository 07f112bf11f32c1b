//! The bag as a sink.

#[expect(dead_code, reason = "each test takes what it needs")]
mod session;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use session::{at, record};
use teampulse_bag::{Bag, BagSink, BagWriter, Broken, ENDED_NOTE, Options, STUDY_NAME, Stage};
use teampulse_core::command::{Accepted, Command, Sender};
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::session_streams::session_events;
use teampulse_core::sink::{Batch, Delivery, Limits, Posted, Sink, SinkError, queue, queue_within};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{Origin, Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use tempfile::tempdir;

/// Passes all records to a sink, and ends it.
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

#[test]
fn how_much_is_on_the_disk_is_what_the_files_hold() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let options = Options { split_secs: Some(1.0), ..Options::default() };
    let growth = options.growth.clone();
    assert_eq!(growth.on_disk().stage, Stage::NotBegun);
    let mut writer = BagWriter::create(&path, &options).unwrap();
    let began = growth.on_disk();
    assert_eq!(began.stage, Stage::Open);
    assert!(began.synced_bytes > 0 && began.free_bytes.is_some_and(|free| free > 0));
    for second in 1..4 {
        writer.write(&status(second, None, 0)).unwrap();
        writer.flush().unwrap();
    }
    assert!(growth.on_disk().synced_bytes > began.synced_bytes);
    assert!(writer.finish().unwrap().files > 1);
    let files = std::fs::read_dir(&path).unwrap().map(|each| each.unwrap());
    let bags = files.filter(|file| file.path().extension().is_some_and(|it| it == "mcap"));
    let whole_bytes: u64 = bags.map(|file| file.metadata().unwrap().len()).sum();
    let ended = growth.on_disk();
    assert_eq!((ended.stage, ended.synced_bytes), (Stage::Finished, whole_bytes));
}

#[test]
fn a_command_begins_the_next_file() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let stream = Arc::new(session_events());
    let commands = [Command::NextPhase, Command::Split, Command::Mark("b".into())];
    let records = commands.into_iter().zip(1..).map(|(command, second)| {
        let event = Accepted { sender: Sender::keys(), command }.event();
        let log_time = at(1_000_000_000 * second);
        record(0, &stream, log_time, second as u64, Data::Event(Arc::new(event)))
    });
    run(&path, Options::default(), records.collect()).unwrap();
    let files = std::fs::read_dir(&path).unwrap().map(|each| each.unwrap().path());
    let bags = files.filter(|file| file.extension().is_some_and(|it| it == "mcap"));
    assert_eq!(bags.count(), 2);
    let bag = Bag::open(&path).unwrap();
    let labels = labels(&bag);
    for (label, sent) in labels.iter().zip(["keys next_phase", "keys split", "keys mark b"]) {
        assert!(label.contains(sent), "{label:?}");
    }
    assert_eq!(labels.len(), 3);
}

#[test]
fn a_recording_that_ends_early_says_why_where_it_is_shown() {
    let folder = tempdir().unwrap();
    let options = Options { keep_free_bytes: u64::MAX, ..Options::default() };
    let growth = options.growth.clone();
    run(&folder.path().join("bag"), options, Vec::new()).unwrap_err();
    let Stage::EndedEarly(why) = growth.on_disk().stage else { panic!("it did not end early") };
    assert!(why.contains("the disk is full"), "{why}");
}

/// The labels of the session's events in a bag.
fn labels(bag: &Bag) -> Vec<String> {
    let of_session = |stream: usize| bag.streams()[stream].stream.name == "/session/events";
    let events = bag.messages(None).map(Result::unwrap).filter(|each| of_session(each.stream));
    events.map(|message| String::from_utf8_lossy(&message.cdr).into_owned()).collect()
}

#[test]
fn a_bag_that_is_cut_off_is_whole_and_says_why_it_ended() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let sink = BagSink { folder: path.clone(), study: String::new(), options: Options::default() };
    let limits = Limits { bytes: 1, patience: Some(Duration::ZERO), stall: Duration::MAX };
    let (post, inbox) = queue_within(Delivery::Lossless, Streams::default(), limits);
    let batch = |second| Batch::from(vec![status(second, Some(0), 0)]);
    // The disk stands still: the first is taken, for the second there is no room.
    assert_eq!(post.deliver(&batch(1)), Posted::Accepted);
    assert!(matches!(post.deliver(&batch(2)), Posted::CutOff { .. }));
    assert_eq!(post.deliver(&batch(3)), Posted::Skipped);
    let Err(SinkError::Lost { message, .. }) = Box::new(sink).run(inbox) else { panic!() };
    assert!(message.starts_with("keep up: it took nothing for 0 s"), "{message}");
    assert!(message.contains(&path.display().to_string()), "the bag is named: {message}");
    assert_eq!(post.deliver(&batch(4)), Posted::Ended);

    let bag = Bag::open(&path).unwrap();
    assert_eq!(bag.damage().count(), 0);
    assert_eq!(bag.messages_count(), 2);
    assert_eq!(bag.notes()[ENDED_NOTE], format!("failed to {message}"));
    let [label] = &labels(&bag)[..] else { panic!() };
    assert!(label.contains("bag: failed to keep up"), "{label}");
}

#[test]
fn a_recording_that_is_deleted_under_way_ends_and_counts_what_is_in_no_bag() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bag");
    let sink = BagSink { folder: path.clone(), study: String::new(), options: Options::default() };
    let (post, inbox) = queue(Delivery::Lossless, Streams::default());
    let recording = sink.begin().unwrap();
    std::fs::remove_dir_all(&path).unwrap();
    let batch: Vec<Record> = (1..=10).map(|second| status(second, Some(0), 0)).collect();
    assert_eq!(post.deliver(&batch.into()), Posted::Accepted);
    let Err(Broken { error, unwritten }) = recording.record(&inbox) else { panic!() };
    let SinkError::Lost { message, hint } = error else { panic!() };
    assert!(message.contains("it was deleted while it was recorded"), "{message}");
    assert!(!hint.is_empty());
    assert_eq!(unwritten, 10);
}
