//! A session: sources, features and sinks running together, and their supervisor.
//!
//! A panic of a component is caught: only that component is dropped, and is named in an event and in the [`Outcome`];
//! the others go on.

mod sources;
mod pumping;
mod gathering;
mod sinks;
mod workers;

use std::future::{Future, pending};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use crate::clock::{Clock, Stopwatch};
use crate::clocks::Clocks;
use crate::commands::{CommandSettings, Commands};
use crate::data::{Event, EventKind};
use crate::fault::lasting;
use crate::outlet::{Outlet, Queue};
use crate::panics::{Panic, at, strays_after};
use crate::pump::{Encode, Pump};
use crate::session_streams::session_events;
use crate::sink::{Sink, SinkError};
use crate::source::{Source, SourceError};
use crate::streams::Streams;
use crate::worker::Worker;
use pumping::{Pipeline, Pumping};
use sources::Sources;

pub use crate::extractors::{Broken, NamedFeature};
pub use workers::WorkerEnd;

/// The smallest step of the wall clock that is reported.
const WALL_STEP_NANOS: i64 = 500_000_000;
/// How long sources may take to end once they are asked to stop.
const SOURCES_PATIENCE: Duration = Duration::from_secs(5);
/// How long a sink may take to end after the end was requested twice.
const HURRIED: Duration = Duration::from_secs(5);
/// The interval at which a wait checks whether it is over.
const LOOK: Duration = Duration::from_millis(20);

/// The parts of a session.
pub struct Session {
    /// The session's clock.
    pub clock: Clock,
    /// How time passes.
    pub pace: Pace,
    /// How the times of samples are corrected.
    pub clocks: Clocks,
    /// The streams, initially empty.
    pub streams: Streams,
    /// The sources, each with its name in messages.
    pub sources: Vec<(String, Box<dyn Source>)>,
    /// The features, each with its name, in the order in which they receive a sample.
    pub features: Vec<NamedFeature>,
    /// The sinks.
    pub sinks: Vec<Box<dyn Sink>>,
    /// The workers, each with its name in messages.
    pub workers: Vec<(String, Box<dyn Worker>)>,
    /// Converts samples to ROS messages.
    pub encode: Encode,
    /// The session's commands, and who may send them.
    pub commands: Commands,
}

/// How time passes in a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Time follows the session's clock: ticks continue while no data arrive.
    Live,
    /// Time follows the times of a recording, as fast as it can be read.
    Recorded,
}

/// How a session went.
#[derive(Debug, Default)]
pub struct Outcome {
    /// The sources that gave up, with the reason.
    pub sources: Vec<(String, SourceError)>,
    /// The sources whose device could not be opened during the whole session, with the last reason.
    pub unopened: Vec<(String, SourceError)>,
    /// The sinks that ended early, with the reason.
    pub sinks: Vec<(&'static str, SinkError)>,
    /// How many readings were dropped in our own queue.
    pub dropped: u64,
    /// How the workers ended.
    pub workers: Vec<WorkerEnd>,
    /// The features that panicked, and were disabled from then on.
    pub features: Vec<Broken>,
    /// Why the pump, and with it the session, ended early.
    pub pump: Option<Panic>,
    /// Panics outside of any component.
    pub strays: Vec<Panic>,
    /// Work that was not finished because the end was requested twice, or took too long.
    pub undone: Vec<String>,
}

impl Session {
    /// A session over a recording, without commands, and initially without features and sinks.
    pub fn of_recording(source: impl Source + 'static, clocks: Clocks, encode: Encode) -> Session {
        Session {
            clock: Clock::settable(),
            pace: Pace::Recorded,
            clocks,
            streams: Streams::default(),
            sources: vec![("bag".into(), Box::new(source))],
            features: Vec::new(),
            sinks: Vec::new(),
            workers: Vec::new(),
            encode,
            commands: Commands::new(CommandSettings::nobody()),
        }
    }

    /// Runs until all sources have ended, one of them fails for good, or `stop` resolves.
    pub async fn run(self, stop: impl Future<Output = ()>) -> Outcome {
        self.run_until(stop, pending()).await
    }

    /// Runs like [`run`](Session::run); once `hurry` has also resolved, sinks get only a few seconds to finish.
    pub async fn run_until(
        self,
        stop: impl Future<Output = ()>,
        hurry: impl Future<Output = ()>,
    ) -> Outcome {
        let queue = Queue::with_commands(self.commands.clone());
        let outlet = || queue.outlet(self.clock.clone(), self.streams.clone());
        if self.pace == Pace::Live {
            // The first record: a recording begins with its session, even if devices appear later.
            outlet().declare(session_events());
        }
        let mut sources = Sources::default();
        for (name, source) in self.sources {
            sources.start(name, source, outlet());
        }
        let strays = strays_after(0).len();
        let reported = Arc::new(AtomicUsize::new(strays));
        let watch = tokio::spawn(watch(outlet(), self.pace, Arc::clone(&reported)));
        let last_words = outlet();
        for sink in &self.sinks {
            self.commands.carried_out_by_events(sink.carries_out());
        }
        let started = self.sinks.into_iter();
        let started = started.map(|sink| sinks::start(sink, &self.streams, &outlet(), self.pace));
        let (routes, mut running): (Vec<_>, Vec<_>) = started.unzip();
        let started = self.workers.into_iter();
        let started = started.map(|(name, worker)| {
            workers::start(name, worker, &self.streams, &self.commands, outlet())
        });
        let (feeds, at_work): (Vec<_>, Vec<_>) = started.unzip();
        let pump = Pump::new(self.streams, self.clocks, self.features, self.encode);
        let pump = if self.pace == Pace::Recorded { pump.over_recording() } else { pump };
        let pipeline = Pipeline::new((queue.clone(), self.clock), self.pace, pump, (routes, feeds));
        let mut pump = Pumping::start(pipeline);

        let mut outcome = Outcome::default();
        let mut hurry = Once { future: pin!(hurry), is_done: false };
        tokio::select! {
            () = stop => {}
            () = self.commands.stopped() => {}
            () = sources.all_ended(&mut outcome) => {}
            () = pump.ended() => {}
        }
        queue.close();
        at_work.iter().for_each(workers::Running::close);
        let closed = Stopwatch::start();
        end_sources(&mut sources, &mut hurry, &mut outcome).await;
        let left = SOURCES_PATIENCE.saturating_sub(closed.elapsed());
        outcome.workers = end_workers(at_work, left, &mut hurry).await;
        watch.abort();
        drop(watch.await);
        if self.pace == Pace::Live {
            report_strays(&last_words, &reported);
        }
        queue.end();
        pump.finish(&mut hurry, &running, &mut outcome).await;
        end_sinks(&mut running, &mut hurry, &mut outcome).await;
        outcome.strays = strays_after(strays);
        outcome
    }
}

/// Waits for all sources to end; those that take too long are abandoned.
async fn end_sources(
    sources: &mut Sources,
    hurry: &mut Once<'_, impl Future<Output = ()>>,
    outcome: &mut Outcome,
) {
    let mut patience = pin!(passed(SOURCES_PATIENCE));
    while !sources.is_empty() {
        let waits = tokio::select! {
            () = sources.all_ended(outcome) => true,
            () = &mut patience => false,
            () = hurry.done() => false,
        };
        if !waits {
            let left = sources.abandon().into_iter();
            outcome.undone.extend(left.map(|name| format!("{name}: it did not stop")));
            break;
        }
    }
}

/// Waits for all workers to end; those that take longer than `patience` together are abandoned.
async fn end_workers(
    running: Vec<workers::Running>,
    patience: Duration,
    hurry: &mut Once<'_, impl Future<Output = ()>>,
) -> Vec<WorkerEnd> {
    let began = Stopwatch::start();
    let mut ends = Vec::new();
    for mut worker in running {
        ends.push(tokio::select! {
            biased;
            ended = worker.ended() => ended,
            () = passed(patience.saturating_sub(began.elapsed())) => worker.abandon(),
            () = hurry.done() => worker.abandon(),
        });
    }
    ends
}

/// Waits for all sinks; only a few seconds once `hurry` has resolved.
async fn end_sinks(
    running: &mut [sinks::Running],
    hurry: &mut Once<'_, impl Future<Output = ()>>,
    outcome: &mut Outcome,
) {
    let mut deadline = None;
    for sink in running {
        let late = || SinkError::Lost {
            message: "end in time: it is still writing, and was abandoned".into(),
            hint: "check the disk; `teampulse recover` repairs a bag".into(),
        };
        let ended = loop {
            let Some(hurried) = &deadline else {
                tokio::select! {
                    ended = sink.ended() => break ended,
                    () = hurry.done() => {
                        sink.break_off("wait for its disk");
                        deadline = Some(Stopwatch::start());
                    }
                }
                continue;
            };
            let left = HURRIED.saturating_sub(Stopwatch::elapsed(hurried));
            tokio::select! {
                biased;
                ended = sink.ended() => break ended,
                () = passed(left) => break Err(late()),
            }
        };
        if let Err(error) = ended {
            outcome.sinks.push((sink.name, error));
        }
    }
}

/// A future that stays resolved.
struct Once<'a, F> {
    future: Pin<&'a mut F>,
    is_done: bool,
}

impl<F: Future<Output = ()>> Once<'_, F> {
    async fn done(&mut self) {
        if !self.is_done {
            self.future.as_mut().await;
            self.is_done = true;
        }
    }
}

/// Resolves after this much real time, even if a test pauses the runtime's clock.
async fn passed(duration: Duration) {
    let began = Stopwatch::start();
    while began.elapsed() < duration {
        tokio::time::sleep(LOOK.min(duration)).await;
    }
}

/// Reports panics that no component caught, each once.
fn report_strays(outlet: &Outlet, reported: &AtomicUsize) {
    for panic in strays_after(reported.load(Ordering::Acquire)) {
        reported.fetch_add(1, Ordering::AcqRel);
        outlet.happen(lasting(format!("a part of teampulse panicked: {panic}{}", at(&panic))));
    }
}

/// Reports steps of the machine's wall clock, which the session's clock does not follow, and panics that no component
/// caught.
async fn watch(outlet: Outlet, pace: Pace, reported: Arc<AtomicUsize>) {
    if pace == Pace::Recorded {
        return;
    }
    let mut known_nanos = 0;
    loop {
        tokio::time::sleep(Duration::from_secs(1)).await;
        report_strays(&outlet, &reported);
        let offset_nanos = outlet.clock().wall_offset_nanos();
        let step_nanos = offset_nanos - known_nanos;
        if step_nanos.abs() > WALL_STEP_NANOS {
            known_nanos = offset_nanos;
            let value = step_nanos as f64 / 1e9;
            tracing::warn!("the machine's wall clock stepped by {value:+.3} s");
            let (kind, label) = (EventKind::Clock, "wall clock step".to_owned());
            outlet.happen(Event { kind, label, value, duration_secs: 0.0 });
        }
    }
}
