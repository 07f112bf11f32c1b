//! The state shared by the sink's thread and the clients.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_core::data::EventKind;
use teampulse_core::outlet::Outlet;
use teampulse_core::stream::{Stream as Declared, StreamId};
use teampulse_core::time::Time;

use crate::cameras::Cameras;
use crate::client::Client;
use crate::context::{Context, Settings};
use crate::history::Track;
use crate::outbox::Fragment;
use crate::playhead::Playhead;
use crate::recent::Recent;
use crate::wire::{self, FromServer, Playback, Recording, Timeline, Unmet};

/// The maximum number of events of the session, and of events of bodies, that are kept for clients that join later.
const MOST_EVENTS: usize = 4000;
/// The memory for all stored columns [bytes]; streams that exceed it have no history.
const HISTORY_BYTES: usize = 64 << 20;
/// The maximum number of actions whose echo is awaited.
const MOST_AWAITED: usize = 1000;

/// The state shared by the sink's thread and the clients. No lock is held while anything is sent.
#[derive(Debug)]
pub struct Hub {
    /// The session.
    pub context: Context,
    /// The settings.
    pub settings: Settings,
    /// The outlet into the session; `None` if there is no live session.
    pub outlet: Option<Outlet>,
    began: Time,
    known: Mutex<Known>,
    clients: Mutex<Vec<Arc<Client>>>,
    awaited: Mutex<VecDeque<Awaited>>,
    timeline: Mutex<Option<Arc<Timeline>>>,
    acts: AtomicU64,
    cut_off: AtomicU64,
}

/// An action of a client that has not been read back yet.
#[derive(Debug)]
pub struct Awaited {
    /// The number of the client.
    pub client: u64,
    /// The reference that the client gave the action.
    pub reference: String,
    /// The kind of the action's event.
    pub kind: EventKind,
    /// The time of the action.
    pub at: Time,
    /// Whether the client gave the time.
    pub is_timed: bool,
}

/// What is known about the session.
#[derive(Debug, Default)]
pub struct Known {
    /// The streams of the session, by number.
    pub streams: BTreeMap<u32, Arc<Declared>>,
    /// The numbers of the streams, by topic; the key of a second type on a topic has the type appended.
    pub named: BTreeMap<String, u32>,
    /// The streams that are hidden from viewers who must stay blind.
    pub hidden: BTreeSet<u32>,
    /// The newest health of each stream.
    pub health: BTreeMap<u32, wire::StreamHealth>,
    /// The time of the newest health [s].
    pub health_t: f64,
    /// The newest values of each feature.
    pub features: BTreeMap<u32, Arc<wire::Feature>>,
    /// The newest reading of each other stream.
    pub samples: BTreeMap<u32, Arc<wire::Sample>>,
    /// The events of the session and the team, and the events of bodies; the oldest first.
    pub events: [VecDeque<(u32, Fragment)>; 2],
    /// The columns of each stream.
    pub tracks: BTreeMap<u32, Track>,
    /// The last half minute of each wave.
    pub recent: Recent,
    /// The newest pictures of each camera.
    pub cameras: Cameras,
    /// The state of the recording when it was last checked.
    pub recording: Option<Recording>,
    /// The unmet requirements of the study; `None` until they are checked.
    pub unmet: Option<Vec<Unmet>>,
    /// The number of records that the sink skipped.
    pub skipped: u64,
    tracked_bytes: usize,
}

impl Known {
    /// Keeps an event for clients that join later.
    pub fn keep(&mut self, is_minor: bool, stream: u32, event: Fragment) {
        let kept = &mut self.events[usize::from(is_minor)];
        kept.push_back((stream, event));
        if kept.len() > MOST_EVENTS {
            kept.pop_front();
        }
    }

    /// Forgets all data and events, to show another time of a recording.
    pub fn forget(&mut self) {
        *self = Known {
            streams: std::mem::take(&mut self.streams),
            named: std::mem::take(&mut self.named),
            hidden: std::mem::take(&mut self.hidden),
            recording: self.recording.take(),
            ..Known::default()
        };
    }

    /// Returns the track of a stream, creating it if necessary; `None` if the stream has no channels or the memory is
    /// used up.
    pub fn track(&mut self, stream: u32, is_wave: bool, channels: usize) -> Option<&mut Track> {
        if !self.tracks.contains_key(&stream) {
            let track = Track::new(is_wave, channels);
            if channels == 0 || self.tracked_bytes + track.held_bytes() > HISTORY_BYTES {
                return None;
            }
            self.tracked_bytes += track.held_bytes();
            self.tracks.insert(stream, track);
        }
        self.tracks.get_mut(&stream)
    }

    /// Returns a stream as it is declared to a viewer, who may be blind.
    pub fn stream(&self, id: u32, is_blind: bool) -> Option<wire::Stream> {
        let hidden = is_blind && self.hidden.contains(&id);
        Some(wire::Stream::of(StreamId(id), self.streams.get(&id)?, hidden))
    }

    /// Returns the declarations of these streams for a viewer, who may be blind.
    pub fn declared(&self, ids: impl IntoIterator<Item = u32>, is_blind: bool) -> FromServer {
        let streams = ids.into_iter().filter_map(|id| self.stream(id, is_blind)).collect();
        FromServer::Streams(wire::Declared::of(streams, |name| self.named.get(name).copied()))
    }

    /// Whether a viewer, who may be blind, sees a stream.
    pub fn shows(&self, id: u32, is_blind: bool) -> bool {
        !(is_blind && self.hidden.contains(&id))
    }
}

impl Hub {
    /// A hub whose session begins now, or at the start of the recording.
    pub fn new(context: Context, settings: Settings, outlet: Option<Outlet>) -> Hub {
        let began = context.playhead.as_ref().map_or_else(|| context.clock.now(), Playhead::first);
        Hub {
            context,
            settings,
            outlet,
            began,
            known: Mutex::default(),
            clients: Mutex::default(),
            awaited: Mutex::default(),
            timeline: Mutex::default(),
            acts: AtomicU64::new(0),
            cut_off: AtomicU64::new(0),
        }
    }

    /// Locks the known state of the session.
    pub fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// When the session began.
    pub fn began(&self) -> Time {
        self.began
    }

    /// The time since the session began [s].
    pub fn secs(&self, at: Time) -> f64 {
        at.secs_since(self.began)
    }

    /// The current time since the session began [s].
    pub fn now(&self) -> f64 {
        let playhead = self.context.playhead.as_ref();
        self.secs(playhead.map_or_else(|| self.context.clock.now(), Playhead::now))
    }

    /// The position in the recording that is shown; `None` for a live session.
    pub fn playback(&self) -> Option<Playback> {
        let playhead = self.context.playhead.as_ref()?;
        let position = playhead.position();
        Some(Playback {
            t: self.secs(playhead.now()),
            rate: position.rate,
            paused: position.is_paused,
            length: self.secs(playhead.last()),
        })
    }

    /// The events of the whole recording, once they are read.
    pub fn timeline(&self) -> Option<Arc<Timeline>> {
        self.timeline.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Keeps the events of the whole recording.
    pub fn keep_timeline(&self, timeline: Timeline) {
        let mut kept = self.timeline.lock().unwrap_or_else(PoisonError::into_inner);
        *kept = Some(Arc::new(timeline));
    }

    /// Returns the time of an action, given in seconds since the session began; now by default. It is made unique by
    /// shifts of less than a microsecond, so that the action can be found among the session's events.
    pub fn moment(&self, at: Option<f64>) -> Time {
        let at =
            at.map(|secs| Time::from_nanos(self.began.nanos().saturating_add((secs * 1e9) as i64)));
        let at = at.unwrap_or_else(|| self.context.clock.now());
        let number = self.acts.fetch_add(1, Ordering::Relaxed) % 1000;
        Time::from_nanos(
            at.nanos().saturating_sub(at.nanos().rem_euclid(1000)).saturating_add(number as i64),
        )
    }

    /// Waits for the event of an action; beyond a thousand, the oldest is no longer awaited.
    pub fn expect(&self, awaited: Awaited) {
        let mut waiting = self.awaited.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.len() == MOST_AWAITED {
            waiting.pop_front();
        }
        waiting.push_back(awaited);
    }

    /// Removes and returns the awaited action that an event of the session records.
    pub fn take_awaited(&self, kind: EventKind, at: Time) -> Option<Awaited> {
        let mut waiting = self.awaited.lock().unwrap_or_else(PoisonError::into_inner);
        let place = waiting.iter().position(|each| each.kind == kind && each.at == at)?;
        waiting.remove(place)
    }

    /// Stops waiting for an action that was refused.
    pub fn forget_awaited(&self, at: Time) {
        let mut waiting = self.awaited.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.retain(|each| each.at != at);
    }

    /// All clients.
    pub fn clients(&self) -> Vec<Arc<Client>> {
        self.lock_clients().clone()
    }

    /// The number of clients.
    pub fn viewers(&self) -> u32 {
        self.lock_clients().len() as u32
    }

    /// Adds a client, unless there are `most` already; returns whether it was added.
    pub fn join(&self, client: &Arc<Client>, most: usize) -> bool {
        let mut clients = self.lock_clients();
        let is_room = clients.len() < most;
        if is_room {
            clients.push(Arc::clone(client));
        }
        is_room
    }

    /// Removes a client.
    pub fn leave(&self, number: u64) {
        self.lock_clients().retain(|client| client.number != number);
    }

    /// Counts a client that the server disconnected.
    pub fn count_cut_off(&self) {
        self.cut_off.fetch_add(1, Ordering::Relaxed);
    }

    /// The number of clients that the server disconnected.
    pub fn cut_off(&self) -> u64 {
        self.cut_off.load(Ordering::Relaxed)
    }

    fn lock_clients(&self) -> MutexGuard<'_, Vec<Arc<Client>>> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A value of the protocol as JSON.
pub fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("the contract has string keys only")
}

/// A message as JSON.
pub fn message(message: &FromServer) -> String {
    json(message)
}
