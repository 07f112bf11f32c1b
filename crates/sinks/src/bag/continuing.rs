//! A bag that reports when it ends early, and continues in another.

use std::path::{Path, PathBuf};
use std::time::Duration;

use teampulse_bag::{BagSink, Broken, Options, Place, Recording};
use teampulse_core::clock::Clock;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};

use crate::Ended;

/// The interval between attempts to continue a failed recording.
const AGAIN_EVERY: Duration = Duration::from_secs(5);
/// The most bags of one recording, for a disk that fills up again and again.
const MOST_BAGS: usize = 100;
/// The room needed beyond what must stay free to continue on a disk that was full [bytes].
const SOME_ROOM_BYTES: u64 = 64 << 20;

/// Where a recording continues after a failure.
#[derive(Clone, Debug)]
pub enum Continuation {
    /// Nowhere.
    Never,
    /// In a folder next to that of the bag, or in the fallback.
    Beside {
        /// The folder to continue in when the bag's own disk is full or gone.
        fallback: Option<PathBuf>,
    },
}

/// A bag that notifies the tidy files beside it when it ends early, so that they end with it, and continues
/// in another bag.
#[derive(Debug)]
pub struct ContinuingBag {
    /// The bag.
    pub bag: BagSink,
    /// The sinks that it notifies.
    pub ended: Ended,
    /// Where it continues.
    pub again: Continuation,
}

impl Sink for ContinuingBag {
    fn name(&self) -> &'static str {
        self.bag.name()
    }

    fn delivery(&self) -> Delivery {
        self.bag.delivery()
    }

    fn carries_out(&self) -> &'static [&'static str] {
        self.bag.carries_out()
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let ContinuingBag { bag, ended, again } = *self;
        let first =
            bag.clone().begin().inspect_err(|error| ended.report(format!("failed to {error}")))?;
        let Err(broken) = first.record(&inbox) else { return Ok(()) };
        ended.report(format!("failed to {}", broken.error));
        match again {
            Continuation::Never => Err(in_no_bag(broken.error, broken.unwritten)),
            Continuation::Beside { fallback } => {
                let parts = (&inbox, &ended);
                Err(goes_on(&bag, fallback.as_deref(), broken, parts, MOST_BAGS))
            }
        }
    }
}

/// Continues a failed recording in one bag after another; returns the failures at the end.
fn goes_on(
    first: &BagSink,
    fallback: Option<&Path>,
    broken: Broken,
    (inbox, ended): (&Inbox, &Ended),
    most_bags: usize,
) -> SinkError {
    let Broken { error: mut failed, unwritten: mut missed } = broken;
    inbox.report(format!("bag: failed to {failed}"));
    let mut before = first.folder.clone();
    let mut bags = 1;
    while let Some(skipped) = inbox.resume() {
        missed += skipped;
        if bags >= most_bags {
            if bags == most_bags {
                let given_up = format!("the recording ends after {most_bags} bags");
                inbox.report(format!("bag: {given_up}"));
                failed = and(failed, &given_up);
                bags += 1;
            }
            missed += let_pass(inbox, None);
            continue;
        }
        let Some((folder, recording)) = begin_again(first, fallback) else {
            missed += let_pass(inbox, Some(AGAIN_EVERY));
            continue;
        };
        let summary =
            format!("recording goes on in {}; {missed} messages are in no bag", folder.display());
        inbox.report(format!("bag: {summary}"));
        ended.goes_on_in(folder.clone());
        failed = and(failed, &summary);
        bags += 1;
        match recording.continuing(&before).record(inbox) {
            Ok(()) => return failed,
            Err(Broken { error: next, unwritten }) => {
                inbox.report(format!("bag: failed to {next}"));
                failed = and(failed, &format!("failed to {next}"));
                missed = unwritten;
            }
        }
        before = folder;
    }
    missed += inbox.take_skipped();
    while let Received::Batch(batch) = inbox.receive(Duration::ZERO) {
        missed += batch.len() as u64;
    }
    in_no_bag(failed, missed)
}

/// The same failure, with the number of messages lost to it.
fn in_no_bag(failed: SinkError, missed: u64) -> SinkError {
    if missed > 0 { and(failed, &format!("{missed} messages are in no bag")) } else { failed }
}

/// A new bag for a recording: beside its first, or in the fallback.
fn begin_again(first: &BagSink, fallback: Option<&Path>) -> Option<(PathBuf, Recording)> {
    let name = first.folder.file_name()?.to_string_lossy().into_owned();
    let beside = first.folder.parent().unwrap_or(Path::new(""));
    // A disk that was full needs more room than must stay free.
    let keep_free_bytes = 2 * first.options.keep_free_bytes + SOME_ROOM_BYTES;
    [Some(beside), fallback].into_iter().flatten().find_map(|parent| {
        let mut folders = (2..).map(|number| parent.join(format!("{name}_{number}")));
        let folder = folders.find(|folder| folder.symlink_metadata().is_err())?;
        let options = Options { keep_free_bytes, place: Place::New, ..first.options.clone() };
        let bag = BagSink { folder: folder.clone(), options, ..first.clone() };
        Some((folder, bag.begin().ok()?))
    })
}

/// Drops input for a while, or until the session ends; returns the number of messages dropped.
fn let_pass(inbox: &Inbox, patience: Option<Duration>) -> u64 {
    let clock = Clock::host();
    let until = patience.map(|patience| clock.now() + patience);
    let mut passed = 0;
    while until.is_none_or(|until| clock.now() < until) {
        match inbox.receive(AGAIN_EVERY) {
            Received::Batch(batch) => passed += batch.len() as u64,
            Received::Silence => {}
            Received::Closed => break,
        }
    }
    passed
}

/// The same failure, with further text.
fn and(failed: SinkError, more: &str) -> SinkError {
    let (SinkError::Lost { message, hint } | SinkError::Failed { message, hint }) = failed;
    SinkError::Lost { message: format!("{message}; {more}"), hint }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bytes::Bytes;
    use teampulse_bag::{Bag, CONTINUES_NOTE, ENDED_NOTE};
    use teampulse_core::data::{Data, Event, EventKind};
    use teampulse_core::sample::{Record, Sample, Turn};
    use teampulse_core::session_streams::{descriptions, session_events};
    use teampulse_core::sink::{Batch, Limits, Post, Posted, queue_within};
    use teampulse_core::stream::{About, Shape, Stream, Subject};
    use teampulse_core::streams::Streams;
    use teampulse_core::time::Time;
    use teampulse_messages::convert::{decode, encode};
    use tempfile::TempDir;

    use super::*;

    fn marker(streams: &Streams, second: i64) -> Batch {
        let stream = Stream::raw("/r1/marks", Subject::robot("r1"), Shape::Event);
        happens(streams, stream, second, (EventKind::Marker, &format!("{second}"), 0.0))
    }

    fn phase(streams: &Streams, second: i64, label: &str, duration_secs: f64) -> Batch {
        happens(streams, session_events(), second, (EventKind::Phase, label, duration_secs))
    }

    fn happens(
        streams: &Streams,
        stream: Stream,
        second: i64,
        (kind, label, duration_secs): (EventKind, &str, f64),
    ) -> Batch {
        let id = streams.declare(stream).id;
        let event = Event { kind, label: label.into(), value: f64::NAN, duration_secs };
        let at = Time::from_nanos(second * 1_000_000_000);
        let sample = Sample {
            stream: id,
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: second as u64,
            turn: Turn::OnTime,
            data: Data::Event(Arc::new(event)),
        };
        let cdr: Bytes = encode(&sample);
        Batch::from(vec![Record { stream: streams.get(id), sample, cdr }])
    }

    /// A bag whose disk stands still: cut off after its first message.
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
        (post, inbox, Box::new(ContinuingBag { bag, ended: Ended::default(), again }), streams)
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
        assert!(message.contains("1 messages are in no bag"), "{message}");

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
        let sink = Box::new(ContinuingBag { bag, ended: ended.clone(), again });
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
            let [own] =
                &messages.iter().filter(|each| is_event(each.stream)).collect::<Vec<_>>()[..]
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
        let ContinuingBag { bag, ended, .. } = *sink;
        let broken = bag.clone().begin().unwrap().record(&inbox).unwrap_err();
        let going = std::thread::spawn(move || goes_on(&bag, None, broken, (&inbox, &ended), 1));
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
        let SinkError::Lost { message, .. } = going.join().unwrap() else { panic!() };
        assert!(message.contains("ends after 1 bags"), "{message}");
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
        assert!(message.ends_with("; 1 messages are in no bag"), "{message}");
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
        let (found, _) = begin_again(&first, Some(&fallback)).unwrap();
        assert_eq!(found, fallback.join("bag_2"));
        assert!(begin_again(&first, None).is_none());
    }
}
