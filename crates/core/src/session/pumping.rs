//! The pump on its thread, between its queue and its sinks.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::oneshot;

use super::gathering::Gathering;
use super::sinks::{self, Route};
use super::{LOOK, Once, Outcome, Pace};
use crate::clock::{Clock, Stopwatch};
use crate::extractors::Broken;
use crate::fault::lasting;
use crate::outlet::Item;
use crate::outlet::Queue;
use crate::panics::{Panic, watched};
use crate::pump::{BATCH, Pump};
use crate::standstill::stood_still;
use crate::time::Time;
use crate::worker::FeedPost;

/// How long the pump waits for readings before it looks at the clock.
const PATIENCE: Duration = Duration::from_millis(30);
/// How long a live pump computes before it hands over the results so far: the features of one sensor don't wait for the
/// features of all others.
const PROMPT: Duration = Duration::from_millis(1);
/// A recording that arrives in smaller portions than this is being played in real time: records are delivered at once.
const FEW: usize = 64;
/// How long a live session computes features after its end was requested; later, waiting readings are only recorded.
const COMPUTES: Duration = Duration::from_secs(3);
/// How long a live session takes waiting readings after its end was requested; the rest are counted as lost.
const LAST_WORDS: Duration = Duration::from_secs(5);
/// At the end of a session, a pump that works longer than this on one reading counts as hung.
const STUCK: Duration = Duration::from_secs(3);

/// A wait of a few milliseconds that lasts this long shows that the process was suspended.
const STANDSTILL: Duration = Duration::from_secs(2);

/// The result of a pump.
#[derive(Default)]
struct Pumped {
    dropped: u64,
    broken: Vec<Broken>,
}

/// A running pump.
pub(super) struct Pumping {
    ended: oneshot::Receiver<Result<Pumped, Panic>>,
    known: Option<Result<Pumped, Panic>>,
    shared: Arc<PumpState>,
    pace: Pace,
}

/// The state shared by the pump's thread and the session.
#[derive(Debug, Default)]
struct PumpState {
    /// The number of items taken so far.
    taken: AtomicU64,
    /// Whether a sink is blocking the pump at the moment.
    is_held: AtomicBool,
    /// Whether features are skipped from now on.
    is_hurried: AtomicBool,
}

impl Pumping {
    /// Starts a pump on its own thread.
    pub(super) fn start(mut pipeline: Pipeline) -> Pumping {
        let (send_end, ended) = oneshot::channel();
        let (shared, pace) = (Arc::clone(&pipeline.shared), pipeline.pace);
        let work = move || {
            let pumped = watched(|| pipeline.run());
            if let Err(panic) = &pumped {
                // Everything from before the panic is kept.
                drop(watched(|| {
                    sinks::deliver(&mut pipeline.routes, &[], pipeline.pump.records())
                }));
                let reason = format!("continue: the pump panicked: {panic}");
                pipeline.routes.iter().for_each(|route| route.break_off(&reason));
            }
            drop(pipeline);
            // Nobody waits for a pump that was abandoned.
            drop(send_end.send(pumped));
        };
        let thread = std::thread::Builder::new().name("pump".into());
        drop(thread.spawn(work).expect("the system can start a thread"));
        Pumping { ended, known: None, shared, pace }
    }

    /// Waits until it has ended.
    pub(super) async fn ended(&mut self) {
        if self.known.is_none() {
            let gone = |_| Err(Panic { message: "its thread is gone".into(), place: None });
            self.known = Some((&mut self.ended).await.unwrap_or_else(gone));
        }
    }

    /// Waits until the queue is empty; a pump that takes too long is cut short.
    pub(super) async fn finish(
        mut self,
        hurry: &mut Once<'_, impl Future<Output = ()>>,
        sinks: &[sinks::Running],
        outcome: &mut Outcome,
    ) {
        let mut progress = (Stopwatch::start(), 0);
        let mut is_hurried = false;
        loop {
            tokio::select! {
                () = self.ended() => break,
                () = hurry.done(), if !is_hurried => {
                    is_hurried = true;
                    self.shared.is_hurried.store(true, Ordering::Release);
                    // A recording waits for its sinks without a limit, but no longer once it is hurried.
                    if self.pace == Pace::Recorded {
                        break_off(sinks, "wait for its disk");
                    }
                }
                () = tokio::time::sleep(LOOK) => {}
            }
            let taken = self.shared.taken.load(Ordering::Acquire);
            if taken != progress.1 || self.shared.is_held.load(Ordering::Acquire) {
                progress = (Stopwatch::start(), taken);
            }
            if progress.0.elapsed() >= STUCK {
                let reason = "continue: a feature did not return";
                break_off(sinks, reason);
                outcome.undone.push("the pump: a feature did not return".into());
                return;
            }
        }
        match self.known.take() {
            Some(Ok(Pumped { dropped, broken })) => {
                outcome.dropped = dropped;
                outcome.features = broken;
            }
            Some(Err(panic)) => outcome.pump = Some(panic),
            None => {}
        }
    }
}

fn break_off(sinks: &[sinks::Running], reason: &str) {
    for sink in sinks {
        sink.break_off(reason);
    }
}

/// The pump with its queue and its sinks.
pub(super) struct Pipeline {
    queue: Queue,
    clock: Clock,
    pace: Pace,
    pump: Pump,
    routes: Vec<Route>,
    feeds: Vec<FeedPost>,
    shared: Arc<PumpState>,
    taken: u64,
    /// When the end was requested.
    closing: Option<Stopwatch>,
    /// Whether features are no longer computed.
    is_plain: bool,
}

impl Pipeline {
    pub(super) fn new(
        (queue, clock): (Queue, Clock),
        pace: Pace,
        pump: Pump,
        (routes, feeds): (Vec<Route>, Vec<FeedPost>),
    ) -> Pipeline {
        let (shared, taken) = (Arc::default(), 0);
        Pipeline {
            queue,
            clock,
            pace,
            pump,
            routes,
            feeds,
            shared,
            taken,
            closing: None,
            is_plain: false,
        }
    }

    /// Runs until the queue has ended and is empty.
    fn run(&mut self) -> Pumped {
        let mut items = VecDeque::new();
        let mut gathering = Gathering::begin();
        loop {
            let ended = self.queue.has_ended();
            let now = self.clock.now();
            let waits = Stopwatch::start();
            self.queue.take(&mut items, PATIENCE);
            self.note_standstill(now, waits.elapsed());
            let taken = items.len();
            let (silent, few) = (taken == 0, taken < FEW);
            let woken = Stopwatch::start();
            let mut handed = woken;
            for item in items.drain(..) {
                self.take(item);
                let waits = self.pace == Pace::Live && handed.elapsed() >= PROMPT;
                if waits || self.pump.records().len() >= BATCH {
                    self.deliver();
                    handed = Stopwatch::start();
                }
            }
            if silent && ended {
                break;
            }
            if self.pace == Pace::Live {
                while silent && self.pump.tick_towards(now) {
                    self.deliver();
                }
                self.deliver();
                let (now, waits) = (self.clock.now(), Stopwatch::start());
                std::thread::sleep(gathering.after(taken).saturating_sub(woken.elapsed()));
                self.note_standstill(now, waits.elapsed());
            } else if few {
                self.deliver();
            }
        }
        match self.pace {
            Pace::Live => self.pump.close(self.clock.now()),
            Pace::Recorded => self.pump.close_recording(),
        }
        self.deliver();
        self.deliver();
        Pumped { dropped: self.pump.dropped(), broken: self.pump.take_broken() }
    }

    /// Reports a wait that was far longer than intended: this process, or the machine, was stopped. The standstill is
    /// reported before the silence is judged.
    fn note_standstill(&mut self, since: Time, waited: Duration) {
        if self.pace != Pace::Live || waited < STANDSTILL {
            return;
        }
        self.pump.happen(stood_still(waited), since);
    }

    /// Takes the next item, or discards it if the session should have ended long ago.
    fn take(&mut self, item: Item) {
        // A long silence produces more records than should be held at once.
        while self.pump.tick_towards(self.pump.time_of(&item)) {
            self.deliver();
        }
        let overdue = self.overdue();
        if overdue >= COMPUTES || self.shared.is_hurried.load(Ordering::Acquire) {
            self.leave_out_features();
        }
        if overdue >= LAST_WORDS {
            self.pump.leave_out(item);
        } else {
            self.pump.take(item);
        }
        self.taken += 1;
        self.shared.taken.store(self.taken, Ordering::Release);
    }

    /// How long ago the end of a live session was requested; zero before that, and for a recording.
    fn overdue(&mut self) -> Duration {
        if self.pace != Pace::Live || !self.queue.is_closed() {
            return Duration::ZERO;
        }
        self.closing.get_or_insert_with(Stopwatch::start).elapsed()
    }

    /// Takes waiting readings without computing features from now on.
    fn leave_out_features(&mut self) {
        if std::mem::replace(&mut self.is_plain, true) {
            return;
        }
        self.pump.leave_out_features();
        let label = "the session was ending: the last samples are recorded, but no features were computed from them";
        self.pump.happen(lasting(label), self.clock.now());
    }

    /// Hands the records over; events about sinks go through the pump with the next batch.
    fn deliver(&mut self) {
        self.shared.is_held.store(true, Ordering::Release);
        let faults = sinks::deliver(&mut self.routes, &self.feeds, self.pump.records());
        self.shared.is_held.store(false, Ordering::Release);
        if self.pace == Pace::Live {
            for event in faults {
                self.pump.happen(event, self.clock.now());
            }
        }
    }
}
