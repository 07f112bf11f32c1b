//! Messages about a recording that is being shown.

use serde::Serialize;

use super::Event;

/// The position in a recording, and the state of the playback.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Playback {
    /// The time shown [s].
    pub t: f64,
    /// The playback speed relative to real time.
    pub rate: f64,
    /// Whether playback is paused.
    pub paused: bool,
    /// The length of the recording [s].
    pub length: f64,
}

/// The events of the whole recording.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Timeline {
    /// The events of the session, the team and the robots, without physiological events.
    pub events: Vec<Event>,
    /// The number of events that did not fit.
    pub left_out: u64,
    /// The times without data from people and robots.
    pub absences: Vec<Absence>,
}

/// The times without data from a person or a robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Absence {
    /// The id of the person or robot.
    pub subject: String,
    /// The kind of subject: `person` or `robot`.
    pub about: &'static str,
    /// The gaps, in order of time.
    pub gaps: Vec<Gap>,
}

/// A span without samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Gap {
    /// The start of the gap [s].
    pub from: f64,
    /// The end of the gap [s].
    pub to: f64,
}
