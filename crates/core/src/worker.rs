//! Workers: components that process streams at their own pace, such as models of face, pose and voice.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use thiserror::Error;

use crate::command::{Command, Instruction};
use crate::data::Data;
use crate::outlet::Outlet;
use crate::sample::Record;
use crate::sink::Wants;
use crate::stream::StreamId;
use crate::streams::Streams;

/// The most data waiting for a worker [bytes].
const MOST_BYTES: usize = 64 << 20;

/// A component that is fed with streams on its own thread, as fast as it can take them, and offers its results as
/// readings. It never holds up the pump.
///
/// It receives the newest record of each stream, of all streams at once ([`Feed::next`]) or of one stream at a time
/// ([`Feed::next_one`]); older records that it did not get to are skipped and counted. Events are not skipped, nor are
/// records of the streams that it [keeps](Worker::keeps). Its outputs are raw streams with
/// [`inputs`](crate::stream::Stream::inputs), stamped (`source_time`) with the time of the input: those stamps are
/// trusted however long processing took. The outputs are recorded, and never recomputed in a replay.
pub trait Worker: Send {
    /// The streams that the worker is fed with.
    fn wants(&self) -> Wants;

    /// The streams of which the worker receives every record, in order, as long as no more than 64 MiB are waiting:
    /// sound with missing blocks, for example, would be of no use. By default none; events are always kept.
    fn keeps(&self) -> Wants {
        Wants::Only(Box::new(|_| false))
    }

    /// Whether the worker carries out a [command](crate::command::Command); the feed then delivers it.
    fn carries_out(&self) -> Box<dyn Fn(&Command) -> bool + Send> {
        Box::new(|_| false)
    }

    /// Processes the feed until it is closed. After an error the worker is restarted after a pause.
    fn run(&mut self, feed: &Feed, outlet: &Outlet) -> Result<(), WorkerError>;
}

/// Why a worker stopped. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{message}")]
pub struct WorkerError {
    /// What failed.
    pub message: String,
    /// What the user can do; may be empty.
    pub hint: String,
}

/// How much a worker has processed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkerCounts {
    /// The number of records that the worker received, without those on which it failed.
    pub taken: u64,
    /// The number of records that were skipped for newer ones, or on which the worker failed.
    pub skipped: u64,
}

/// An item from a feed.
#[derive(Debug)]
pub enum Fed {
    /// Records, in the pump's order.
    Records(Vec<Record>),
    /// A command that the worker carries out.
    Command(Instruction),
    /// Nothing arrived within the given time.
    Silence,
    /// The session is over.
    Closed,
}

/// A worker's end of its queue.
#[derive(Clone, Debug)]
pub struct Feed {
    streams: Streams,
    shared: Arc<Shared>,
}

/// The pump's end of a worker's queue. Once it is dropped, the feed ends after the waiting records.
pub struct FeedPost {
    wants: Wants,
    keeps: Wants,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<Waiting>,
    filled: Condvar,
}

/// The items waiting for a worker.
#[derive(Debug, Default)]
struct Waiting {
    /// The newest record of each stream, with its place in the order of arrival.
    newest: BTreeMap<StreamId, (u64, Record)>,
    /// Events, and records of the streams that are kept.
    kept: VecDeque<(u64, Record)>,
    commands: VecDeque<Instruction>,
    bytes: usize,
    came: u64,
    /// For each stream, how many records had been taken or skipped when it was last served.
    served: BTreeMap<StreamId, u64>,
    counts: WorkerCounts,
    /// The number of taken records that the worker may still be processing.
    in_work: u64,
    /// Whether nothing more will arrive.
    has_ended: bool,
    is_closed: bool,
}

impl Waiting {
    fn put(&mut self, record: &Record, is_kept: bool) {
        let (id, place) = (record.sample.stream, self.came);
        self.came += 1;
        self.bytes += record.held_bytes();
        if is_kept || matches!(record.sample.data, Data::Event(_)) {
            self.kept.push_back((place, record.clone()));
        } else if let Some((_, older)) = self.newest.insert(id, (place, record.clone())) {
            self.skip(&older);
        }
        while self.bytes > MOST_BYTES && self.newest.len() + self.kept.len() > 1 {
            self.skip_oldest();
        }
    }

    fn skip(&mut self, record: &Record) {
        self.bytes -= record.held_bytes();
        self.counts.skipped += 1;
    }

    fn skip_oldest(&mut self) {
        let oldest = self.newest.iter().map(|(id, (place, _))| (*place, *id)).min();
        let kept = self.kept.front().map(|(place, _)| *place);
        let record = match (oldest, kept) {
            (Some((place, id)), kept) if kept.is_none_or(|kept| place < kept) => {
                self.newest.remove(&id).map(|(_, record)| record)
            }
            _ => self.kept.pop_front().map(|(_, record)| record),
        };
        if let Some(record) = record {
            self.skip(&record);
        }
    }

    fn take(&mut self) -> Vec<Record> {
        let newest = std::mem::take(&mut self.newest).into_values();
        let mut taken: Vec<_> = newest.chain(std::mem::take(&mut self.kept)).collect();
        taken.sort_by_key(|(place, _)| *place);
        self.bytes = 0;
        self.in_work = taken.len() as u64;
        self.counts.taken += self.in_work;
        taken.into_iter().map(|(_, record)| record).collect()
    }

    /// Takes a record of the stream that was served least recently.
    fn take_one(&mut self) -> Option<Record> {
        let newest = self.newest.iter().map(|(id, (place, _))| (*id, *place));
        let kept = self.kept.front().map(|(place, record)| (record.sample.stream, *place));
        let waiting = newest.chain(kept);
        let (id, place) =
            waiting.min_by_key(|(id, place)| (self.served.get(id).copied(), *place))?;
        let is_kept = kept.is_some_and(|(_, first)| first == place);
        let taken = if is_kept { self.kept.pop_front() } else { self.newest.remove(&id) };
        let (_, record) = taken?;
        self.bytes -= record.held_bytes();
        self.served.insert(id, self.counts.taken + self.counts.skipped);
        self.in_work = 1;
        self.counts.taken += 1;
        Some(record)
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Makes the two ends of a worker's queue, for a session or for a test of the worker.
pub fn queue(worker: &dyn Worker, streams: Streams) -> (FeedPost, Feed) {
    feed(streams, worker.wants(), worker.keeps())
}

fn feed(streams: Streams, wants: Wants, keeps: Wants) -> (FeedPost, Feed) {
    let shared = Arc::<Shared>::default();
    let post = FeedPost { wants, keeps, shared: Arc::clone(&shared) };
    (post, Feed { streams, shared })
}

impl FeedPost {
    /// Queues the records that the worker wants; never waits.
    pub fn offer(&self, records: &[Record]) {
        // Checked for each record, as for sinks: a stream may have been declared again with more details.
        let mut wanted = records.iter().filter(|record| self.wants.include(&record.stream));
        let Some(first) = wanted.next() else { return };
        let mut state = self.shared.lock();
        for record in std::iter::once(first).chain(wanted) {
            state.put(record, self.keeps.include(&record.stream));
        }
        self.shared.filled.notify_all();
    }
}

impl Drop for FeedPost {
    fn drop(&mut self) {
        self.shared.lock().has_ended = true;
        self.shared.filled.notify_all();
    }
}

impl Feed {
    /// The streams of the session.
    pub fn streams(&self) -> &Streams {
        &self.streams
    }

    /// Waits for the next item, at most for `patience`. The waiting records of all streams are returned together; those
    /// that arrive while the worker processes them wait for the next call.
    pub fn next(&self, patience: Duration) -> Fed {
        self.next_of(patience, Waiting::take)
    }

    /// Waits like [`next`](Feed::next), but returns one record at a time, of the stream that was served least recently:
    /// for workers that need long for each record, such as models for pictures. The waiting records of other streams
    /// are still replaced by newer ones while the worker processes it. Records of different streams do not arrive in
    /// the pump's order.
    pub fn next_one(&self, patience: Duration) -> Fed {
        self.next_of(patience, |state| state.take_one().into_iter().collect())
    }

    fn next_of(&self, patience: Duration, take: impl FnOnce(&mut Waiting) -> Vec<Record>) -> Fed {
        let is_idle = |state: &mut Waiting| {
            let is_over = state.is_closed || state.has_ended;
            state.bytes == 0 && state.commands.is_empty() && !is_over
        };
        let waited = self.shared.filled.wait_timeout_while(self.shared.lock(), patience, is_idle);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.in_work = 0;
        if state.is_closed {
            return Fed::Closed;
        }
        if let Some(instruction) = state.commands.pop_front() {
            return Fed::Command(instruction);
        }
        if state.bytes > 0 {
            return Fed::Records(take(&mut state));
        }
        state.is_closed = state.has_ended;
        if state.is_closed { Fed::Closed } else { Fed::Silence }
    }

    /// How many records were taken and skipped so far.
    pub fn counts(&self) -> WorkerCounts {
        self.shared.lock().counts
    }

    /// Counts the records that the worker was working on when it failed as skipped.
    pub(crate) fn failed(&self) {
        let mut state = self.shared.lock();
        let lost = std::mem::take(&mut state.in_work);
        state.counts.taken -= lost;
        state.counts.skipped += lost;
    }

    /// Whether the session is over; long computations should check this.
    pub fn is_closed(&self) -> bool {
        self.shared.lock().is_closed
    }

    /// Queues a command, ahead of the waiting records.
    pub(crate) fn command(&self, instruction: Instruction) {
        self.shared.lock().commands.push_back(instruction);
        self.shared.filled.notify_all();
    }

    /// The number of waiting commands.
    pub(crate) fn waiting_commands(&self) -> usize {
        self.shared.lock().commands.len()
    }

    /// Closes the feed at the end of the session: whatever is still waiting is skipped.
    pub(crate) fn close(&self) {
        let mut state = self.shared.lock();
        let left = state.newest.len() + state.kept.len();
        state.counts.skipped += left as u64;
        state.newest.clear();
        state.kept.clear();
        (state.bytes, state.is_closed) = (0, true);
        self.shared.filled.notify_all();
    }

    /// Waits for the end of the session, at most for `patience`; returns whether it is over.
    pub(crate) fn closes_within(&self, patience: Duration) -> bool {
        let is_open = |state: &mut Waiting| !state.is_closed;
        let waited = self.shared.filled.wait_timeout_while(self.shared.lock(), patience, is_open);
        waited.unwrap_or_else(PoisonError::into_inner).0.is_closed
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::command::Sender;
    use crate::data::{Event, EventKind};
    use crate::sample::{Sample, Turn};
    use crate::stream::{Shape, Stream, Subject};
    use crate::time::Time;

    fn record(stream: u32, index: u64, bytes: usize, data: Data) -> Record {
        let about =
            Arc::new(Stream::raw(format!("/r1/{stream}"), Subject::robot("r1"), Shape::Sample));
        let sample = Sample {
            stream: StreamId(stream),
            measured: Time::EPOCH,
            log_time: Time::EPOCH,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index,
            turn: Turn::OnTime,
            data,
        };
        Record { stream: about, sample, cdr: Bytes::from(vec![0; bytes]) }
    }

    fn frame(stream: u32, index: u64, bytes: usize) -> Record {
        record(stream, index, bytes, Data::Sample(Arc::new([0.0])))
    }

    fn mark(index: u64) -> Record {
        let (kind, label) = (EventKind::Marker, "x".to_owned());
        let event = Event { kind, label, value: f64::NAN, duration_secs: 0.0 };
        record(9, index, 10, Data::Event(Arc::new(event)))
    }

    fn only(wanted: fn(&Stream) -> bool) -> Wants {
        Wants::Only(Box::new(wanted))
    }

    fn taken(feed: &Feed) -> Vec<(u32, u64)> {
        let Fed::Records(records) = feed.next(Duration::ZERO) else { return Vec::new() };
        records.iter().map(|record| (record.sample.stream.0, record.sample.index)).collect()
    }

    #[test]
    fn of_each_stream_the_newest_is_given_and_no_event_is_skipped() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        post.offer(&[frame(1, 0, 10), mark(0), frame(2, 0, 10), frame(1, 1, 10), mark(1)]);
        assert_eq!(taken(&feed), [(9, 0), (2, 0), (1, 1), (9, 1)]);
        assert_eq!(feed.counts(), WorkerCounts { taken: 4, skipped: 1 });
        assert!(matches!(feed.next(Duration::ZERO), Fed::Silence));
    }

    #[test]
    fn of_a_stream_that_is_kept_every_record_is_given_in_order() {
        let voice = only(|stream| stream.name == "/r1/2");
        let (post, feed) = feed(Streams::default(), Wants::Everything, voice);
        post.offer(&[frame(1, 0, 10), frame(2, 0, 10), frame(1, 1, 10), frame(2, 1, 10)]);
        assert_eq!(taken(&feed), [(2, 0), (1, 1), (2, 1)]);
        assert_eq!(feed.counts(), WorkerCounts { taken: 3, skipped: 1 });
    }

    fn taken_one(feed: &Feed) -> Option<(u32, u64)> {
        let Fed::Records(records) = feed.next_one(Duration::ZERO) else { return None };
        let [record] = &records[..] else { panic!("{records:?}") };
        Some((record.sample.stream.0, record.sample.index))
    }

    #[test]
    fn a_slow_worker_of_several_streams_gets_the_newest_of_each_in_turn() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        // While it processes a record, each of three cameras sends another.
        let served = (0..6).filter_map(|index| {
            post.offer(&[frame(1, index, 10), frame(2, index, 10), frame(3, index, 10)]);
            taken_one(&feed)
        });
        assert_eq!(served.collect::<Vec<_>>(), [(1, 0), (2, 1), (3, 2), (1, 3), (2, 4), (3, 5)]);
        assert_eq!(feed.counts(), WorkerCounts { taken: 6, skipped: 10 });
        // A stream that falls silent does not hold up the others.
        post.offer(&[frame(2, 6, 10)]);
        assert_eq!(
            [taken_one(&feed), taken_one(&feed), taken_one(&feed)],
            [Some((1, 5)), Some((2, 6)), None]
        );
        feed.failed();
        assert_eq!(feed.counts(), WorkerCounts { taken: 8, skipped: 11 });
    }

    #[test]
    fn one_by_one_no_kept_record_is_skipped_and_no_stream_is_starved() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        post.offer(&[mark(0), mark(1), frame(1, 0, 10), mark(2), frame(1, 1, 10)]);
        let served = std::iter::from_fn(|| taken_one(&feed));
        assert_eq!(served.collect::<Vec<_>>(), [(9, 0), (1, 1), (9, 1), (9, 2)]);
        assert_eq!(feed.shared.lock().bytes, 0);
    }

    #[test]
    fn a_feed_ends_after_what_waits_when_its_post_is_dropped() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        post.offer(&[frame(1, 0, 10)]);
        drop(post);
        assert!(!feed.is_closed());
        assert_eq!(taken(&feed), [(1, 0)]);
        assert!(matches!(feed.next(Duration::from_secs(9)), Fed::Closed) && feed.is_closed());
    }

    #[test]
    fn a_command_comes_before_the_records_that_wait() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        post.offer(&[frame(1, 0, 10)]);
        let (sender, at) = (Sender::keys(), Time::from_nanos(7));
        let split = Instruction { sender, command: Command::Split, at };
        feed.command(split.clone());
        assert!(matches!(feed.next(Duration::ZERO), Fed::Command(given) if given == split));
        assert_eq!(taken(&feed), [(1, 0)]);
    }

    #[test]
    fn what_a_worker_failed_over_was_not_processed() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        post.offer(&[frame(1, 0, 10), frame(2, 0, 10)]);
        assert_eq!(taken(&feed), [(1, 0), (2, 0)]);
        post.offer(&[mark(0)]);
        assert_eq!(taken(&feed), [(9, 0)]);
        feed.failed();
        feed.failed();
        assert_eq!(feed.counts(), WorkerCounts { taken: 2, skipped: 1 });
    }

    #[test]
    fn what_is_not_wanted_does_not_come() {
        let (post, feed) =
            feed(Streams::default(), only(|stream| stream.name == "/r1/2"), only(|_| false));
        post.offer(&[frame(1, 0, 10), frame(2, 0, 10)]);
        assert_eq!(taken(&feed), [(2, 0)]);
    }

    #[test]
    fn the_queue_is_bounded_in_bytes_and_the_oldest_is_skipped_first() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        for stream in 0..5 {
            post.offer(&[frame(stream, 0, MOST_BYTES / 3)]);
        }
        assert!(feed.shared.lock().bytes <= MOST_BYTES);
        assert_eq!(taken(&feed), [(3, 0), (4, 0)]);
        // A single frame that is larger than all is still given.
        post.offer(&[frame(1, 1, 2 * MOST_BYTES)]);
        assert_eq!(taken(&feed), [(1, 1)]);
        assert_eq!(feed.counts(), WorkerCounts { taken: 3, skipped: 3 });
    }

    #[test]
    fn a_closed_feed_counts_what_was_never_looked_at() {
        let (post, feed) = feed(Streams::default(), Wants::Everything, only(|_| false));
        post.offer(&[frame(1, 0, 10), mark(0)]);
        feed.close();
        assert!(matches!(feed.next(Duration::from_secs(9)), Fed::Closed));
        assert_eq!(feed.counts(), WorkerCounts { taken: 0, skipped: 2 });
    }
}
