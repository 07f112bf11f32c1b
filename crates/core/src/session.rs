//! A session: sources, features and sinks running together, and the supervisor that minds them.

use std::collections::VecDeque;
use std::future::Future;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::task::JoinSet;

use crate::clock::{Clock, Stopwatch};
use crate::clocks::Clocks;
use crate::data::{Data, Event, EventKind};
use crate::feature::Feature;
use crate::outlet::{Outlet, Queue};
use crate::pump::{Encode, Pump, session_events};
use crate::sample::Record;
use crate::sink::{self, Post, Posted, Sink, SinkError};
use crate::source::{Reading, Source, SourceError};
use crate::streams::Streams;

/// How long the pump waits for readings before it looks at the clock.
const PATIENCE: Duration = Duration::from_millis(20);
/// How long after it woke a live pump wakes again at the soonest, while readings gather: it wakes, and
/// wakes its sinks, a few hundred times a second, whatever the rate of messages.
const GATHER: Duration = Duration::from_millis(4);
/// How many records make a batch at most.
const BATCH: usize = 1024;
/// How long a live pump computes before it hands over what it has: the features of one sensor don't
/// wait for those of all others.
const PROMPT: Duration = Duration::from_millis(1);
/// A recording that comes in smaller portions than this is played in time: nothing is held back.
const FEW: usize = 64;
/// The pauses before a source is run again double from the first to the last.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LAST_PAUSE: Duration = Duration::from_secs(30);
/// How far the wall clock must step to be told.
const WALL_STEP_NANOS: i64 = 500_000_000;

/// What a session is made of.
pub struct Session {
    /// What the time is.
    pub clock: Clock,
    /// How time passes.
    pub pace: Pace,
    /// How samples get their place in time.
    pub clocks: Clocks,
    /// The streams, to be filled.
    pub streams: Streams,
    /// The sources, each with the name it has in messages.
    pub sources: Vec<(String, Box<dyn Source>)>,
    /// The features, in the order in which they hear a sample.
    pub features: Vec<Arc<dyn Feature>>,
    /// The sinks.
    pub sinks: Vec<Box<dyn Sink>>,
    /// How samples become ROS messages.
    pub encode: Encode,
}

/// How time passes in a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// By the session's clock: ticks fire in silence too.
    Live,
    /// By what a recording says: as fast as it can be read.
    Recorded,
}

/// How a session went.
#[derive(Debug, Default)]
pub struct Outcome {
    /// The sources that gave up, with why.
    pub sources: Vec<(String, SourceError)>,
    /// The sinks that ended early, with why.
    pub sinks: Vec<(&'static str, SinkError)>,
    /// How many readings were dropped in our own queue.
    pub dropped: u64,
}

impl Session {
    /// Runs until all sources have ended, one of them says that there is no use in going on, or
    /// `stop` resolves.
    pub async fn run(self, stop: impl Future<Output = ()>) -> Outcome {
        let queue = Queue::new();
        let outlet = || queue.outlet(self.clock.clone(), self.streams.clone());
        let mut sources = JoinSet::new();
        for (name, source) in self.sources {
            sources.spawn(mind(name, source, outlet()));
        }
        let watch = tokio::spawn(watch_wall_clock(outlet(), self.pace));
        let (posts, sinks) = start_sinks(self.sinks, &self.streams, &outlet());
        let pump = Pump::new(self.streams, self.clocks, self.features, self.encode);
        let line = Line { queue: queue.clone(), clock: self.clock, pace: self.pace, pump, posts };
        let pump = std::thread::spawn(move || line.run());

        let mut outcome = Outcome::default();
        tokio::select! {
            () = stop => {}
            () = all_ended(&mut sources, &mut outcome) => {}
        }
        queue.close();
        while !sources.is_empty() {
            all_ended(&mut sources, &mut outcome).await;
        }
        queue.end();
        watch.abort();
        outcome.dropped = join(pump).await;
        for (name, sink) in sinks {
            if let Err(error) = join(sink).await {
                outcome.sinks.push((name, error));
            }
        }
        outcome
    }
}

/// Waits until every source has ended, or one of them has failed for good.
async fn all_ended(
    sources: &mut JoinSet<Result<(), (String, SourceError)>>,
    outcome: &mut Outcome,
) {
    while let Some(ended) = sources.join_next().await {
        match ended {
            Ok(Ok(())) => {}
            Ok(Err(failed)) => {
                outcome.sources.push(failed);
                return;
            }
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        }
    }
}

/// Runs a source, and runs it again after a pause whenever its device went away.
async fn mind(
    name: String,
    mut source: Box<dyn Source>,
    outlet: Outlet,
) -> Result<(), (String, SourceError)> {
    let mut pause = FIRST_PAUSE;
    loop {
        match source.run(&outlet).await {
            Ok(()) => return Ok(()),
            Err(_) if outlet.is_closed() => return Ok(()),
            Err(SourceError::Gone { message, hint }) => {
                tracing::warn!(%name, %hint, "failed to {message}; trying again in {pause:?}");
                tell(&outlet, EventKind::Fault, format!("{name}: failed to {message}"), f64::NAN);
            }
            Err(fatal) => return Err((name, fatal)),
        }
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = outlet.closed() => return Ok(()),
        }
        pause = (pause * 2).min(LAST_PAUSE);
    }
}

/// Tells when the machine's wall clock steps; the session's clock goes on as it was.
async fn watch_wall_clock(outlet: Outlet, pace: Pace) {
    if pace == Pace::Recorded || outlet.clock().is_told() {
        return;
    }
    let mut known_nanos = 0;
    loop {
        tokio::time::sleep(Duration::from_secs(1)).await;
        let offset_nanos = outlet.clock().wall_offset_nanos();
        let step_nanos = offset_nanos - known_nanos;
        if step_nanos.abs() > WALL_STEP_NANOS {
            known_nanos = offset_nanos;
            let step_secs = step_nanos as f64 / 1e9;
            tracing::warn!("the machine's wall clock stepped by {step_secs:+.3} s");
            tell(&outlet, EventKind::Clock, "wall clock step".into(), step_secs);
        }
    }
}

/// Hands over an event of the session.
fn tell(outlet: &Outlet, kind: EventKind, label: String, value: f64) {
    let stream = outlet.declare(session_events());
    let data = Data::Event(Arc::new(Event { kind, label, value, duration_secs: 0.0 }));
    outlet.offer(Reading { stream, device_time: None, source_time: None, data });
}

type Running = (&'static str, JoinHandle<Result<(), SinkError>>);

/// Starts each sink on a thread of its own; one that ends early says so at once.
fn start_sinks(
    sinks: Vec<Box<dyn Sink>>,
    streams: &Streams,
    outlet: &Outlet,
) -> (Vec<Way>, Vec<Running>) {
    let start = |sink: Box<dyn Sink>| {
        let (name, wants) = (sink.name(), sink.wants());
        let (post, inbox) = sink::queue(sink.delivery(), streams.clone());
        let outlet = outlet.clone();
        let work = move || {
            let ended = sink.run(inbox);
            if let Err(error) = &ended {
                tell(&outlet, EventKind::Fault, format!("{name}: failed to {error}"), f64::NAN);
            }
            ended
        };
        let thread = std::thread::Builder::new().name(name.into());
        (Way { post, wants }, (name, thread.spawn(work).expect("the system can start a thread")))
    };
    sinks.into_iter().map(start).unzip()
}

/// Waits for a thread without holding up the runtime; a panic of the thread goes on here.
async fn join<T: Send + 'static>(thread: JoinHandle<T>) -> T {
    let joined = tokio::task::spawn_blocking(move || thread.join()).await;
    match joined.expect("a blocking task is not cancelled") {
        Ok(value) => value,
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// The way to a sink, and what it wants.
struct Way {
    post: Post,
    wants: sink::Wants,
}

/// The pump on its thread, with its queue before it and its sinks behind it.
struct Line {
    queue: Queue,
    clock: Clock,
    pace: Pace,
    pump: Pump,
    posts: Vec<Way>,
}

impl Line {
    /// Runs until the queue has ended and is empty; gives how many readings were dropped.
    fn run(mut self) -> u64 {
        let mut items = VecDeque::new();
        loop {
            let ended = self.queue.has_ended();
            let now = self.clock.now();
            self.queue.take(&mut items, PATIENCE);
            let (silent, few) = (items.is_empty(), items.len() < FEW);
            let woken = Stopwatch::start();
            let mut handed = woken;
            for item in items.drain(..) {
                self.pump.take(item);
                let waits = self.pace == Pace::Live && handed.elapsed() >= PROMPT;
                if waits || self.pump.records().len() >= BATCH {
                    deliver(&mut self.posts, self.pump.records());
                    handed = Stopwatch::start();
                }
            }
            if silent && ended {
                break;
            }
            if self.pace == Pace::Live {
                if silent {
                    self.pump.tick_until(now);
                }
                deliver(&mut self.posts, self.pump.records());
                std::thread::sleep(GATHER.saturating_sub(woken.elapsed()));
            } else if few {
                deliver(&mut self.posts, self.pump.records());
            }
        }
        if self.pace == Pace::Live {
            self.pump.close(self.clock.now());
        }
        deliver(&mut self.posts, self.pump.records());
        self.pump.dropped()
    }
}

/// Hands what the pump has to each sink that wants it; a sink that has ended is left out from then
/// on.
fn deliver(posts: &mut Vec<Way>, records: &mut Vec<Record>) {
    if records.is_empty() {
        return;
    }
    let all: sink::Batch = records.drain(..).collect();
    posts.retain(|way| {
        let batch = match &way.wants {
            sink::Wants::Everything => Arc::clone(&all),
            sink::Wants::Only(wanted) => {
                all.iter().filter(|record| wanted(&record.stream)).cloned().collect()
            }
        };
        batch.is_empty() || way.post.deliver(&batch) == Posted::Accepted
    });
}
