//! `teampulse_msgs`: our six messages and our service. The package in `msgs/` documents them for ROS users.

use teampulse_core::time::Time;

use super::message;
use super::std_msgs::Header;

/// The `device_time` of a device without a clock.
pub const NO_DEVICE_TIME: i64 = i64::MIN;

/// A reading with one number per channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// When the sample was measured.
    pub header: Header,
    /// The time by the device's own clock [ns]; [`NO_DEVICE_TIME`] if it has none.
    pub device_time: i64,
    /// The sample's index in the stream; a jump means a gap.
    pub index: u64,
    /// The values, one per channel.
    pub values: Vec<f64>,
}

message!(Sample { header, device_time, index, values } = "teampulse_msgs/msg/Sample");

/// A batch of samples with a constant period.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wave {
    /// When the first sample of the wave was measured.
    pub header: Header,
    /// The time of the first sample by the device's own clock [ns]; [`NO_DEVICE_TIME`] if it has none.
    pub device_time: i64,
    /// The index of the wave in its stream; a jump means a gap.
    pub index: u64,
    /// The sampling period [ns].
    pub period_ns: f64,
    /// The number of channels in a sample.
    pub channels: u32,
    /// The values, sample by sample.
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
    /// The share of the window with data [0..1].
    pub coverage: f32,
    /// The quality of the data [0..1].
    pub quality: f32,
    /// The values, one per channel; NaN if there is none.
    pub values: Vec<f64>,
    /// The standard uncertainty of each value; empty if unknown.
    pub sigmas: Vec<f64>,
    /// The reason for each missing value, as a code of [`Reason`](teampulse_core::data::Reason).
    pub reasons: Vec<u8>,
}

message!(
    Feature { header, window_secs, coverage, quality, values, sigmas, reasons } =
        "teampulse_msgs/msg/Feature"
);

/// An event.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Event {
    /// The time at which the event happened or started.
    pub header: Header,
    /// The time of the event by the device's own clock [ns]; [`NO_DEVICE_TIME`] if it has none.
    pub device_time: i64,
    /// The kind, as a word of [`EventKind`](teampulse_core::data::EventKind).
    pub kind: String,
    /// The label that distinguishes events of one kind.
    pub label: String,
    /// The associated number; NaN for none.
    pub value: f64,
    /// The duration, past or expected [s]; 0 for an instant, NaN if unknown.
    pub duration_secs: f64,
}

message!(
    Event { header, device_time, kind, label, value, duration_secs } = "teampulse_msgs/msg/Event"
);

/// The description of a stream, published on `/teampulse/streams`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamDescription {
    /// When the stream was declared.
    pub header: Header,
    /// The topic of the stream.
    pub name: String,
    /// The full name of the message type.
    pub r#type: String,
    /// The signal, as a word of [`Signal`](teampulse_core::stream::Signal).
    pub signal: String,
    /// What the stream is about, as a code of [`About`](teampulse_core::stream::About): 0 person, 1 robot,
    /// 2 team, 3 session.
    pub about: u8,
    /// The id of the subject; empty for the team and the session.
    pub id: String,
    /// The measuring device.
    pub device: String,
    /// The origin, as a code of [`Origin`](teampulse_core::stream::Origin): 0 raw, 1 derived.
    pub origin: u8,
    /// The streams that the stream was computed from.
    pub inputs: Vec<String>,
    /// The method of computation.
    pub method: String,
    /// The names of the channels.
    pub channels: Vec<String>,
    /// The unit of each channel.
    pub units: Vec<String>,
    /// The declared rate [Hz]; 0 if irregular.
    pub rate_hz: f64,
    /// The factors that convert the message's numbers to the units; empty if all are 1.
    pub scales: Vec<f64>,
    /// A human-readable sentence.
    pub doc: String,
    /// The family of the feature; empty for a raw stream.
    pub family: String,
    /// The length of the windows [s]; 0 if there are none, [`PHASES`](Self::PHASES) for whole phases.
    pub window_secs: f64,
    /// The topic, if this stream holds the samples of another publisher of that topic; empty for any other stream.
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
    /// The `window_secs` of values that each cover a whole phase.
    pub const PHASES: f64 = -1.0;
}

/// The state of a stream, published on `/teampulse/status`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreamStatus {
    /// The time of the status.
    pub header: Header,
    /// The stream's topic.
    pub name: String,
    /// The state, as a code of [`State`](teampulse_core::status::State).
    pub state: u8,
    /// The reason if the state is not OK.
    pub reason: String,
    /// The rate over the last seconds [Hz].
    pub rate_hz: f64,
    /// The time since the last sample [s]; NaN before the first.
    pub age_secs: f64,
    /// The number of readings received; a wave counts once.
    pub received: u64,
    /// The number of samples lost before reception; −1 if unknown.
    pub lost_source: i64,
    /// The number of samples lost in the session's own queue.
    pub lost_queue: u64,
    /// The number of samples that arrived out of order.
    pub late: u64,
    /// The number of duplicate samples.
    pub duplicates: u64,
    /// The kind of clock model: 0 = the host's clock.
    pub clock: u8,
    /// The number of times that the stream's clock was reset or restarted.
    pub epoch: u32,
    /// The offset of the clock, positive if it is ahead of the session's [s]; NaN if unknown.
    pub offset_secs: f64,
    /// The rate error of the clock, positive if it is fast [ppm]; NaN if unknown.
    pub skew_ppm: f64,
    /// The jitter of delays [s]; NaN if unknown.
    pub jitter_secs: f64,
    /// The standard uncertainty of times [s]; NaN if unknown.
    pub sigma_secs: f64,
    /// The median latency from measurement to arrival [s]; NaN if unknown.
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
    /// The `lost_source` of a stream whose losses are unknown.
    pub const LOST_UNKNOWN: i64 = -1;
}

/// Requests a reading of another computer's clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbeClockRequest {
    /// When the request was sent, by the client's clock.
    pub sent: Time,
}

message!(ProbeClockRequest { sent } = "teampulse_msgs/srv/ProbeClock_Request");

/// The reading of another computer's clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbeClockResponse {
    /// The time in the request.
    pub sent: Time,
    /// When the request arrived, by the server's clock.
    pub received: Time,
    /// When the response was sent, by the server's clock.
    pub replied: Time,
}

message!(ProbeClockResponse { sent, received, replied } = "teampulse_msgs/srv/ProbeClock_Response");
