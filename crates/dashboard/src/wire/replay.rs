//! What the server sends of a recording that is shown.

use serde::Serialize;

use super::Event;

/// The position in a recording, and how it moves on.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Playback {
    /// The time that is shown [s].
    pub t: f64,
    /// How many times as fast as it was recorded.
    pub rate: f64,
    /// Whether it stands still.
    pub paused: bool,
    /// The length of the recording [s].
    pub length: f64,
}

/// What happened in the whole recording.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Timeline {
    /// The events of the session, the team and the robots, without those of bodies.
    pub events: Vec<Event>,
    /// How many events did not fit.
    pub left_out: u64,
    /// When nothing came from people and robots.
    pub absences: Vec<Absence>,
}

/// When nothing came from a person or a robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Absence {
    /// The id.
    pub subject: String,
    /// `person` or `robot`.
    pub about: &'static str,
    /// In order of time.
    pub gaps: Vec<Gap>,
}

/// A span without samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Gap {
    /// Its begin [s].
    pub from: f64,
    /// Its end [s].
    pub to: f64,
}
