//! The recording, this program, and what a client missed.

use serde::Serialize;

/// The recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Recording {
    /// Where it stands.
    pub stage: RecordingStage,
    /// The folder of the bag, of several the newest; empty where there is none.
    pub path: String,
    /// The bytes that are synced to the disk, in all bags of the session.
    pub bytes: u64,
    /// How fast it grew over the last ten seconds [bytes/s].
    pub bytes_per_sec: f64,
    /// The free space on the disk [bytes].
    pub free_bytes: Option<u64>,
    /// Since it last grew [s].
    pub sync_age_secs: Option<f64>,
    /// How long this bag has been recorded; while there is none, how long the session has run [s].
    pub elapsed_secs: f64,
    /// How many seconds are kept in memory while the recording is paused [s].
    pub kept_secs: Option<f64>,
    /// Why it ended early; empty otherwise.
    pub reason: String,
}

/// Where a recording stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum RecordingStage {
    /// No sink stores data.
    #[default]
    Nothing,
    /// Tables are written, and no bag.
    Tables,
    /// It begins.
    NotBegun,
    /// It is being recorded: look at `sync_age_secs`.
    Open,
    /// Nothing is recorded until a command begins a bag: look at `kept_secs`.
    Paused,
    /// It ended with the session, and is complete.
    Finished,
    /// It ended before the session.
    EndedEarly,
}

/// This program and its machine.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Machine {
    /// The processor time of this program per time [cores].
    pub cpu_cores: f64,
    /// Its memory [bytes].
    pub memory_bytes: Option<u64>,
    /// The records that the dashboard itself skipped since the session began.
    pub skipped: u64,
    /// The viewers that are connected.
    pub viewers: u32,
    /// What waits for this client [bytes].
    pub waiting_bytes: u64,
}

/// What a client did not get as it was too slow, since it connected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Missed {
    /// Events; never markers, alerts, phases or faults.
    pub events: u64,
    /// Statuses and values of features that a newer one replaced.
    pub states: u64,
    /// Readings and waves.
    pub signals: u64,
    /// Pictures that a newer one replaced.
    pub pictures: u64,
}

/// What the study requires and is not there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Unmet {
    /// What, as `teampulse check` names it: `battery of robot robot1`.
    pub what: String,
    /// The remedy.
    pub fix: String,
}
