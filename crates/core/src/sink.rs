//! Sinks: whatever keeps or shows data.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use thiserror::Error;

use crate::sample::Record;
use crate::stream::Stream;
use crate::streams::Streams;

/// Whatever keeps or shows data: a bag, a screen, ROS.
///
/// Each sink runs on a thread of its own, so it may block on its disk or its socket.
pub trait Sink: Send {
    /// What it is called in messages: `bag`, `terminal`.
    fn name(&self) -> &'static str;

    /// What happens when it is slower than the samples come.
    fn delivery(&self) -> Delivery;

    /// Which streams it is given.
    fn wants(&self) -> Wants {
        Wants::Everything
    }

    /// Takes what the inbox gives until it is closed, then finishes its work.
    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError>;
}

/// What happens when a sink is slower than the samples come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// It gets every sample; when its queue is full the pump waits, for five seconds at most. Then
    /// the sink is ended as on a full disk while the session goes on.
    Lossless,
    /// It gets the newest samples; what it had no time for is skipped and counted.
    Fresh,
}

/// Which streams a sink is given.
pub enum Wants {
    /// All of them.
    Everything,
    /// Those for which this is true.
    Only(Box<dyn Fn(&Stream) -> bool + Send>),
}

/// Why a sink ended early. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum SinkError {
    /// What it should have kept was not all kept: exit code 3.
    #[error("{message}")]
    Lost {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
    /// It could not do its work at all: exit code 1.
    #[error("{message}")]
    Failed {
        /// What failed.
        message: String,
        /// What the user can do; may be empty.
        hint: String,
    },
}

/// A run of records in the pump's order, shared by all sinks.
pub type Batch = Arc<[Record]>;

/// The most that a sink's queue holds [bytes].
const QUEUE_BYTES: usize = 64 << 20;
/// How long a lossless sink may hold the pump.
const PATIENCE: Duration = Duration::from_secs(5);

/// Makes the two ends of a sink's queue.
pub fn queue(delivery: Delivery, streams: Streams) -> (Post, Inbox) {
    let shared = Arc::new(Shared::default());
    (Post { delivery, shared: Arc::clone(&shared) }, Inbox { streams, shared })
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    batches: VecDeque<(Batch, usize)>,
    bytes: usize,
    skipped: u64,
    closed: bool,
    abandoned: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The pump's end of a sink's queue.
#[derive(Debug)]
pub struct Post {
    delivery: Delivery,
    shared: Arc<Shared>,
}

/// What came of a delivery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Posted {
    /// The sink has it, or will skip it and count.
    Accepted,
    /// The sink has ended, or held the pump for too long and is ended.
    Ended,
}

impl Post {
    /// Hands a batch to the sink, by its delivery.
    pub fn deliver(&self, batch: &Batch) -> Posted {
        let bytes = batch.iter().map(|record| record.cdr.len() + 128).sum();
        let mut state = self.shared.lock();
        match self.delivery {
            Delivery::Lossless => {
                let full = |state: &mut State| {
                    !state.abandoned && state.bytes > 0 && state.bytes + bytes > QUEUE_BYTES
                };
                let waited = self.shared.changed.wait_timeout_while(state, PATIENCE, full);
                let (held, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
                state = held;
                if timeout.timed_out() {
                    state.closed = true;
                }
            }
            Delivery::Fresh => {
                while state.bytes > 0 && state.bytes + bytes > QUEUE_BYTES {
                    let Some((oldest, bytes)) = state.batches.pop_front() else { break };
                    state.bytes -= bytes;
                    state.skipped += oldest.len() as u64;
                }
            }
        }
        if state.closed || state.abandoned {
            self.shared.changed.notify_all();
            return Posted::Ended;
        }
        state.bytes += bytes;
        state.batches.push_back((Arc::clone(batch), bytes));
        self.shared.changed.notify_all();
        Posted::Accepted
    }
}

impl Drop for Post {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.changed.notify_all();
    }
}

/// A sink's end of its queue.
#[derive(Debug)]
pub struct Inbox {
    streams: Streams,
    shared: Arc<Shared>,
}

/// What an inbox gives.
#[derive(Debug)]
pub enum Received {
    /// Records, in the pump's order.
    Batch(Batch),
    /// Nothing came for as long as was asked.
    Silence,
    /// Nothing will come any more.
    Closed,
}

impl Inbox {
    /// The streams of the session.
    pub fn streams(&self) -> &Streams {
        &self.streams
    }

    /// Waits for the next batch, at most for `patience`.
    pub fn receive(&self, patience: Duration) -> Received {
        let empty = |state: &mut State| state.batches.is_empty() && !state.closed;
        let waited = self.shared.changed.wait_timeout_while(self.shared.lock(), patience, empty);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.batches.pop_front() {
            Some((batch, bytes)) => {
                state.bytes -= bytes;
                self.shared.changed.notify_all();
                Received::Batch(batch)
            }
            None if state.closed => Received::Closed,
            None => Received::Silence,
        }
    }

    /// How many records were skipped since this was last asked.
    pub fn take_skipped(&self) -> u64 {
        std::mem::take(&mut self.shared.lock().skipped)
    }
}

impl Drop for Inbox {
    fn drop(&mut self) {
        self.shared.lock().abandoned = true;
        self.shared.changed.notify_all();
    }
}
