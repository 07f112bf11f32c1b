//! The running workers of a session, each on its own thread: a worker that fails is restarted, and a worker that panics
//! is dropped.

use std::time::Duration;

use tokio::sync::oneshot;

use crate::clock::Stopwatch;
use crate::commands::Commands;
use crate::fault::{lasting, passing, with_hint};
use crate::outlet::Outlet;
use crate::panics::{at, watched};
use crate::streams::Streams;
use crate::worker::{Feed, FeedPost, Worker, WorkerCounts, WorkerError, queue};

/// The pauses before a worker is run again double from the first to the last.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LAST_PAUSE: Duration = Duration::from_secs(5);
/// After a worker has run for this long, its pauses start from the first one again.
const WELL: Duration = Duration::from_secs(30);

/// How a worker ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerEnd {
    /// The worker's name.
    pub name: String,
    /// How many records the worker has taken and skipped.
    pub counts: WorkerCounts,
    /// Why the worker ended before the session did, or never processed anything.
    pub error: Option<WorkerError>,
}

/// A running worker.
pub(super) struct Running {
    name: String,
    feed: Feed,
    ended: oneshot::Receiver<Option<WorkerError>>,
}

/// Starts a worker on its own thread.
pub(super) fn start(
    name: String,
    worker: Box<dyn Worker>,
    streams: &Streams,
    commands: &Commands,
    outlet: Outlet,
) -> (FeedPost, Running) {
    let (post, feed) = queue(&*worker, streams.clone());
    commands.carried_out_by_worker(worker.carries_out(), feed.clone());
    let (send_end, ended) = oneshot::channel();
    let (known, fed) = (name.clone(), feed.clone());
    let work = move || drop(send_end.send(mind(&known, worker, &fed, &outlet)));
    let thread = std::thread::Builder::new().name("worker".into());
    // Without a thread the sender is dropped, which ends the worker.
    drop(thread.spawn(work));
    (post, Running { name, feed, ended })
}

/// Runs a worker until the session is over, and restarts it after a pause whenever it fails.
fn mind(
    name: &str,
    mut worker: Box<dyn Worker>,
    feed: &Feed,
    outlet: &Outlet,
) -> Option<WorkerError> {
    let mut pause = FIRST_PAUSE;
    // A worker that has processed nothing by the end of the session reports its last error.
    let mut last: Option<WorkerError> = None;
    let idle = |last: Option<WorkerError>| last.filter(|_| feed.counts().taken == 0);
    loop {
        let began = Stopwatch::start();
        let run = watched(|| worker.run(feed, outlet));
        if !matches!(run, Ok(Ok(()))) {
            feed.failed();
        }
        match run {
            Ok(Ok(())) => return idle(last),
            Ok(Err(error)) if feed.is_closed() => return idle(last.map(|_| error)),
            Ok(Err(error)) => {
                if began.elapsed() >= WELL {
                    pause = FIRST_PAUSE;
                }
                let WorkerError { message, hint } = &error;
                tracing::debug!("{name} restarts in {pause:?}");
                outlet.happen(passing(with_hint(format!("{name}: failed to {message}"), hint)));
                last = Some(error);
            }
            Err(panic) => {
                let message = format!("continue: it panicked: {panic}");
                outlet.happen(lasting(format!("{name}: failed to {message}")));
                let hint = format!("this is a bug in teampulse{}; please report it", at(&panic));
                return Some(WorkerError { message, hint });
            }
        }
        if feed.closes_within(pause) {
            return idle(last);
        }
        pause = (pause * 2).min(LAST_PAUSE);
    }
}

impl Running {
    /// Closes the feed at the end of the session: the worker stops after its current records.
    pub(super) fn close(&self) {
        self.feed.close();
    }

    /// Waits until it has ended.
    pub(super) async fn ended(&mut self) -> WorkerEnd {
        let no_thread = |_| {
            let message = "start its thread".to_owned();
            let hint = "close other programs, or allow more threads (`ulimit -u`)".to_owned();
            Some(WorkerError { message, hint })
        };
        let error = (&mut self.ended).await.unwrap_or_else(no_thread);
        WorkerEnd { name: self.name.clone(), counts: self.feed.counts(), error }
    }

    /// Abandons a worker that does not stop.
    pub(super) fn abandon(&self) -> WorkerEnd {
        let message = "stop in time: it was still busy at the end of the session".to_owned();
        let error = Some(WorkerError { message, hint: String::new() });
        WorkerEnd { name: self.name.clone(), counts: self.feed.counts(), error }
    }
}
