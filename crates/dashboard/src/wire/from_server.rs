//! Messages from the server.

use serde::Serialize;

use super::declared::{Declared, Description};
use super::machine::{Machine, Missed, Recording, Unmet};
use super::network::{Bus, Computer};
use super::replay::{Playback, Timeline};

/// A message from the server.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum FromServer {
    /// The first message.
    Hello(Hello),
    /// Streams that are new or have changed; at the start all of them.
    Streams(Declared),
    /// The answer to a `describe`.
    Description(Description),
    /// The health of the raw streams, once a second.
    Status(Status),
    /// Values of features; at the start the newest of each stream.
    Features {
        /// The features, in order of arrival.
        features: Vec<Feature>,
    },
    /// Readings, and numbers from robots' messages: the newest of each wanted stream, at most 30 per second; at the
    /// start the newest of every stream.
    Samples {
        /// The samples, in order of arrival.
        samples: Vec<Sample>,
    },
    /// Events; at the start, the events of the last ten minutes, and all earlier phases, faults and alerts.
    Events {
        /// The events, in order of arrival.
        events: Vec<Event>,
    },
    /// Everything known so far was sent; new data follow.
    Ready,
    /// The recording, once a second.
    Recording(Recording),
    /// The phase that a command would start next; sent when it changes.
    NextPhase {
        /// The name of the phase; `null` after the last one.
        name: Option<String>,
    },
    /// The unmet requirements of the study, when they change; not sent before they are known.
    Required {
        /// The requirements, as `teampulse check` would report them now.
        unmet: Vec<Unmet>,
    },
    /// The pictures of a stream cannot be shown.
    Unshown {
        /// The stream's number.
        stream: u32,
        /// The reason.
        reason: String,
    },
    /// Other computers with their clocks, and the joined buses; once a second.
    Network {
        /// The computers, sorted by name.
        computers: Vec<Computer>,
        /// The buses; empty for a recording.
        buses: Vec<Bus>,
    },
    /// This program and its machine, once a second.
    Machine(Machine),
    /// The total number of messages that this client missed because it was too slow; when it grows.
    Missed(Missed),
    /// The answer to a `ping`.
    Pong(Pong),
    /// An action of this client is among the session's records; sent again once it is on the disk.
    Echo(Echo),
    /// The answer to a `history`.
    History(HistoryReply),
    /// A request of this client was not carried out.
    Refused(Refused),
    /// The session has ended; the connection closes.
    Ended(Ended),
    /// For a recording: the state of the playback; when it changes, and once a second.
    Playback(Playback),
    /// For a recording: another moment is shown. All values and events so far are outdated; the messages until
    /// `ready` restore the state at that moment.
    Moved(Playback),
    /// For a recording: the events of the whole recording, once they have been read.
    Timeline(Timeline),
}

/// The session, and the permissions of this viewer.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Hello {
    /// The version of this protocol: `PROTOCOL`.
    pub protocol: u32,
    /// The name of the session.
    pub session: String,
    /// The version of teampulse.
    pub version: &'static str,
    /// Whether the session is live.
    pub mode: Mode,
    /// The start of the session, since the Unix epoch [ms].
    pub began_unix_ms: f64,
    /// The current time [s].
    pub now: f64,
    /// How long past data is stored [s].
    pub stored_secs: f64,
    /// The viewer that receives this message.
    pub viewer: Viewer,
    /// The markers of the study, with their keys; any other letter sets a marker named after it.
    pub markers: Vec<Marker>,
    /// The phases of the study, in order.
    pub phases: Vec<PhasePlan>,
}

/// Whether a session is live.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The session is live.
    Live,
    /// The session is read from a recording.
    Replay,
}

/// The permissions of a viewer.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Viewer {
    /// The name of the sender in the bag: `dashboard`, `dashboard:192.168.1.7`.
    pub name: String,
    /// The general permission of the viewer.
    pub right: Right,
    /// The verbs of the commands that the viewer may send: `mark`, `next_phase`, `stop`, …
    pub commands: Vec<&'static str>,
    /// Whether streams are hidden from this viewer.
    pub blind: bool,
}

/// The general permission of a viewer: each includes the previous ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Right {
    /// Watch only.
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
    /// The key that sets the marker; empty if it has only a button.
    pub key: String,
    /// The label of the marker.
    pub label: String,
}

/// A phase of the study.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct PhasePlan {
    /// The name of the phase.
    pub name: String,
    /// The start of the phase [s]; `null` if it is started manually.
    pub from: Option<f64>,
    /// The duration of the phase [s]; `null` if it lasts until the next phase.
    pub lasts: Option<f64>,
}

/// The health of raw streams.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Status {
    /// The time of the assessment [s].
    pub t: f64,
    /// The health of each raw stream.
    pub streams: Vec<StreamHealth>,
}

/// The health of a stream.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StreamHealth {
    /// The stream's number.
    pub stream: u32,
    /// The state: `never`, `ok`, `degraded`, `stale` or `dead`.
    pub state: &'static str,
    /// Why the stream is not ok; empty if it is.
    pub reason: String,
    /// The rate over the last seconds [Hz].
    pub rate_hz: f64,
    /// The time since the last sample of the stream arrived [s].
    pub age_secs: Option<f64>,
    /// The number of samples received, including duplicates.
    pub received: u64,
    /// The number of samples lost before they arrived; `null` if it cannot be known.
    pub lost_source: Option<u64>,
    /// The number of samples lost in the internal queue.
    pub lost_queue: u64,
    /// The number of samples out of order.
    pub late: u64,
    /// The number of duplicates.
    pub duplicates: u64,
    /// How the stream's clock is modelled: `host`, `one_way`, `two_way`, `sample_index` or `remote`.
    pub clock: &'static str,
    /// The number of times that the stream's clock was restarted.
    pub epoch: u32,
    /// The offset of the stream's clock, positive if it is ahead of the session's [s].
    pub offset_secs: Option<f64>,
    /// The rate error of the stream's clock, positive if it is fast [ppm].
    pub skew_ppm: Option<f64>,
    /// The standard deviation of the delays of the samples [s].
    pub jitter_secs: Option<f64>,
    /// Half the width of the 95 % interval of a sample's true time [s].
    pub uncertainty_secs: Option<f64>,
    /// The median time from measurement to arrival [s].
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
    /// The value of each channel; `null` unless its reason is `ok`.
    pub values: Vec<Option<f64>>,
    /// The standard uncertainty of each value; empty if none can be stated.
    pub sigmas: Vec<Option<f64>>,
    /// For each channel `ok`, or the reason why it has no value: `short`, `gap`, `quality`, `missing`, `undefined`,
    /// `no_baseline`, `nothing`, `brief_baseline`.
    pub reasons: Vec<&'static str>,
}

/// A reading: one sample of a stream.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Sample {
    /// The stream's number.
    pub stream: u32,
    /// The time of the measurement [s].
    pub t: f64,
    /// The value of each channel of the stream.
    pub values: Vec<Option<f64>>,
}

/// An event.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Event {
    /// The number of the event, in order of arrival.
    pub number: u64,
    /// The stream's number.
    pub stream: u32,
    /// The time of the event [s].
    pub t: f64,
    /// The kind: `phase`, `marker`, `report`, `beat`, `response`, `breath`, `burst`, `blink`, `intervention`,
    /// `command`, `fault` or `clock`.
    pub kind: &'static str,
    /// The label of the event, as in the bag.
    pub label: String,
    /// The value of the event.
    pub value: Option<f64>,
    /// The duration of the event [s]; `null` if unknown.
    pub duration: Option<f64>,
    /// The command, note or acknowledgement that the event records.
    pub request: Option<Request>,
    /// The content of an alert, on `/team/alerts` or on a person's own alert stream.
    pub alert: Option<Alert>,
}

/// A request or a text entered by a user.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Request {
    /// The sender: `keys`, `dashboard`, `ros:/panel`.
    pub who: String,
    /// The verb of a command, or `note`, `acknowledge`, `show_estimates`.
    pub verb: String,
    /// The rest of the request: a marker's label, the note, or the label of the acknowledged event.
    pub text: String,
}

/// The content of an alert event.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Alert {
    /// The robot or the person; `team` or `session` if the alert is about no individual.
    pub who: String,
    /// The cause: `offline`, `wifi is stuck`, `HR of strap/ecg/heart above 120 1/min`.
    pub why: String,
    /// The stage: `raised`, `answered`, `unknown` or `over`.
    pub stage: &'static str,
    /// The urgency: `act`, `soon` or `note`; the default for the cause unless the label states the study's.
    pub tier: &'static str,
    /// Whether the urgency is the study's, which the label states while an alert of `[[alerts]]` is raised.
    pub is_of_study: bool,
}

/// The answer to a probe of the clock.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Pong {
    /// The value sent in `ping`.
    pub sent: f64,
    /// When the probe arrived, by the session's clock [s].
    pub received: f64,
    /// When the reply was sent [s].
    pub replied: f64,
}

/// An action of this client, as read back from the session's records.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Echo {
    /// The reference sent by the client.
    pub reference: String,
    /// The event's label.
    pub label: String,
    /// The time of the event in the recording [s].
    pub t: f64,
    /// The time of the event minus the requested time [s]; `null` if none was requested.
    pub off_secs: Option<f64>,
    /// Whether the recording has been synced to the disk since the event; `null` if nothing is recorded.
    pub on_disk: Option<bool>,
}

/// The stored data of a stream, in columns of equal width.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct HistoryReply {
    /// The reference sent by the client.
    pub reference: String,
    /// The stream's number.
    pub stream: u32,
    /// The start of the first column [s].
    pub from: f64,
    /// The width of a column [s].
    pub step: f64,
    /// The columns of each channel.
    pub channels: Vec<Column>,
}

/// The values of a channel in each column; `null` for a column without data.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Column {
    /// The minimum of each column.
    pub min: Vec<Option<f64>>,
    /// The maximum of each column.
    pub max: Vec<Option<f64>>,
    /// The mean of each column.
    pub mean: Vec<Option<f64>>,
}

/// Why a request was not carried out.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Refused {
    /// The reference sent by the client; `null` if there is none or it could not be read.
    pub reference: Option<String>,
    /// The reason.
    pub reason: String,
    /// What the user can do; may be empty.
    pub hint: String,
}

/// The end of the session.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Ended {
    /// The reason.
    pub reason: String,
}
