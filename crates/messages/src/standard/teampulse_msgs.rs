//! `teampulse_msgs`: our own six, and our service. The package in `msgs/` documents them for ROS
//! users.

use teampulse_core::time::Time;

use super::message;
use super::std_msgs::Header;

/// The `device_time` of a device that has no clock.
pub const NO_DEVICE_TIME: i64 = i64::MIN;

/// One reading, a number for each channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// When it was measured.
    pub header: Header,
    /// By the device's own clock [ns]; [`NO_DEVICE_TIME`] when it has none.
    pub device_time: i64,
    /// Its number in the stream; a jump is a gap.
    pub index: u64,
    /// A number for each channel.
    pub values: Vec<f64>,
}

message!(Sample { header, device_time, index, values } = "teampulse_msgs/msg/Sample");

/// A run of samples with one period.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wave {
    /// When its first sample was measured.
    pub header: Header,
    /// The same by the device's own clock [ns]; [`NO_DEVICE_TIME`] when it has none.
    pub device_time: i64,
    /// The number of the wave in its stream; a jump is a gap.
    pub index: u64,
    /// Time from one sample to the next [ns].
    pub period_ns: f64,
    /// How many numbers a sample has.
    pub channels: u32,
    /// Sample by sample.
    pub samples: Vec<f64>,
}

message!(
    Wave { header, device_time, index, period_ns, channels, samples } = "teampulse_msgs/msg/Wave"
);

/// The named values of one window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feature {
    /// When the window ended.
    pub header: Header,
    /// Length of the window [s].
    pub window_secs: f64,
    /// How much of the window had data [0..1].
    pub coverage: f32,
    /// How good the data were [0..1].
    pub quality: f32,
    /// A value for each channel; NaN where there is none.
    pub values: Vec<f64>,
    /// The standard uncertainty of each value; empty when none can be stated.
    pub sigmas: Vec<f64>,
    /// Why a value is missing, as the codes of [`Reason`](teampulse_core::data::Reason).
    pub reasons: Vec<u8>,
}

message!(
    Feature { header, window_secs, coverage, quality, values, sigmas, reasons } =
        "teampulse_msgs/msg/Feature"
);

/// Something that happened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Event {
    /// When it happened or began.
    pub header: Header,
    /// The same by the device's own clock [ns]; [`NO_DEVICE_TIME`] when it has none.
    pub device_time: i64,
    /// A word of [`EventKind`](teampulse_core::data::EventKind).
    pub kind: String,
    /// Which one.
    pub label: String,
    /// A number that belongs to it; NaN for none.
    pub value: f64,
    /// How long it lasted or will last [s]; 0 for a moment, NaN where unknown.
    pub duration_secs: f64,
}

message!(
    Event { header, device_time, kind, label, value, duration_secs } = "teampulse_msgs/msg/Event"
);

/// What a stream is, on `/teampulse/streams`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamDescription {
    /// When it was declared.
    pub header: Header,
    /// Its topic.
    pub name: String,
    /// The full name of its type.
    pub r#type: String,
    /// A word of [`Signal`](teampulse_core::stream::Signal).
    pub signal: String,
    /// A code of [`About`](teampulse_core::stream::About): 0 person, 1 robot, 2 team, 3 session.
    pub about: u8,
    /// The subject; empty for the team and the session.
    pub id: String,
    /// The device that measures.
    pub device: String,
    /// A code of [`Origin`](teampulse_core::stream::Origin): 0 raw, 1 derived.
    pub origin: u8,
    /// The streams it was computed from.
    pub inputs: Vec<String>,
    /// How it was computed.
    pub method: String,
    /// What its numbers are called.
    pub channels: Vec<String>,
    /// The unit of each channel.
    pub units: Vec<String>,
    /// The declared rate [Hz]; 0 where irregular.
    pub rate_hz: f64,
    /// Factor from each of the message's own numbers to its unit; empty where all are 1.
    pub scales: Vec<f64>,
    /// One sentence for people.
    pub doc: String,
    /// What feature it is; empty for what is raw.
    pub family: String,
    /// Length of its windows [s]; 0 without any, [`PHASES`](Self::PHASES) for whole phases.
    pub window_secs: f64,
    /// The topic that another publisher is heard on; empty for any other stream.
    pub beside: String,
}

message!(
    StreamDescription {
        header,
        name,
        r#type,
        signal,
        about,
        id,
        device,
        origin,
        inputs,
        method,
        channels,
        units,
        rate_hz,
        scales,
        doc,
        family,
        window_secs,
        beside,
    } = "teampulse_msgs/msg/StreamDescription"
);

impl StreamDescription {
    /// The `window_secs` of values that are each of a whole phase.
    pub const PHASES: f64 = -1.0;
}

/// How a stream is doing, on `/teampulse/status`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamStatus {
    /// When this was so.
    pub header: Header,
    /// The stream's topic.
    pub name: String,
    /// A code of [`State`](teampulse_core::status::State).
    pub state: u8,
    /// Why it is not OK.
    pub reason: String,
    /// Its rate over the last seconds [Hz].
    pub rate_hz: f64,
    /// Time since its last sample [s]; NaN before the first.
    pub age_secs: f64,
    /// How many samples were taken.
    pub received: u64,
    /// How many were lost on the way here; −1 where that can't be known.
    pub lost_source: i64,
    /// How many were lost in the session's own queue.
    pub lost_queue: u64,
    /// How many came out of their turn.
    pub late: u64,
    /// How many came twice.
    pub duplicates: u64,
    /// How its clock is modelled: 0 = by the host's.
    pub clock: u8,
    /// How often its clock has begun anew.
    pub epoch: u32,
    /// How far its clock is ahead of the session's [s]; NaN where unknown.
    pub offset_secs: f64,
    /// How much faster its clock runs [ppm]; NaN where unknown.
    pub skew_ppm: f64,
    /// The jitter of its delays [s]; NaN where unknown.
    pub jitter_secs: f64,
    /// The uncertainty of its times [s]; NaN where unknown.
    pub sigma_secs: f64,
    /// The median time from measuring to arrival [s]; NaN where unknown.
    pub latency_secs: f64,
}

message!(
    StreamStatus {
        header,
        name,
        state,
        reason,
        rate_hz,
        age_secs,
        received,
        lost_source,
        lost_queue,
        late,
        duplicates,
        clock,
        epoch,
        offset_secs,
        skew_ppm,
        jitter_secs,
        sigma_secs,
        latency_secs,
    } = "teampulse_msgs/msg/StreamStatus"
);

impl StreamStatus {
    /// The `lost_source` of a stream whose losses can't be known.
    pub const LOST_UNKNOWN: i64 = -1;
}

/// Asks another computer for its clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbeClockRequest {
    /// When this was sent, by the caller's clock.
    pub sent: Time,
}

message!(ProbeClockRequest { sent } = "teampulse_msgs/srv/ProbeClock_Request");

/// What another computer's clock shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbeClockResponse {
    /// What the caller sent.
    pub sent: Time,
    /// When the request arrived, by the clock of this computer.
    pub received: Time,
    /// When this was sent, by the same clock.
    pub replied: Time,
}

message!(ProbeClockResponse { sent, received, replied } = "teampulse_msgs/srv/ProbeClock_Response");
