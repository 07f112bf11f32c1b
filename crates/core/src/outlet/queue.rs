//! The queue in front of the pump.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;
use tokio::sync::futures::Notified;

use super::{Outlet, Supply};
use crate::clock::Clock;
use crate::commands::Commands;
use crate::source::Reading;
use crate::stream::{Stream, StreamId};
use crate::streams::Streams;
use crate::time::Time;

/// The queue in front of the pump: all sources' readings, in the order in which they were handed over.
#[derive(Clone, Debug)]
pub struct Queue(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    state: Mutex<Waiting>,
    filled: Condvar,
    drained: Notify,
    closed: AtomicBool,
    closing: Notify,
    ended: AtomicBool,
    budgets: Mutex<Vec<Arc<Budget>>>,
    commands: Commands,
}

#[derive(Debug, Default)]
struct Waiting {
    items: VecDeque<Item>,
    pump_sleeps: bool,
}

/// An item of the queue.
#[derive(Debug)]
pub(crate) enum Item {
    /// A stream was declared, or updated, with the budget of its source.
    Declared { id: StreamId, stream: Arc<Stream>, at: Time, budget: Arc<Budget> },
    /// A reading, with the time of its arrival and its source's budget.
    Arrived { reading: Reading, arrival: Time, budget: Arc<Budget> },
    /// Time passed until `until` without a reading.
    Passed { until: Time },
    /// The recording was paused until `until`; that time is skipped.
    Paused { until: Time },
    /// Samples of a stream were dropped, as they did not fit in the source's budget.
    Dropped { stream: StreamId, samples: u64 },
}

impl Item {
    /// The memory of the item in the queue [bytes], and the budget that it counts against.
    fn held(&self) -> Option<(usize, &Budget)> {
        match self {
            Item::Declared { stream, budget, .. } => Some((declaration_bytes(stream), budget)),
            Item::Arrived { reading, budget, .. } => Some((reading_bytes(reading), budget)),
            Item::Passed { .. } | Item::Paused { .. } | Item::Dropped { .. } => None,
        }
    }
}

/// The memory of a reading in the queue [bytes].
pub(super) fn reading_bytes(reading: &Reading) -> usize {
    size_of::<Item>() + reading.data.held_bytes()
}

/// The memory of a declaration in the queue [bytes].
pub(super) fn declaration_bytes(stream: &Stream) -> usize {
    size_of::<Item>() + size_of::<Stream>() + stream.held_bytes()
}

/// The budget of one source in the queue: the memory of its items, and the samples that did not fit.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    bytes: AtomicUsize,
    dropped: Mutex<BTreeMap<StreamId, u64>>,
}

impl Budget {
    /// The memory of the waiting items [bytes].
    pub(super) fn waiting_bytes(&self) -> usize {
        self.bytes.load(Ordering::Acquire)
    }

    /// Adds to the memory of the waiting items [bytes].
    pub(super) fn add(&self, bytes: usize) {
        self.bytes.fetch_add(bytes, Ordering::AcqRel);
    }

    /// Counts the samples of a reading that did not fit.
    pub(super) fn drop_one(&self, reading: &Reading) {
        *self.dropped().entry(reading.stream).or_default() += u64::from(reading.data.samples());
    }

    fn dropped(&self) -> MutexGuard<'_, BTreeMap<StreamId, u64>> {
        self.dropped.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Queue {
    /// An empty, open queue.
    pub fn new() -> Queue {
        Queue::with_commands(Commands::default())
    }

    /// An empty, open queue of a session with these commands.
    pub(crate) fn with_commands(commands: Commands) -> Queue {
        Queue(Arc::new(Shared {
            state: Mutex::default(),
            filled: Condvar::new(),
            drained: Notify::new(),
            closed: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            closing: Notify::new(),
            budgets: Mutex::default(),
            commands,
        }))
    }

    /// An outlet into this queue, with its own budget.
    pub fn outlet(&self, clock: Clock, streams: Streams) -> Outlet {
        let budget = Arc::<Budget>::default();
        self.budgets().push(Arc::clone(&budget));
        Outlet { queue: self.clone(), budget, supply: Supply::default(), clock, streams }
    }

    /// Closes the queue: sources stop; readings that they still deliver are accepted.
    pub fn close(&self) {
        self.0.closed.store(true, Ordering::Release);
        self.0.closing.notify_waiters();
        self.0.drained.notify_waiters();
    }

    /// Ends the queue: all sources have stopped, and nothing more will arrive.
    pub(crate) fn end(&self) {
        self.0.ended.store(true, Ordering::Release);
        self.0.filled.notify_all();
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.0.ended.load(Ordering::Acquire)
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.0.closed.load(Ordering::Acquire)
    }

    /// Moves all waiting items into `taken`; if there are none, waits for at most `patience`. Drops are reported after
    /// the kept readings.
    pub(crate) fn take(&self, taken: &mut VecDeque<Item>, patience: Duration) {
        let mut state = self.lock();
        if state.items.is_empty() && !self.has_ended() {
            state.pump_sleeps = true;
            let waited = self.0.filled.wait_timeout(state, patience);
            (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
            state.pump_sleeps = false;
        }
        std::mem::swap(&mut state.items, taken);
        drop(state);
        for item in &*taken {
            if let Some((bytes, budget)) = item.held() {
                budget.bytes.fetch_sub(bytes, Ordering::AcqRel);
            }
        }
        for budget in self.budgets().iter() {
            let dropped = std::mem::take(&mut *budget.dropped()).into_iter();
            taken.extend(dropped.map(|(stream, samples)| Item::Dropped { stream, samples }));
        }
        self.0.drained.notify_waiters();
    }

    /// Takes the waiting readings in hand-over order; for tests of a source or a worker.
    pub fn readings(&self) -> Vec<Reading> {
        let mut taken = VecDeque::new();
        self.take(&mut taken, Duration::ZERO);
        let readings = taken.into_iter().filter_map(|item| match item {
            Item::Arrived { reading, .. } => Some(reading),
            _ => None,
        });
        readings.collect()
    }

    /// Resolves when the queue is closed.
    pub(super) async fn closed(&self) {
        loop {
            let closing = self.0.closing.notified();
            if self.is_closed() {
                return;
            }
            closing.await;
        }
    }

    /// Resolves when the pump has emptied the queue, or the queue is closed.
    pub(super) fn drained(&self) -> Notified<'_> {
        self.0.drained.notified()
    }

    /// The commands of the session.
    pub(super) fn commands(&self) -> &Commands {
        &self.0.commands
    }

    fn budgets(&self) -> MutexGuard<'_, Vec<Arc<Budget>>> {
        self.0.budgets.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends an item, and wakes the pump only if it sleeps.
    pub(super) fn push(&self, make: impl FnOnce() -> Item) {
        self.push_with(|| ([make()], ()));
    }

    /// Appends any number of items, one directly after the other; returns the second value of
    /// `make`.
    pub(super) fn push_with<I, T>(&self, make: impl FnOnce() -> (I, T)) -> T
    where
        I: IntoIterator<Item = Item>,
    {
        let mut state = self.lock();
        let (items, beside) = make();
        state.items.extend(items);
        if !state.items.is_empty() && std::mem::take(&mut state.pump_sleeps) {
            self.0.filled.notify_one();
        }
        beside
    }
}

impl Default for Queue {
    fn default() -> Queue {
        Queue::new()
    }
}
