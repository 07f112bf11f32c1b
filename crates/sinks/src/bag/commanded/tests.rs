//! Tests of a bag that commands start and stop.

use std::path::Path;

use teampulse_bag::{Bag, Stage};
use teampulse_core::data::{Data, EventKind};
use teampulse_core::latched::Latched;
use teampulse_core::session_streams::{descriptions, session_events};
use teampulse_core::sink::{Batch, Post, Posted, queue};
use teampulse_core::streams::Streams;
use teampulse_messages::convert::decode;

use super::*;
use crate::Ended;
use crate::bag::continuing::Continuation;
use crate::bag::testing::{happens, marker, phase};

/// A session with a bag that obeys commands.
struct Session {
    post: Post,
    streams: Streams,
    ended: Ended,
    growth: Growth,
    running: std::thread::JoinHandle<Result<(), SinkError>>,
}

impl Session {
    fn new(folder: &Path, is_paused: bool, limits: Limits) -> Session {
        let streams = Streams::default();
        streams.declare(descriptions());
        let (post, inbox) = queue(Delivery::Lossless, streams.clone());
        let (ended, growth) = (Ended::default(), Growth::default());
        let options = Options { keep_free_bytes: 0, growth: growth.clone(), ..Options::default() };
        let bag = BagSink { folder: folder.join("bag"), study: "[session]".into(), options };
        let again = Continuation::Beside { fallback: None };
        let bag = ContinuingBag { bag, ended: ended.clone(), again, ends_by_command: true };
        let sink = Box::new(CommandedBag { bag, is_paused, limits });
        let running = std::thread::spawn(move || sink.run(inbox));
        Session { post, streams, ended, growth, running }
    }

    fn mark(&self, second: i64) {
        self.deliver(&marker(&self.streams, second));
    }

    fn command(&self, second: i64, verb: &str) {
        self.deliver(&self.commanded(second, verb));
    }

    fn commanded(&self, second: i64, verb: &str) -> Batch {
        let event = (EventKind::Command, &*format!("keys {verb}"), 0.0);
        happens(&self.streams, session_events(), second, event)
    }

    fn deliver(&self, batch: &Batch) {
        assert_eq!(self.post.deliver(batch), Posted::Accepted);
    }

    fn end(self) -> (Result<(), SinkError>, Ended, Stage) {
        drop(self.post);
        (self.running.join().unwrap(), self.ended, self.growth.on_disk().stage)
    }
}

const HALF_A_MINUTE: Limits = Limits { secs: 30.0, bytes: 1 << 20 };

/// The labels of all events of a bag, in order, except those that describe streams.
fn labels(folder: &Path) -> Vec<String> {
    let bag = Bag::open(folder).unwrap();
    let is_event = |stream: usize| bag.streams()[stream].stream.name != descriptions().name;
    let events = bag.messages(None).map(Result::unwrap).filter(|each| is_event(each.stream));
    let label = |cdr: &[u8]| match decode("teampulse_msgs/msg/Event", cdr).unwrap().data {
        Data::Event(event) => event.label.clone(),
        other => panic!("{other:?} is no event"),
    };
    events.map(|message| label(&message.cdr)).collect()
}

#[test]
fn a_recording_that_was_stopped_is_whole_and_the_next_begins_with_what_was_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("bag"), folder.path().join("bag_2"));
    let session = Session::new(folder.path(), false, HALF_A_MINUTE);
    session.deliver(&phase(&session.streams, 1, "task", 600.0));
    session.mark(2);
    session.command(3, "stop_recording");
    session.mark(4);
    session.command(5, "start_recording");
    session.mark(6);
    let (ended, beside, stage) = session.end();
    ended.unwrap();
    assert_eq!(stage, Stage::Finished);
    assert_eq!(labels(&first), ["task", "2", "keys stop_recording"]);
    assert_eq!(labels(&second), ["task", "4", "keys start_recording", "6"]);
    assert!(beside.why().unwrap().contains("command"));
    assert_eq!(beside.folders(), std::slice::from_ref(&second));
    let bag = Bag::open(&second).unwrap();
    assert!(bag.attachment(teampulse_bag::STUDY_NAME).unwrap().is_some());
    let described = bag.streams().iter().any(|each| each.stream.name == descriptions().name);
    assert!(described, "its streams are described");
}

#[test]
fn what_is_kept_ends_where_its_seconds_end() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits { secs: 3.0, bytes: 1 << 20 };
    let session = Session::new(folder.path(), true, limits);
    session.deliver(&phase(&session.streams, 1, "baseline", 0.0));
    (2..=9).for_each(|second| session.mark(second));
    session.command(9, "start_recording");
    session.mark(10);
    let (ended, beside, _) = session.end();
    ended.unwrap();
    let first = folder.path().join("bag");
    let recorded = ["baseline", "6", "7", "8", "9", "keys start_recording", "10"];
    assert_eq!(labels(&first), recorded);
    assert_eq!(beside.folders(), [first]);
}

#[test]
fn a_snapshot_is_a_bag_of_its_own_and_the_recording_stays_paused() {
    let folder = tempfile::tempdir().unwrap();
    let session = Session::new(folder.path(), true, HALF_A_MINUTE);
    session.mark(1);
    session.command(2, "snapshot");
    session.mark(3);
    session.command(4, "snapshot");
    session.mark(5);
    let (ended, beside, stage) = session.end();
    ended.unwrap();
    assert!(matches!(stage, Stage::Paused { .. }), "{stage:?}");
    let (first, second) = (folder.path().join("bag"), folder.path().join("bag_2"));
    assert_eq!(labels(&first), ["1", "keys snapshot"]);
    assert_eq!(labels(&second), ["1", "keys snapshot", "3", "keys snapshot"]);
    assert_eq!(beside.folders(), [first, second]);
}

#[test]
fn commands_that_come_together_are_carried_out_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let session = Session::new(folder.path(), false, HALF_A_MINUTE);
    let verbs = ["stop_recording", "start_recording", "stop_recording", "start_recording"];
    let batches: Vec<Batch> = verbs
        .iter()
        .zip(1..)
        .flat_map(|(verb, second)| {
            [session.commanded(2 * second, verb), marker(&session.streams, 2 * second + 1)]
        })
        .collect();
    let together: Batch = batches.iter().flat_map(|batch| batch.iter().cloned()).collect();
    session.deliver(&together);
    let (ended, ..) = session.end();
    ended.unwrap();
    let labels = |name: &str| labels(&folder.path().join(name));
    assert_eq!(labels("bag"), ["keys stop_recording"]);
    assert_eq!(labels("bag_2"), ["3", "keys start_recording", "5", "keys stop_recording"]);
    assert_eq!(labels("bag_3"), ["7", "keys start_recording", "9"]);
}

#[test]
fn a_recording_that_cannot_begin_is_a_failure_and_loses_nothing_that_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let session = Session::new(folder.path(), true, HALF_A_MINUTE);
    // Something else is in its place.
    std::fs::write(folder.path().join("bag"), "").unwrap();
    session.mark(1);
    session.command(2, "start_recording");
    session.mark(3);
    session.command(4, "start_recording");
    let (ended, ..) = session.end();
    let error = ended.unwrap_err().to_string();
    assert!(error.contains("bag"), "{error}");
    let recorded = ["1", "keys start_recording", "3", "keys start_recording"];
    assert_eq!(labels(&folder.path().join("bag_2")), recorded);
}

#[test]
fn memory_is_bounded_and_the_newest_are_kept() {
    let streams = Streams::default();
    let one = marker(&streams, 1)[0].held_bytes();
    let limits = Limits { secs: 1000.0, bytes: 3 * one };
    let mut kept = Kept::new(limits, Latched::default());
    for second in 1..=9 {
        kept.push(&marker(&streams, second)[0]);
    }
    assert!(kept.is_cut() && kept.bytes() <= limits.bytes);
    assert!((kept.secs() - 2.0).abs() < 1e-9);
    let seconds = kept
        .snapshot()
        .kept
        .iter()
        .map(|each| each.sample.log_time.nanos() / 1_000_000_000)
        .collect::<Vec<_>>();
    assert_eq!(seconds, [7, 8, 9]);
}
