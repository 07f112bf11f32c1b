//! What the server sends.

use serde::Serialize;

use super::declared::{Declared, Description};
use super::machine::{Machine, Missed, Recording, Unmet};
use super::network::{Bus, Computer};
use super::replay::{Playback, Timeline};

/// A message of the server.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum FromServer {
    /// The first message.
    Hello(Hello),
    /// Streams that are new, or of which more is known; at the start all of them.
    Streams(Declared),
    /// The answer to a `describe`.
    Description(Description),
    /// The health of the raw streams, once a second.
    Status(Status),
    /// Values of features; at the start the newest of each stream.
    Features {
        /// In the order in which they came.
        features: Vec<Feature>,
    },
    /// Readings, and numbers read from robots' messages: the newest of each wanted stream, at most 30 a second; at
    /// the start the newest of every stream.
    Samples {
        /// In the order in which they came.
        samples: Vec<Sample>,
    },
    /// Events; at the start those of the last ten minutes, and all phases, faults and alerts before.
    Events {
        /// In the order in which they came.
        events: Vec<Event>,
    },
    /// All that is known so far was sent; what follows is new.
    Ready,
    /// The recording, once a second.
    Recording(Recording),
    /// The phase that a command would begin, when it changes.
    NextPhase {
        /// Its name; `null` after the last one.
        name: Option<String>,
    },
    /// What the study requires and is not there, when it changes; nothing of it before the first one.
    Required {
        /// As `teampulse check` would find it now.
        unmet: Vec<Unmet>,
    },
    /// The pictures of a stream can't be shown.
    Unshown {
        /// The stream's number.
        stream: u32,
        /// Why.
        reason: String,
    },
    /// Other computers with their clocks, and the buses on which streams come; once a second.
    Network {
        /// In the order of their names.
        computers: Vec<Computer>,
        /// Of a recording none.
        buses: Vec<Bus>,
    },
    /// This program and its machine, once a second.
    Machine(Machine),
    /// What this client did not get as it was too slow, in all; when it grows.
    Missed(Missed),
    /// The answer to a `ping`.
    Pong(Pong),
    /// What this client did is among the session's records; comes again when it is on the disk.
    Echo(Echo),
    /// The answer to a `history`.
    History(HistoryReply),
    /// Something that this client asked for was not done.
    Refused(Refused),
    /// The session is over; the connection closes.
    Ended(Ended),
    /// Of a recording: how the position moves on; when that changes, and once a second.
    Playback(Playback),
    /// Of a recording: another moment is shown. All numbers and events so far are no longer true; what follows until
    /// `ready` is what was known at that moment.
    Moved(Playback),
    /// Of a recording: what happened in all of it, once that is read.
    Timeline(Timeline),
}

/// The session, and what this viewer may do there.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Hello {
    /// The version of this contract: `PROTOCOL`.
    pub protocol: u32,
    /// The name of the session.
    pub session: String,
    /// The version of teampulse.
    pub version: &'static str,
    /// Whether it happens now.
    pub mode: Mode,
    /// When it began, since the Unix epoch [ms].
    pub began_unix_ms: f64,
    /// The present time [s].
    pub now: f64,
    /// For how long the past is stored [s].
    pub stored_secs: f64,
    /// This viewer.
    pub viewer: Viewer,
    /// The markers of the study, with their keys; any other letter sets a marker of its own name.
    pub markers: Vec<Marker>,
    /// The phases of the study, in their order.
    pub phases: Vec<PhasePlan>,
}

/// Whether the session happens now.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Now.
    Live,
    /// It is read from a recording.
    Replay,
}

/// What a viewer may do.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Viewer {
    /// The name of the sender in the bag: `dashboard`, `dashboard:192.168.1.7`.
    pub name: String,
    /// What the viewer may do at all.
    pub right: Right,
    /// The verbs of the commands that the viewer may send: `mark`, `next_phase`, `stop`, …
    pub commands: Vec<&'static str>,
    /// Whether streams are hidden from this viewer.
    pub blind: bool,
}

/// What a viewer may do at all: each includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Right {
    /// See.
    Watch,
    /// Set markers, write notes, report and acknowledge.
    Mark,
    /// Send every command that the study allows.
    Control,
}

/// A marker of the study.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Marker {
    /// Its key; empty for a button only.
    pub key: String,
    /// Its label.
    pub label: String,
}

/// A phase of the study.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct PhasePlan {
    /// Its name.
    pub name: String,
    /// When it begins [s]; `null` where it begins by hand.
    pub from: Option<f64>,
    /// How long it lasts [s]; `null` until the next one.
    pub lasts: Option<f64>,
}

/// The health of raw streams.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Status {
    /// When it was judged [s].
    pub t: f64,
    /// One for each raw stream.
    pub streams: Vec<StreamHealth>,
}

/// The health of a stream.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StreamHealth {
    /// The stream's number.
    pub stream: u32,
    /// `never`, `ok`, `degraded`, `stale` or `dead`.
    pub state: &'static str,
    /// Why it is not ok; empty when it is.
    pub reason: String,
    /// The rate over the last seconds [Hz].
    pub rate_hz: f64,
    /// Since its last sample arrived [s].
    pub age_secs: Option<f64>,
    /// The samples taken, duplicates included.
    pub received: u64,
    /// The samples lost on the way here; `null` where that can't be known.
    pub lost_source: Option<u64>,
    /// The samples lost in our own queue.
    pub lost_queue: u64,
    /// The samples out of order.
    pub late: u64,
    /// The duplicates.
    pub duplicates: u64,
    /// How its clock is modelled: `host`, `one_way`, `two_way`, `sample_index` or `remote`.
    pub clock: &'static str,
    /// How often its clock was restarted.
    pub epoch: u32,
    /// How far its clock is ahead of the session's [s].
    pub offset_secs: Option<f64>,
    /// How much faster its clock runs [ppm].
    pub skew_ppm: Option<f64>,
    /// The standard deviation of its delays [s].
    pub jitter_secs: Option<f64>,
    /// Half the interval that holds the true time with a probability of 95 % [s].
    pub uncertainty_secs: Option<f64>,
    /// The median time from measuring to arrival [s].
    pub latency_secs: Option<f64>,
}

/// The values of a feature over one window.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Feature {
    /// The stream's number.
    pub stream: u32,
    /// The end of the window [s].
    pub t: f64,
    /// The length of the window [s].
    pub window_secs: f64,
    /// The share of the window with data [0..1].
    pub coverage: Option<f64>,
    /// The quality of the data [0..1].
    pub quality: Option<f64>,
    /// A value for each channel; `null` exactly where there is a reason.
    pub values: Vec<Option<f64>>,
    /// The standard uncertainty of each value; empty when none can be stated.
    pub sigmas: Vec<Option<f64>>,
    /// For each channel `ok` or why it has no value: `short`, `gap`, `quality`, `missing`, `undefined`, `no_baseline`,
    /// `nothing`, `brief_baseline`.
    pub reasons: Vec<&'static str>,
}

/// A reading.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Sample {
    /// The stream's number.
    pub stream: u32,
    /// When it was measured [s].
    pub t: f64,
    /// A number for each channel of the stream.
    pub values: Vec<Option<f64>>,
}

/// An event.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Event {
    /// Its number, in the order in which events came.
    pub number: u64,
    /// The stream's number.
    pub stream: u32,
    /// When it happened [s].
    pub t: f64,
    /// `phase`, `marker`, `report`, `beat`, `response`, `breath`, `burst`, `blink`, `intervention`, `command`, `fault`
    /// or `clock`.
    pub kind: &'static str,
    /// Its label, as in the bag.
    pub label: String,
    /// Its value.
    pub value: Option<f64>,
    /// How long it lasts [s]; `null` where that is not known.
    pub duration: Option<f64>,
    /// What somebody asked for or wrote, of a command, a note or an acknowledgement.
    pub request: Option<Request>,
    /// What it says of an alert, on `/team/alerts` or a person's own stream of alerts.
    pub alert: Option<Alert>,
}

/// What somebody asked for or wrote.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Request {
    /// Who: `keys`, `dashboard`, `ros:/panel`.
    pub who: String,
    /// The verb of a command, or `note`, `acknowledge`, `show_estimates`.
    pub verb: String,
    /// The rest: a marker's label, the note, the label of what was acknowledged.
    pub text: String,
}

/// What an event says of an alert.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Alert {
    /// The robot or the person; `team` or `session` for what is about nobody alone.
    pub who: String,
    /// Why: `offline`, `wifi is stuck`, `HR of strap/ecg/heart above 120 1/min`.
    pub why: String,
    /// `raised`, `answered`, `unknown` or `over`.
    pub stage: &'static str,
    /// How urgent it is: `act`, `soon` or `note`; as the study states it only when it is raised.
    pub tier: &'static str,
    /// Whether the study states how urgent it is: one of its `[[alerts]]` is raised.
    pub is_of_study: bool,
}

/// The answer to a probe of the clock.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Pong {
    /// As it was in `ping`.
    pub sent: f64,
    /// When the probe arrived, by the session's clock [s].
    pub received: f64,
    /// When the answer left [s].
    pub replied: f64,
}

/// What this client did, as it was read back.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Echo {
    /// As it was sent.
    pub reference: String,
    /// The event's label.
    pub label: String,
    /// Its time in the recording [s].
    pub t: f64,
    /// That time less the one that was sent [s]; `null` where none was sent.
    pub off_secs: Option<f64>,
    /// Whether the recording was synced to the disk since; `null` where nothing is recorded.
    pub on_disk: Option<bool>,
}

/// What is stored of a stream, in columns of one width.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct HistoryReply {
    /// As it was sent.
    pub reference: String,
    /// The stream's number.
    pub stream: u32,
    /// When the first column begins [s].
    pub from: f64,
    /// The width of a column [s].
    pub step: f64,
    /// One for each channel.
    pub channels: Vec<Column>,
}

/// The columns of a channel; `null` where there were no data.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Column {
    /// The smallest number of each column.
    pub min: Vec<Option<f64>>,
    /// The largest.
    pub max: Vec<Option<f64>>,
    /// The mean.
    pub mean: Vec<Option<f64>>,
}

/// Why something was not done.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Refused {
    /// As it was sent; `null` for what could not be read.
    pub reference: Option<String>,
    /// Why.
    pub reason: String,
    /// What the user can do; may be empty.
    pub hint: String,
}

/// The end of the session.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Ended {
    /// Why.
    pub reason: String,
}
