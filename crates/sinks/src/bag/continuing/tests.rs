//! Tests of a bag that continues in another.

use teampulse_bag::{Bag, CONTINUES_NOTE, ENDED_NOTE};
use teampulse_core::data::{Data, EventKind};
use teampulse_core::session_streams::{descriptions, session_events};
use teampulse_core::sink::{Batch, Limits, Post, Posted, queue_within};
use teampulse_core::stream::{About, Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_messages::convert::decode;
use tempfile::TempDir;

use super::*;
use crate::bag::testing::{happens, marker, phase};

/// A bag whose disk stalls: cut off after its first message.
fn cut_off(folder: &Path, again: Continuation) -> (Post, Inbox, Box<ContinuingBag>, Streams) {
    let streams = Streams::default();
    streams.declare(descriptions());
    let limits = Limits { bytes: 1, patience: Some(Duration::ZERO), stall: Duration::MAX };
    let (post, inbox) = queue_within(Delivery::Lossless, streams.clone(), limits);
    assert_eq!(post.deliver(&marker(&streams, 1)), Posted::Accepted);
    assert!(matches!(post.deliver(&marker(&streams, 2)), Posted::CutOff { .. }));
    let bag = BagSink {
        folder: folder.to_owned(),
        study: "# a study".into(),
        options: Options { keep_free_bytes: 0, ..Options::default() },
    };
    let ended = Ended::default();
    let sink = Box::new(ContinuingBag { bag, ended, again, ends_by_command: false });
    (post, inbox, sink, streams)
}

#[test]
fn a_recording_that_failed_goes_on_in_another_bag_and_counts_what_is_in_none() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("bag"), folder.path().join("bag_2"));
    let again = Continuation::Beside { fallback: None };
    let (post, inbox, sink, streams) = cut_off(&first, again);
    let ended = sink.ended.clone();
    let recording = std::thread::spawn(move || sink.run(inbox));
    while ended.folders().is_empty() {
        assert!(!recording.is_finished());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(ended.why().unwrap().starts_with("failed to keep up"));
    assert_eq!(ended.folders(), std::slice::from_ref(&second));
    assert_eq!(post.deliver(&marker(&streams, 3)), Posted::Accepted);
    drop(post);
    let Err(SinkError::Lost { message, .. }) = recording.join().unwrap() else { panic!() };
    assert!(message.contains("1 message is in no bag"), "{message}");

    let bag = Bag::open(&first).unwrap();
    assert!(bag.notes().contains_key(ENDED_NOTE));
    assert_eq!(bag.messages_count(), 2, "a message and why it ended");
    let bag = Bag::open(&second).unwrap();
    assert_eq!(bag.notes()[CONTINUES_NOTE], first.display().to_string());
    let name = |stream: usize| bag.streams()[stream].stream.name.clone();
    let names: Vec<String> =
        bag.messages(None).map(|message| name(message.unwrap().stream)).collect();
    assert_eq!(names.iter().filter(|name| *name == "/r1/marks").count(), 1);
    assert_eq!(names.iter().filter(|name| *name == "/teampulse/streams").count(), 2);
    assert!(bag.attachment(teampulse_bag::STUDY_NAME).unwrap().is_some());
}

/// The second bag of a recording whose first one was cut off after a phase of a stream, and perhaps before
/// another one.
fn second_bag(streams: &Streams, first: &Batch, skipped: Option<&Batch>) -> (TempDir, Bag) {
    let folder = tempfile::tempdir().unwrap();
    streams.declare(descriptions());
    let limits = Limits { bytes: 1, patience: Some(Duration::ZERO), stall: Duration::MAX };
    let (post, inbox) = queue_within(Delivery::Lossless, streams.clone(), limits);
    assert_eq!(post.deliver(first), Posted::Accepted);
    assert!(matches!(post.deliver(&marker(streams, 1)), Posted::CutOff { .. }));
    if let Some(skipped) = skipped {
        assert_eq!(post.deliver(skipped), Posted::Skipped);
    }
    let bag = BagSink {
        folder: folder.path().join("bag"),
        study: String::new(),
        options: Options { keep_free_bytes: 0, ..Options::default() },
    };
    let (ended, again) = (Ended::default(), Continuation::Beside { fallback: None });
    let sink = Box::new(ContinuingBag { bag, ended: ended.clone(), again, ends_by_command: false });
    let recording = std::thread::spawn(move || sink.run(inbox));
    while ended.folders().is_empty() {
        assert!(!recording.is_finished());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(post.deliver(&marker(streams, 4)), Posted::Accepted);
    drop(post);
    assert!(recording.join().unwrap().is_err());
    let bag = Bag::open(&folder.path().join("bag_2")).unwrap();
    (folder, bag)
}

#[test]
fn a_recording_that_goes_on_begins_with_the_phase_that_it_is() {
    for (is_skipped, label, left_secs) in [(true, "task", 28.0), (false, "baseline", 57.0)] {
        let streams = Streams::default();
        let baseline = phase(&streams, 1, "baseline", 60.0);
        // It is in neither bag, and yet it is the phase that goes on.
        let task = phase(&streams, 2, "task", 30.0);
        let (_folder, bag) = second_bag(&streams, &baseline, is_skipped.then_some(&task));
        let messages: Vec<_> = bag.messages(None).map(Result::unwrap).collect();
        let name = |stream: usize| bag.streams()[stream].stream.name.as_str();
        let is_event = |stream: usize| name(stream) == session_events().name;
        let [own] = &messages.iter().filter(|each| is_event(each.stream)).collect::<Vec<_>>()[..]
        else {
            panic!("one phase is recorded")
        };
        let decoded = decode("teampulse_msgs/msg/Event", &own.cdr).unwrap();
        let Data::Event(event) = decoded.data else { panic!() };
        assert_eq!((event.kind, &*event.label), (EventKind::Phase, label));
        assert!((event.duration_secs - left_secs).abs() < 1e-6, "{event:?}");
        let last = messages.last().unwrap();
        assert_eq!((name(last.stream), own.log_time < last.log_time), ("/r1/marks", true));
    }
}

#[test]
fn a_phase_that_goes_on_is_stamped_by_the_clocks_that_it_came_with() {
    let streams = Streams::default();
    let subject = Subject { about: About::Person, id: "p001".into() };
    let own = Stream::raw("/humans/persons/p001/task/phases", subject, Shape::Event);
    let first = happens(&streams, own.clone(), 1, (EventKind::Phase, "1-back", 60.0));
    let mut record = first[0].clone();
    // Its device has counted for 1000 s, its computer is an hour ahead.
    record.sample.device_time = Some(1_000_000_000_000);
    record.sample.source_time = Some(record.sample.measured + Duration::from_secs(3600));
    let (_folder, bag) = second_bag(&streams, &[record].into(), None);
    let is_own = |stream: usize| bag.streams()[stream].stream.name == own.name;
    let mut messages = bag.messages(None).map(Result::unwrap);
    let own = messages.find(|message| is_own(message.stream)).unwrap();
    assert_eq!(own.publish_time, own.log_time + Duration::from_secs(3600));
    let decoded = decode("teampulse_msgs/msg/Event", &own.cdr).unwrap();
    let since_ns = own.log_time.nanos() - 1_000_000_000;
    assert_eq!(decoded.device_time, Some(1_000_000_000_000 + since_ns));
}

#[test]
fn what_comes_after_the_last_of_too_many_bags_is_counted_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let again = Continuation::Beside { fallback: None };
    let (post, inbox, sink, streams) = cut_off(&folder.path().join("bag"), again);
    let broken = sink.begin().unwrap().record(&inbox).unwrap_err();
    let going = std::thread::spawn(move || goes_on(&sink, None, broken, &inbox, 1));
    // It is heard again as soon as it has given up.
    let mut second = 3;
    while post.deliver(&marker(&streams, second)) != Posted::Accepted {
        assert!(!going.is_finished());
        std::thread::sleep(Duration::from_millis(1));
    }
    second += 1;
    while post.deliver(&marker(&streams, second)) != Posted::Accepted {
        assert!(!going.is_finished());
        std::thread::sleep(Duration::from_millis(1));
    }
    drop(post);
    let Some(SinkError::Lost { message, .. }) = going.join().unwrap().failed else { panic!() };
    assert!(message.contains("ends after 1 bag;"), "{message}");
    let (_, lost) = message.rsplit_once("; ").unwrap();
    let count: u64 = lost.split(' ').next().unwrap().parse().unwrap();
    assert!(count >= 3 && lost.ends_with("messages are in no bag"), "{message}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn what_still_waits_when_the_session_ends_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let again = Continuation::Beside { fallback: None };
    let (post, inbox, sink, _) = cut_off(&folder.path().join("bag"), again);
    drop(post);
    let Err(SinkError::Lost { message, .. }) = sink.run(inbox) else { panic!() };
    assert!(message.ends_with("; 1 message is in no bag"), "{message}");
}

#[test]
fn a_recording_that_may_not_go_on_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (post, inbox, sink, streams) = cut_off(&folder.path().join("bag"), Continuation::Never);
    assert!(matches!(sink.run(inbox), Err(SinkError::Lost { .. })));
    assert_eq!(post.deliver(&marker(&streams, 3)), Posted::Ended);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn the_fallback_is_taken_where_nothing_can_be_made_beside() {
    let folder = tempfile::tempdir().unwrap();
    let fallback = folder.path().join("fallback");
    let first = BagSink {
        folder: Path::new("/proc/nowhere/bag").to_owned(),
        study: String::new(),
        options: Options { keep_free_bytes: 0, ..Options::default() },
    };
    let (ended, again) = (Ended::default(), Continuation::Beside { fallback: None });
    let sink = ContinuingBag { bag: first, ended, again, ends_by_command: false };
    let (found, _) = begin_again(&sink, Some(&fallback), 0).unwrap();
    assert_eq!(found, fallback.join("bag_2"));
    assert!(begin_again(&sink, Some(&fallback), u64::MAX).is_none());
    assert!(begin_again(&sink, None, 0).is_none());
}

#[test]
fn a_disk_that_was_full_needs_no_more_room_than_the_recording_began_with() {
    let needed_mib = |began_with_mib: u64, keep_free_mib: u64| {
        let (folder, study) = (PathBuf::from("bag"), String::new());
        let options = Options { keep_free_bytes: keep_free_mib << 20, ..Options::default() };
        options.growth.synced(0, began_with_mib << 20);
        options.growth.synced(0, 0);
        let bag = BagSink { folder, study, options };
        let (ended, again) = (Ended::default(), Continuation::Never);
        needed_bytes(&ContinuingBag { bag, ended, again, ends_by_command: false }) >> 20
    };
    assert_eq!(needed_mib(80, 64), 72);
    assert_eq!(needed_mib(264, 64), 114);
    assert_eq!(needed_mib(500_000, 64), 128);
}
