//! The recording, this program, and the messages that a client missed.

use serde::Serialize;

/// The state of the recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Recording {
    /// The stage of the recording.
    pub stage: RecordingStage,
    /// The folder of the bag, or of the newest bag if there are several; empty if there is none.
    pub path: String,
    /// The number of bytes synced to the disk, in all bags of the session.
    pub bytes: u64,
    /// The growth rate over the last ten seconds [bytes/s].
    pub bytes_per_sec: f64,
    /// The free space on the disk [bytes].
    pub free_bytes: Option<u64>,
    /// The time since the recording last grew [s].
    pub sync_age_secs: Option<f64>,
    /// How long the newest bag has been recorded; without a bag, how long the session has run [s].
    pub elapsed_secs: f64,
    /// How much is kept in memory while the recording is paused [s].
    pub kept_secs: Option<f64>,
    /// Why the recording ended early; empty otherwise.
    pub reason: String,
}

/// The stage of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum RecordingStage {
    /// No sink stores data.
    #[default]
    Nothing,
    /// Tables are written, but no bag.
    Tables,
    /// The recording is starting.
    NotBegun,
    /// A bag is being recorded: see `sync_age_secs`.
    Open,
    /// Nothing is recorded until a command starts a bag: see `kept_secs`.
    Paused,
    /// The recording ended with the session, and is complete.
    Finished,
    /// The recording ended before the session.
    EndedEarly,
}

/// This program and its machine.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Machine {
    /// The processor time of this program per unit of time [cores].
    pub cpu_cores: f64,
    /// The memory used by this program [bytes].
    pub memory_bytes: Option<u64>,
    /// The number of records that the dashboard itself skipped since the session began.
    pub skipped: u64,
    /// The number of connected viewers.
    pub viewers: u32,
    /// The amount of data queued for this client [bytes].
    pub waiting_bytes: u64,
}

/// The messages that a client missed because it was too slow, since it connected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Missed {
    /// The number of events; never markers, alerts, phases or faults.
    pub events: u64,
    /// The number of statuses and feature values that were replaced by newer ones.
    pub states: u64,
    /// The number of readings and waves.
    pub signals: u64,
    /// The number of pictures that were replaced by newer ones.
    pub pictures: u64,
}

/// An unmet requirement of the study.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Unmet {
    /// The name of the requirement in `teampulse check`: `battery of robot robot1`.
    pub what: String,
    /// The remedy.
    pub fix: String,
}
