//! A recording shown in browsers, at a position that all of them share.

pub(crate) mod timeline;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::iter::Peekable;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use std::time::Duration;

use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::sink::SinkError;
use teampulse_core::stream::{Stream, StreamId};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use crate::addresses::Addresses;
use crate::context::{Context, Settings};
use crate::convert::is_minor;
use crate::hub::{Hub, message};
use crate::pictures::{Place, has_pictures, has_video, place_of};
use crate::playhead::Playhead;
use crate::relay::{Relay, has_numbers};
use crate::sink::{FAREWELL, start};
use crate::wire::{Event, FromServer, Timeline};

/// How often the position is checked.
const LOOK: Duration = Duration::from_millis(15);
/// How far back to read to show a given time: every stream's health is recorded twice a minute.
const BEFORE: Duration = Duration::from_secs(120);
/// How far back to look for the newest picture.
const BEFORE_PICTURES: Duration = Duration::from_secs(2);
/// How far back to look for a key frame of video: first nearby, then further away.
const BEFORE_VIDEO: [Duration; 3] =
    [Duration::from_secs(2), Duration::from_secs(10), Duration::from_secs(40)];
/// The maximum number of records that are handed on at once.
const BATCH: usize = 2000;
/// The position waits if it is more than this ahead of what has been shown [s].
const BEHIND_SECS: f64 = 2.0;

/// A recording that can be read.
pub trait Recording: Send + Sync {
    /// The streams of the recording.
    fn streams(&self) -> Streams;

    /// The records of the wanted streams from a log time on, in log order.
    fn records<'a>(
        &'a self,
        from: Time,
        wants: &dyn Fn(&Stream) -> bool,
    ) -> Box<dyn Iterator<Item = Record> + 'a>;
}

/// A recording that is shown until this value is dropped.
pub struct Shown {
    hub: Arc<Hub>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    addresses: Addresses,
}

impl fmt::Debug for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shown").field("addresses", &self.addresses).finish_non_exhaustive()
    }
}

impl Shown {
    /// The addresses for browsers.
    pub fn addresses(&self) -> &Addresses {
        &self.addresses
    }

    /// The number of viewers.
    pub fn viewers(&self) -> u32 {
        self.hub.viewers()
    }

    /// Whether the replay ended by itself, which only happens after a failure.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Release);
        // A panic of the thread has already been reported.
        drop(self.thread.take().map(JoinHandle::join));
    }
}

/// Shows a recording in browsers, at the position of the playhead.
pub fn show(
    recording: Arc<dyn Recording>,
    playhead: &Playhead,
    context: Context,
    settings: Settings,
) -> Result<Shown, SinkError> {
    let context = Context { playhead: Some(playhead.clone()), ..context };
    let hub = Arc::new(Hub::new(context, settings, None));
    let is_over = Arc::new(AtomicBool::new(false));
    let (send_started, started) = sync_channel(1);
    let serving = {
        let (hub, playhead, is_over) = (Arc::clone(&hub), playhead.clone(), Arc::clone(&is_over));
        move || {
            let runtime = match start(&hub) {
                Ok((runtime, addresses)) => {
                    drop(send_started.send(Ok(addresses)));
                    runtime
                }
                Err(error) => return drop(send_started.send(Err(error))),
            };
            std::thread::scope(|scope| {
                scope.spawn(|| timeline::read(&*recording, &hub, &is_over));
                Showing::new(&hub, &playhead, &*recording).run(&is_over);
            });
            runtime.block_on(async { tokio::time::sleep(FAREWELL).await });
            runtime.shutdown_timeout(FAREWELL);
        }
    };
    let failed = |message: String| SinkError::Failed {
        message,
        hint: "close other programs, or allow more threads (`ulimit -u`)".to_owned(),
    };
    let thread = std::thread::Builder::new().name("replay".into()).spawn(serving);
    let thread = thread.map_err(|error| failed(format!("start a thread: {error}")))?;
    let gone = |_gone| failed("start its thread".to_owned());
    let addresses = started.recv().map_err(gone)??;
    Ok(Shown { hub, is_over, thread: Some(thread), addresses })
}

/// The records from a position on.
type Ahead<'a> = Peekable<Box<dyn Iterator<Item = Record> + 'a>>;

/// Returns the next record of the two in log order, if it is due.
fn due<'a>(ahead: &mut Ahead<'a>, pictures: &mut Ahead<'a>, now: Time) -> Option<Record> {
    let log_time = |record: &Record| record.sample.log_time;
    let is_picture = match (ahead.peek().map(log_time), pictures.peek().map(log_time)) {
        (Some(other), Some(picture)) => picture < other,
        (other, _) => other.is_none(),
    };
    let next = if is_picture { pictures } else { ahead };
    next.next_if(|record| record.sample.log_time <= now)
}

fn nothing<'a>() -> Ahead<'a> {
    let nothing: Box<dyn Iterator<Item = Record>> = Box::new(std::iter::empty());
    nothing.peekable()
}

/// The state of the playback as last sent.
#[derive(Clone, Copy, PartialEq)]
struct Reported {
    rate: f64,
    is_paused: bool,
    second: u64,
    is_over: bool,
}

/// Shows the records that are due.
struct Showing<'a> {
    hub: &'a Arc<Hub>,
    playhead: &'a Playhead,
    recording: &'a dyn Recording,
    relay: Relay,
    /// The records from the position on, except for pictures, which are not read as far back to show a given time.
    ahead: Ahead<'a>,
    /// The pictures from the position on.
    pictures: Ahead<'a>,
    /// The number of jumps at the last check.
    jumps: Option<u64>,
    reported: Option<Reported>,
    has_timeline: bool,
    /// Events that happened before this time are sent from the timeline, even if they were recorded later.
    known_until: Option<Time>,
}

impl<'a> Showing<'a> {
    fn new(hub: &'a Arc<Hub>, playhead: &'a Playhead, recording: &'a dyn Recording) -> Showing<'a> {
        let relay = Relay::new(Arc::clone(hub), recording.streams());
        Showing {
            hub,
            playhead,
            recording,
            relay,
            ahead: nothing(),
            pictures: nothing(),
            jumps: None,
            reported: None,
            has_timeline: false,
            known_until: None,
        }
    }

    fn run(&mut self, is_over: &AtomicBool) {
        while !is_over.load(Ordering::Acquire) {
            let jumps = self.playhead.position().jumps;
            let has_timeline = self.hub.timeline().is_some();
            if self.jumps != Some(jumps) || self.has_timeline != has_timeline {
                (self.jumps, self.has_timeline) = (Some(jumps), has_timeline);
                self.restart();
            }
            let is_behind = self.advance();
            self.relay.tick(0);
            self.report();
            if !is_behind {
                std::thread::sleep(LOOK);
            }
        }
        self.relay.end("the replay has ended");
    }

    /// Shows the state at the position.
    fn restart(&mut self) {
        let now = self.playhead.now();
        let from = now - BEFORE;
        let t = self.hub.secs(from);
        self.ahead = self.recording.records(from, &has_numbers).peekable();
        let has_any = self.recording.streams().all().iter().any(|(_, stream)| has_pictures(stream));
        self.pictures = nothing();
        if has_any {
            let from = now - BEFORE_PICTURES;
            let from_video = self.video_from(now).unwrap_or(from).min(from);
            let pictures = self.recording.records(from_video, &has_pictures);
            let is_near =
                move |record: &Record| record.sample.log_time >= from || has_video(&record.stream);
            let pictures: Box<dyn Iterator<Item = Record>> = Box::new(pictures.filter(is_near));
            self.pictures = pictures.peekable();
        }
        let timeline = self.hub.timeline();
        let events = timeline.as_deref().map_or(&[][..], |timeline: &Timeline| &timeline.events);
        let before = events.iter().filter(|event: &&Event| event.t < t);
        self.known_until = timeline.is_some().then_some(from);
        let known_until = self.known_until;
        let (ahead, pictures) = (&mut self.ahead, &mut self.pictures);
        let records = std::iter::from_fn(|| due(ahead, pictures, now))
            .filter(|record| !is_known(record, known_until));
        self.relay.restart(before, records);
    }

    /// Returns the log time from which video is read to show a moment: the earliest of the streams' last key frames
    /// before it.
    fn video_from(&self, now: Time) -> Option<Time> {
        let mut missing: BTreeSet<StreamId> = {
            let streams = self.recording.streams().all();
            streams.into_iter().filter(|(_, stream)| has_video(stream)).map(|(id, _)| id).collect()
        };
        let mut from = None::<Time>;
        let mut until = now;
        for before in BEFORE_VIDEO {
            if missing.is_empty() {
                break;
            }
            let since = now - before;
            let mut firsts = BTreeMap::new();
            let records = self.recording.records(since, &has_video);
            for record in records.take_while(|record| record.sample.log_time <= until) {
                let id = record.sample.stream;
                if missing.contains(&id) && place_of(&record) == Some(Place::First) {
                    firsts.insert(id, record.sample.log_time);
                }
            }
            missing.retain(|id| !firsts.contains_key(id));
            from = from.into_iter().chain(firsts.into_values()).min();
            until = since;
        }
        from
    }

    /// Hands on the records that are due; returns whether there are more.
    fn advance(&mut self) -> bool {
        let now = self.playhead.now();
        let mut batch = Vec::new();
        while batch.len() < BATCH {
            let Some(record) = due(&mut self.ahead, &mut self.pictures, now) else { break };
            batch.push(record);
        }
        let is_behind = batch.len() == BATCH;
        let last = batch.last().map(|record| record.sample.log_time).filter(|_| is_behind);
        batch.retain(|record| !is_known(record, self.known_until));
        if !batch.is_empty() {
            self.relay.take(&batch);
        }
        if let Some(last) = last {
            self.playhead.wait_for(last, BEHIND_SECS);
        }
        is_behind
    }

    /// Sends the state of the playback when it has changed, once a second, and at the end.
    fn report(&mut self) {
        let Some(playback) = self.hub.playback() else { return };
        let reported = Reported {
            rate: playback.rate,
            is_paused: playback.paused,
            second: playback.t as u64,
            is_over: playback.t >= playback.length,
        };
        if self.reported.replace(reported) == Some(reported) {
            return;
        }
        let text = message(&FromServer::Playback(playback));
        for client in self.hub.clients() {
            client.outbox.urgent(text.clone());
        }
    }
}

/// Whether an event was already sent with the timeline: one that was recorded long after it happened, such as the
/// annotation of a span.
fn is_known(record: &Record, known_until: Option<Time>) -> bool {
    let Data::Event(event) = &record.sample.data else { return false };
    !is_minor(event) && known_until.is_some_and(|until| record.sample.measured < until)
}
