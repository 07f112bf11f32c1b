//! Messages from a browser.

use serde::Deserialize;

/// The maximum number of streams that a browser can draw at once.
pub const MOST_WANTED: usize = 256;

/// A message from a browser. Any other message is refused.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FromBrowser {
    /// A probe of the session's clock, answered at once by `pong`.
    Ping {
        /// Any number, such as the browser's own time [ms]; it is returned unchanged.
        sent: f64,
    },
    /// The streams whose waves and samples this browser draws; replaces the previous list.
    Want {
        /// The streams; at most 256.
        streams: Vec<Wanted>,
    },
    /// Pictures were shown: the next ones of these streams may be sent.
    Shown {
        /// The streams, each listed once per picture.
        streams: Vec<u32>,
    },
    /// Requests the stored data of a stream; answered by `history`.
    History(History),
    /// Requests the description of a stream; answered by `description`.
    Describe {
        /// The client's reference, returned in `refused`.
        reference: String,
        /// The stream's number.
        stream: u32,
    },
    /// A command in text form: `mark robot lost`, `next_phase`, `split`, `stop`.
    Command {
        /// The client's reference, returned in `echo` or `refused`.
        reference: String,
        /// The command.
        text: String,
        /// When the key or the button was pressed, by the probed session clock [s]; `null` for now.
        at: Option<f64>,
    },
    /// A note, up to 1000 bytes.
    Note {
        /// The client's reference, returned in `echo` or `refused`.
        reference: String,
        /// The note.
        text: String,
        /// The time that it refers to: when typing began, or the selected moment [s]; `null` for now.
        at: Option<f64>,
    },
    /// A label for a time span of the signals, up to 1000 bytes: a marker with a duration, recorded at the start of
    /// the span.
    Annotate {
        /// The client's reference, returned in `echo` or `refused`.
        reference: String,
        /// The label.
        text: String,
        /// The start of the span: at most ten minutes ago [s].
        from: f64,
        /// The end of the span [s].
        to: f64,
    },
    /// The user acknowledges an alert or a fault.
    Acknowledge {
        /// The client's reference, returned in `echo` or `refused`.
        reference: String,
        /// The event's label, as received.
        alert: String,
        /// The time of the acknowledgement [s]; `null` for now.
        at: Option<f64>,
    },
    /// A self-report, such as an answer to an ISA prompt.
    Report {
        /// The client's reference, returned in `echo` or `refused`.
        reference: String,
        /// The person; `null` if there is only one.
        subject: Option<String>,
        /// The scale, as a single word: `isa`.
        scale: String,
        /// The answer: 1 to 5 for ISA.
        value: f64,
        /// The time of the report [s]; `null` for now.
        at: Option<f64>,
    },
    /// Shows hidden streams to this viewer from now on, which is recorded in the bag. They are then sent in
    /// `streams`.
    ShowEstimates {
        /// The client's reference, returned in `echo` or `refused`.
        reference: String,
    },
    /// For a recording: seeks, or changes the playback, for all viewers.
    Play {
        /// The client's reference, returned in `refused`.
        reference: String,
        /// The time to seek to [s].
        t: Option<f64>,
        /// The playback speed relative to real time: 0.1 to 20.
        rate: Option<f64>,
        /// Whether playback is paused.
        paused: Option<bool>,
    },
}

/// A stream that a browser draws.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct Wanted {
    /// The stream's number.
    pub stream: u32,
    /// The maximum number of points, or pictures, drawn per second; a faster wave is sent as pairs of its minimum and
    /// maximum, in the order in which they occur. 0 for all samples.
    pub points_per_sec: f64,
    /// For a camera: whether landmarks are drawn on its pictures. If so, pictures are sent as soon as their landmarks
    /// have arrived; without any landmarks, all pictures are sent.
    #[serde(default)]
    pub with_points: bool,
}

/// A request for the stored data of a stream.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct History {
    /// The client's reference, returned in the reply.
    pub reference: String,
    /// The stream's number.
    pub stream: u32,
    /// The start [s].
    pub from: f64,
    /// The end [s].
    pub to: f64,
    /// The maximum number of columns, such as one per pixel; no more than 4000.
    pub points: u32,
}
