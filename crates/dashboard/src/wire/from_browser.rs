//! What a browser sends.

use serde::Deserialize;

/// How many streams of waves a browser can have at once.
pub const MOST_WANTED: usize = 256;

/// A message of a browser. Any other is refused.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FromBrowser {
    /// A probe of the session's clock, answered at once by `pong`.
    Ping {
        /// Any number, returned as it is: the browser's own time [ms].
        sent: f64,
    },
    /// The streams whose waves and samples this browser draws: replaces what it wanted before.
    Want {
        /// At most 256.
        streams: Vec<Wanted>,
    },
    /// Pictures were shown: the next of these streams may leave.
    Shown {
        /// Each once for each picture.
        streams: Vec<u32>,
    },
    /// Asks for what is stored of a stream; answered by `history`.
    History(History),
    /// Asks what a stream is, in words; answered by `description`.
    Describe {
        /// Comes back in `refused`.
        reference: String,
        /// The stream's number.
        stream: u32,
    },
    /// A command, in its one text form: `mark robot lost`, `next_phase`, `split`, `stop`.
    Command {
        /// Comes back in `echo` or `refused`.
        reference: String,
        /// The command.
        text: String,
        /// When the key or the button was pressed, by the probed clock [s]; `null` for now.
        at: Option<f64>,
    },
    /// A note, up to 1000 bytes.
    Note {
        /// Comes back in `echo` or `refused`.
        reference: String,
        /// The note.
        text: String,
        /// What it is about: when its writing began, or the moment that was chosen [s]; `null` for now.
        at: Option<f64>,
    },
    /// A label for a span of the signals, up to 1000 bytes: a marker that lasts, recorded at the span's begin.
    Annotate {
        /// Comes back in `echo` or `refused`.
        reference: String,
        /// The label.
        text: String,
        /// The begin of the span: at most ten minutes ago [s].
        from: f64,
        /// Its end [s].
        to: f64,
    },
    /// Someone has seen an alert or a fault.
    Acknowledge {
        /// Comes back in `echo` or `refused`.
        reference: String,
        /// The event's label, as it came.
        alert: String,
        /// When [s]; `null` for now.
        at: Option<f64>,
    },
    /// A self-report, such as an answer to an ISA prompt.
    Report {
        /// Comes back in `echo` or `refused`.
        reference: String,
        /// The person; `null` where there is only one.
        subject: Option<String>,
        /// The scale, one word: `isa`.
        scale: String,
        /// The answer: 1 to 5 for ISA.
        value: f64,
        /// When [s]; `null` for now.
        at: Option<f64>,
    },
    /// Shows hidden streams to this viewer from now on, which is written into the bag. They come in `streams` anew.
    ShowEstimates {
        /// Comes back in `echo` or `refused`.
        reference: String,
    },
    /// Of a recording: moves to another time, or changes how it moves on; for all who look at it.
    Play {
        /// Comes back in `refused`.
        reference: String,
        /// Another time [s].
        t: Option<f64>,
        /// How many times as fast as it was recorded: 0.1 to 20.
        rate: Option<f64>,
        /// Whether it stands still.
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
    /// How many points, or pictures, a second are drawn at most; a faster wave comes as pairs of its smallest and largest
    /// samples, in their order. 0 for all of them.
    pub points_per_sec: f64,
    /// Of a camera: whether the points found in its pictures are drawn on them. Then those pictures come that points were
    /// found in, as soon as these have come; all of them while there are none.
    #[serde(default)]
    pub with_points: bool,
}

/// What is asked for of what is stored of a stream.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Comes back in the reply.
    pub reference: String,
    /// The stream's number.
    pub stream: u32,
    /// From when [s].
    pub from: f64,
    /// Until when [s].
    pub to: f64,
    /// In how many columns at most: as many as pixels. At most 4000.
    pub points: u32,
}
