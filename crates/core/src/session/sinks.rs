//! The running sinks of a session, each on its own thread.

use std::sync::Arc;

use tokio::sync::oneshot;

use crate::data::Event;
use crate::fault::{lasting, passing};
use crate::outlet::Outlet;
use crate::panics::{Panic, at, watched};
use crate::sample::Record;
use crate::session::Pace;
use crate::sink::queue_within;
use crate::sink::{Batch, Delivery, Gate, Limits, Post, Posted, Sink, SinkError, Wants};
use crate::stream::Audience;
use crate::streams::Streams;
use crate::worker::FeedPost;

/// The queue of a sink and the records it wants.
pub(super) struct Route {
    name: &'static str,
    post: Post,
    wants: Wants,
    /// Whether the sink receives streams that are only shown live.
    shows_live: bool,
}

/// A running sink.
pub(super) struct Running {
    pub name: &'static str,
    delivery: Delivery,
    gate: Gate,
    /// Why its thread could not be started.
    unstarted: Option<std::io::Error>,
    ended: oneshot::Receiver<Result<(), SinkError>>,
}

/// Starts a sink on its own thread; if the sink ends early, this is reported at once.
pub(super) fn start(
    sink: Box<dyn Sink>,
    streams: &Streams,
    outlet: &Outlet,
    pace: Pace,
) -> (Route, Running) {
    let (name, delivery) = (sink.name(), sink.delivery());
    let (wants, shows_live) = (sink.wants(), sink.shows_live());
    let mut limits = Limits::live(delivery);
    if pace == Pace::Recorded {
        // A recording can wait.
        limits.patience = None;
    }
    let (post, inbox) = queue_within(delivery, streams.clone(), limits);
    let (inbox, outlet, gate) = (inbox.reporting_to(outlet.clone()), outlet.clone(), post.gate());
    let (send_end, ended) = oneshot::channel();
    let work = move || {
        let ended = watched(|| sink.run(inbox));
        let ended = ended.unwrap_or_else(|panic| Err(panicked(delivery, &panic)));
        if let Err(error) = &ended {
            outlet.happen(lasting(format!("{name}: failed to {error}")));
        }
        // Nobody waits for a sink that was abandoned.
        drop(send_end.send(ended));
    };
    let thread = std::thread::Builder::new().name(name.into());
    let unstarted = thread.spawn(work).err();
    (Route { name, post, wants, shows_live }, Running { name, delivery, gate, unstarted, ended })
}

fn panicked(delivery: Delivery, panic: &Panic) -> SinkError {
    let message = format!("continue: it panicked: {panic}");
    let hint = format!("this is a bug in teampulse{}; please report it", at(panic));
    match delivery {
        Delivery::Lossless => SinkError::Lost { message, hint },
        Delivery::Fresh => SinkError::Failed { message, hint },
    }
}

impl Route {
    /// Ends the queue, for a reason that fits after "failed to".
    pub(super) fn break_off(&self, reason: &str) {
        self.post.gate().break_off(reason);
    }
}

impl Running {
    /// Marks that nothing more will arrive, for a reason that fits after "failed to".
    pub(super) fn break_off(&self, reason: &str) {
        self.gate.break_off(reason);
    }

    /// Waits until it has ended. A lossless sink that did not get everything has lost data even if it reports no error.
    pub(super) async fn ended(&mut self) -> Result<(), SinkError> {
        let ended = match (&mut self.ended).await {
            Ok(ended) => ended,
            Err(_) => Err(self.never_ran()),
        };
        match (ended, self.gate.cut_off()) {
            (Ok(()), Some(message)) if self.delivery == Delivery::Lossless => {
                Err(SinkError::Lost { message, hint: String::new() })
            }
            (ended, _) => ended,
        }
    }

    fn never_ran(&mut self) -> SinkError {
        let why = self.unstarted.take().map_or_else(String::new, |error| format!(": {error}"));
        let hint = "close other programs, or raise the limit on threads (`ulimit -u`)".to_owned();
        SinkError::Failed { message: format!("start its thread{why}"), hint }
    }
}

/// Hands records to each sink that wants them; a sink that has ended is skipped from then on. Returns
/// events about sinks that do not keep up.
pub(super) fn deliver(
    routes: &mut Vec<Route>,
    feeds: &[FeedPost],
    records: &mut Vec<Record>,
) -> Vec<Event> {
    let mut faults = Vec::new();
    if records.is_empty() {
        return faults;
    }
    let all: Batch = records.drain(..).collect();
    for feed in feeds {
        feed.offer(&all);
    }
    let to_show = for_audiences(&all, Audience::Live);
    let to_keep = for_audiences(&to_show, Audience::Everybody);
    routes.retain(|route| {
        let offered = if route.shows_live { &to_show } else { &to_keep };
        let batch = match &route.wants {
            Wants::Everything => Arc::clone(offered),
            Wants::Only(wanted) => {
                offered.iter().filter(|record| wanted(&record.stream)).cloned().collect()
            }
        };
        if batch.is_empty() {
            return true;
        }
        let posted = route.post.deliver(&batch);
        faults.extend(said(route.name, &posted));
        posted != Posted::Ended
    });
    faults
}

/// The records of streams whose audience includes at least `least`.
fn for_audiences(records: &Batch, least: Audience) -> Batch {
    if records.iter().all(|record| record.stream.audience >= least) {
        return Arc::clone(records);
    }
    records.iter().filter(|record| record.stream.audience >= least).cloned().collect()
}

/// The event that reports a delivery; `None` if there is nothing to report.
fn said(name: &str, posted: &Posted) -> Option<Event> {
    match posted {
        Posted::Stalled { waiting_bytes } => {
            let kib = waiting_bytes >> 10;
            Some(passing(format!("{name}: stalled; {kib} KiB are waiting in memory")))
        }
        Posted::Recovered => Some(passing(format!("{name}: no longer stalled; nothing was lost"))),
        Posted::CutOff { reason } => Some(lasting(format!("{name}: failed to {reason}"))),
        Posted::Accepted | Posted::Skipped | Posted::Ended => None,
    }
}
