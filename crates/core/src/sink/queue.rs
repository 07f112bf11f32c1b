//! The queue in front of a sink: bounded, with skipped and lost records counted.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::Delivery;
use crate::clock::Stopwatch;
use crate::data::Data;
use crate::fault::lasting;
use crate::latched::Latched;
use crate::outlet::Outlet;
use crate::sample::Record;
use crate::streams::Streams;

/// A run of records in the pump's order, shared by all sinks.
pub type Batch = Arc<[Record]>;

/// The limits of a sink's queue: its size, and how long it may block the pump.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// The largest size of the waiting records [bytes].
    pub bytes: usize,
    /// How long a lossless sink may block the pump; `None` for no limit.
    pub patience: Option<Duration>,
    /// The time after which a lossless sink that takes no records is reported.
    pub stall: Duration,
}

impl Limits {
    /// The limits of a live session. A lossless sink survives a disk that stalls for twelve seconds
    /// at 20 MB/s.
    pub fn live(delivery: Delivery) -> Limits {
        let bytes = match delivery {
            Delivery::Lossless => 256 << 20,
            Delivery::Fresh => 64 << 20,
        };
        let (patience, stall) = (Some(Duration::from_secs(5)), Duration::from_secs(3));
        Limits { bytes, patience, stall }
    }
}

/// Makes the two ends of a sink's queue, with the limits of a live session.
pub fn queue(delivery: Delivery, streams: Streams) -> (Post, Inbox) {
    queue_within(delivery, streams, Limits::live(delivery))
}

/// Makes the two ends of a sink's queue, with the given limits.
pub fn queue_within(delivery: Delivery, streams: Streams, limits: Limits) -> (Post, Inbox) {
    let shared = Arc::new(Shared::default());
    let post = Post { delivery, limits, shared: Arc::clone(&shared) };
    (post, Inbox { streams, shared, outlet: None })
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    /// Whether an end may be waiting for a change; waking it needlessly would cost a system call. Set under the lock.
    is_awaited: AtomicBool,
    /// The lasting state of the records that were taken out of the queue or skipped.
    latched: Mutex<Latched>,
}

#[derive(Debug, Default)]
struct State {
    batches: VecDeque<(Batch, usize)>,
    /// The number of batches at the front that contain only [lasting](is_lasting) records.
    thinned: usize,
    bytes: usize,
    skipped: u64,
    closed: bool,
    abandoned: bool,
    /// Why the queue ended before the session.
    cut_off: Option<String>,
    /// Since when records have been waiting without any being taken.
    waits: Option<Stopwatch>,
    /// Whether the stall was reported.
    is_stalled: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a change while `is_idle`, at most for `patience`; returns whether that time ran out.
    fn wait<'a>(
        &self,
        state: MutexGuard<'a, State>,
        patience: Duration,
        mut is_idle: impl FnMut(&mut State) -> bool,
    ) -> (MutexGuard<'a, State>, bool) {
        let waited = self.changed.wait_timeout_while(state, patience, |state| {
            let waits = is_idle(state);
            self.is_awaited.fetch_or(waits, Ordering::Relaxed);
            waits
        });
        let (state, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        (state, timeout.timed_out())
    }

    /// Wakes a waiting end after a change.
    fn wake(&self) {
        if self.is_awaited.swap(false, Ordering::Relaxed) {
            self.changed.notify_all();
        }
    }

    fn note_latched(&self, batch: &[Record]) {
        let mut latched = self.latched.lock().unwrap_or_else(PoisonError::into_inner);
        for record in batch {
            latched.take(record);
        }
    }
}

/// Whether no later record replaces this one: an event, or the description of a stream.
fn is_lasting(record: &Record) -> bool {
    matches!(record.sample.data, Data::Event(_) | Data::Description(_))
}

fn held_bytes(batch: &[Record]) -> usize {
    batch.iter().map(Record::held_bytes).sum()
}

/// The pump's end of a sink's queue.
#[derive(Debug)]
pub struct Post {
    delivery: Delivery,
    limits: Limits,
    shared: Arc<Shared>,
}

/// The result of a delivery.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Posted {
    /// The batch was queued, possibly in place of older ones.
    Accepted,
    /// The batch was queued, but the sink has taken nothing for a while. Returned once for each stall.
    Stalled {
        /// The size of the waiting records [bytes].
        waiting_bytes: usize,
    },
    /// The batch was queued, and the sink takes records again after a stall.
    Recovered,
    /// The sink blocked the pump for too long: this is the first batch that it does not get. Later ones are
    /// [skipped](Posted::Skipped) until it [resumes](Inbox::resume).
    CutOff {
        /// The reason, which fits after "failed to".
        reason: String,
    },
    /// The sink is cut off; undelivered records are counted.
    Skipped,
    /// The sink has ended.
    Ended,
}

impl Post {
    /// Delivers a batch to the sink, in the way that the sink declares.
    pub fn deliver(&self, batch: &Batch) -> Posted {
        let bytes = held_bytes(batch);
        let state = self.shared.lock();
        let posted = match self.delivery {
            Delivery::Lossless => self.deliver_all(state, batch, bytes),
            Delivery::Fresh => self.deliver_newest(state, batch, bytes),
        };
        self.shared.wake();
        posted
    }

    fn deliver_all(&self, state: MutexGuard<'_, State>, batch: &Batch, bytes: usize) -> Posted {
        let is_full = |state: &mut State| {
            state.is_open() && state.bytes > 0 && state.bytes + bytes > self.limits.bytes
        };
        let patience = self.limits.patience.unwrap_or(Duration::MAX);
        let (mut state, is_late) = self.shared.wait(state, patience, is_full);
        if state.abandoned || state.closed {
            return Posted::Ended;
        }
        if is_late {
            let (secs, mib) = (patience.as_secs(), state.bytes >> 20);
            let reason = format!("keep up: it took nothing for {secs} s while {mib} MiB waited");
            state.cut_off = Some(reason.clone());
            state.skipped += batch.len() as u64;
            self.shared.note_latched(batch);
            return Posted::CutOff { reason };
        }
        if state.cut_off.is_some() {
            state.skipped += batch.len() as u64;
            self.shared.note_latched(batch);
            return Posted::Skipped;
        }
        state.put(batch, bytes);
        let waited = state.waits.as_ref().map_or(Duration::ZERO, Stopwatch::elapsed);
        let is_stalled = waited >= self.limits.stall;
        match (std::mem::replace(&mut state.is_stalled, is_stalled), is_stalled) {
            (false, true) => Posted::Stalled { waiting_bytes: state.bytes },
            (true, false) => Posted::Recovered,
            _ => Posted::Accepted,
        }
    }

    fn deliver_newest(
        &self,
        mut state: MutexGuard<'_, State>,
        batch: &Batch,
        bytes: usize,
    ) -> Posted {
        if !state.is_open() {
            return Posted::Ended;
        }
        while state.bytes > 0 && state.bytes + bytes > self.limits.bytes {
            state.skip_oldest();
        }
        state.put(batch, bytes);
        Posted::Accepted
    }

    /// A handle with which the session can end this queue early.
    pub(crate) fn gate(&self) -> Gate {
        Gate(Arc::clone(&self.shared))
    }
}

impl State {
    fn is_open(&self) -> bool {
        !self.closed && !self.abandoned && self.cut_off.is_none()
    }

    /// Skips the least important records: the oldest samples; the oldest lasting records only when no
    /// sample is left.
    fn skip_oldest(&mut self) {
        let at = if self.thinned < self.batches.len() { self.thinned } else { 0 };
        let Some((oldest, bytes)) = self.batches.remove(at) else { return };
        self.bytes -= bytes;
        self.skipped += oldest.len() as u64;
        if at < self.thinned {
            self.thinned -= 1;
            return;
        }
        let lasting: Batch = oldest.iter().filter(|record| is_lasting(record)).cloned().collect();
        if !lasting.is_empty() {
            let bytes = held_bytes(&lasting);
            self.bytes += bytes;
            self.skipped -= lasting.len() as u64;
            self.batches.insert(at, (lasting, bytes));
            self.thinned += 1;
        }
    }

    fn put(&mut self, batch: &Batch, bytes: usize) {
        if self.batches.is_empty() {
            self.waits = Some(Stopwatch::start());
        }
        self.bytes += bytes;
        self.batches.push_back((Arc::clone(batch), bytes));
    }
}

impl Drop for Post {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.wake();
    }
}

/// A handle that ends a sink's queue from outside the pump.
#[derive(Clone, Debug)]
pub(crate) struct Gate(Arc<Shared>);

impl Gate {
    /// Ends the queue, for a reason that fits after "failed to". Waiting records are still handed
    /// out.
    pub(crate) fn break_off(&self, reason: &str) {
        let mut state = self.0.lock();
        if !state.closed {
            state.cut_off.get_or_insert_with(|| reason.to_owned());
            state.closed = true;
        }
        self.0.wake();
    }

    /// Why the queue ended, unless the session simply ended.
    pub(crate) fn cut_off(&self) -> Option<String> {
        self.0.lock().cut_off.clone()
    }
}

/// A sink's end of its queue.
#[derive(Debug)]
pub struct Inbox {
    streams: Streams,
    shared: Arc<Shared>,
    outlet: Option<Outlet>,
}

/// An item of an inbox.
#[derive(Debug)]
pub enum Received {
    /// Records, in the pump's order.
    Batch(Batch),
    /// No record arrived within the given time.
    Silence,
    /// The queue has ended: the session is over, or this sink was [cut off](Inbox::cut_off).
    Closed,
}

impl Inbox {
    /// The streams of the session.
    pub fn streams(&self) -> &Streams {
        &self.streams
    }

    /// Waits for the next batch for at most `patience`.
    pub fn receive(&self, patience: Duration) -> Received {
        let is_idle = |state: &mut State| {
            state.batches.is_empty() && !state.closed && state.cut_off.is_none()
        };
        let (mut state, _) = self.shared.wait(self.shared.lock(), patience, is_idle);
        match state.batches.pop_front() {
            Some((batch, bytes)) => {
                state.bytes -= bytes;
                state.thinned = state.thinned.saturating_sub(1);
                state.waits = (!state.batches.is_empty()).then(Stopwatch::start);
                drop(state);
                self.shared.wake();
                self.shared.note_latched(&batch);
                Received::Batch(batch)
            }
            None if state.closed || state.cut_off.is_some() => Received::Closed,
            None => Received::Silence,
        }
    }

    /// Waits like [`receive`](Inbox::receive), for a sink that need not be prompt: if nothing is waiting, records first
    /// gather for `gather`, so that the sink wakes up less often.
    pub fn receive_gathered(&self, gather: Duration, patience: Duration) -> Received {
        let state = self.shared.lock();
        let gathers = state.batches.is_empty() && state.is_open();
        drop(state);
        if gathers {
            std::thread::sleep(gather);
        }
        self.receive(patience)
    }

    /// Why the queue ended, unless the session is over. It fits after "failed to".
    pub fn cut_off(&self) -> Option<String> {
        self.shared.lock().cut_off.clone()
    }

    /// Takes records again, after this sink was cut off; returns the number of records that it missed. `None` when the
    /// queue has ended.
    pub fn resume(&self) -> Option<u64> {
        let mut state = self.shared.lock();
        if state.closed {
            return None;
        }
        state.cut_off = None;
        Some(std::mem::take(&mut state.skipped))
    }

    /// The lasting state from all records received or skipped so far; a recording that continues elsewhere begins with
    /// it.
    pub fn latched(&self) -> Latched {
        self.shared.latched.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The number of records skipped since the last call.
    pub fn take_skipped(&self) -> u64 {
        std::mem::take(&mut self.shared.lock().skipped)
    }

    /// Reports a lasting fault of this sink, as an event of the session.
    pub fn report(&self, label: impl Into<String>) {
        if let Some(outlet) = &self.outlet {
            outlet.happen(lasting(label));
        }
    }

    /// The outlet into the session, for the commands, notes and reports of a sink's users. `None` outside a session.
    pub fn outlet(&self) -> Option<&Outlet> {
        self.outlet.as_ref()
    }

    /// Adds an outlet, through which the sink can report faults.
    pub(crate) fn reporting_to(mut self, outlet: Outlet) -> Inbox {
        self.outlet = Some(outlet);
        self
    }
}

impl Drop for Inbox {
    fn drop(&mut self) {
        self.shared.lock().abandoned = true;
        self.shared.wake();
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::data::{Event, EventKind};
    use crate::sample::{Sample, Turn};
    use crate::status::{State as Health, StreamStatus};
    use crate::stream::{Shape, Stream, StreamId, Subject};
    use crate::text::LONGEST_PROSE;
    use crate::time::Time;

    const LIMIT_BYTES: usize = 1 << 20;

    fn limits() -> Limits {
        let (patience, stall) = (Some(Duration::ZERO), Duration::MAX);
        Limits { bytes: LIMIT_BYTES, patience, stall }
    }

    fn record(index: u64, data: Data) -> Record {
        let stream = Stream::raw("/r1/x", Subject::robot("r1"), Shape::Sample);
        let cdr = if let Data::Message(bytes) = &data { bytes.clone() } else { Bytes::new() };
        let sample = Sample {
            stream: StreamId(0),
            measured: Time::EPOCH,
            log_time: Time::EPOCH,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index,
            turn: Turn::OnTime,
            data,
        };
        Record { stream: Arc::new(stream), sample, cdr }
    }

    fn description() -> Data {
        let stream = Stream::raw("/r1/x", Subject::robot("r1"), Shape::Sample);
        Data::Description(Arc::new(Stream { doc: "x".repeat(LONGEST_PROSE), ..stream }))
    }

    fn status() -> Data {
        let status = StreamStatus {
            name: "x".repeat(LONGEST_PROSE),
            state: Health::Ok,
            reason: String::new(),
            rate_hz: 0.0,
            age_secs: 0.0,
            received: 0,
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock: 0,
            epoch: 0,
            offset_secs: 0.0,
            skew_ppm: 0.0,
            jitter_secs: 0.0,
            sigma_secs: 0.0,
            latency_secs: 0.0,
        };
        Data::Status(Arc::new(status))
    }

    fn event() -> Data {
        let (kind, label) = (EventKind::Marker, "x".repeat(LONGEST_PROSE));
        Data::Event(Arc::new(Event { kind, label, value: f64::NAN, duration_secs: 0.0 }))
    }

    #[test]
    fn a_queue_is_bounded_by_the_whole_memory_of_its_records() {
        for data in [description, status, event] {
            for delivery in [Delivery::Fresh, Delivery::Lossless] {
                let (post, inbox) = queue_within(delivery, Streams::default(), limits());
                let offered = 2 * LIMIT_BYTES / LONGEST_PROSE;
                for index in 0..offered {
                    post.deliver(&Batch::from([record(index as u64, data())]));
                }
                let state = inbox.shared.lock();
                let held = state.batches.len();
                assert!(held * LONGEST_PROSE <= LIMIT_BYTES, "{held} records");
                assert_eq!(held as u64 + state.skipped, offered as u64);
            }
        }
    }

    /// A sample that takes a tenth of the queue.
    fn large(index: u64) -> Record {
        record(index, Data::Message(Bytes::from(vec![0; LIMIT_BYTES / 10])))
    }

    fn taken(inbox: &Inbox) -> Vec<u64> {
        let batch = || match inbox.receive(Duration::ZERO) {
            Received::Batch(batch) => Some(batch),
            _ => None,
        };
        let batches: Vec<Batch> = std::iter::from_fn(batch).collect();
        batches.iter().flat_map(|batch| batch.iter()).map(|record| record.sample.index).collect()
    }

    #[test]
    fn a_fresh_sink_gets_the_newest_and_every_event_and_skips_are_counted() {
        let (post, inbox) = queue_within(Delivery::Fresh, Streams::default(), limits());
        for index in 0..30 {
            let index = 10 * index;
            post.deliver(&Batch::from([large(index), record(index + 1, event())]));
        }
        let given = taken(&inbox);
        let (events, samples): (Vec<u64>, Vec<u64>) =
            given.iter().partition(|index| *index % 10 == 1);
        assert_eq!(events, (0..30).map(|index| 10 * index + 1).collect::<Vec<_>>());
        let oldest = 30 - samples.len() as u64;
        assert!((5..=9).contains(&samples.len()), "{samples:?}");
        assert_eq!(samples, (oldest..30).map(|index| 10 * index).collect::<Vec<_>>());
        assert!(given.is_sorted(), "in the pump's order");
        assert_eq!(inbox.take_skipped(), oldest);
        post.deliver(&Batch::from([large(300)]));
        assert_eq!(taken(&inbox), [300]);
        assert_eq!(inbox.take_skipped(), 0);
    }

    #[test]
    fn of_more_events_than_fit_the_newest_are_kept() {
        let (post, inbox) = queue_within(Delivery::Fresh, Streams::default(), limits());
        let offered = 2 * LIMIT_BYTES as u64 / LONGEST_PROSE as u64;
        for index in 0..offered {
            post.deliver(&Batch::from([record(index, event())]));
        }
        let given = taken(&inbox);
        assert!(given.iter().copied().eq(offered - given.len() as u64..offered));
        assert_eq!(inbox.take_skipped() + given.len() as u64, offered);
    }
}
