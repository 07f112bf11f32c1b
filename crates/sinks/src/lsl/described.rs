//! The description of a session's stream on LSL.

use std::fs;

use teampulse_core::stream::{Shape, Signal, Stream};
use teampulse_devices::lsl::{ChannelInfo, Format, OWN, StreamInfo};

/// The maximum number of channels of an outlet.
const MOST_CHANNELS: usize = 4096;

/// Returns the description of a stream; `None` if it has nothing that LSL can carry.
pub(super) fn info(stream: &Stream, numbers: Format, session: &str) -> Option<StreamInfo> {
    let is_text = stream.shape == Shape::Event;
    let has_numbers =
        matches!(stream.shape, Shape::Sample | Shape::Wave | Shape::Feature | Shape::Message(_))
            && (1..=MOST_CHANNELS).contains(&stream.channels.len());
    if !is_text && !has_numbers {
        return None;
    }
    let kind = kind(stream);
    let channel = |channel: &teampulse_core::stream::Channel| ChannelInfo {
        label: channel.name.clone(),
        unit: channel.unit.clone(),
        kind: kind.to_owned(),
    };
    let text =
        || ChannelInfo { label: "event".into(), kind: kind.to_owned(), ..ChannelInfo::default() };
    let channels: Vec<ChannelInfo> =
        if is_text { vec![text()] } else { stream.channels.iter().map(channel).collect() };
    Some(StreamInfo {
        name: stream.name.clone(),
        kind: kind.to_owned(),
        channel_count: channels.len(),
        rate_hz: if stream.shape == Shape::Wave { stream.rate_hz } else { 0.0 },
        format: if is_text { Format::String } else { numbers },
        source_id: format!("{OWN}{session}:{}", stream.name),
        uid: of_kernel("random/uuid"),
        session_id: "default".into(),
        hostname: of_kernel("hostname"),
        data_port: 0,
        service_port: 0,
        created_secs: 0.0,
        channels,
    })
}

fn kind(stream: &Stream) -> &'static str {
    match (&stream.shape, stream.signal) {
        (Shape::Event, _) => "Markers",
        (Shape::Feature, _) => "Features",
        (_, Signal::Eeg) => "EEG",
        (_, Signal::Ecg) => "ECG",
        (_, Signal::Emg) => "EMG",
        (_, Signal::Eda) => "EDA",
        (_, Signal::Ppg) => "PPG",
        (_, Signal::Respiration) => "Respiration",
        (_, Signal::Temperature) => "Temperature",
        (_, Signal::Acceleration) => "ACC",
        (_, Signal::Interval) => "RR",
        _ => "Other",
    }
}

/// Reads a line from a kernel file.
fn of_kernel(name: &str) -> String {
    let line = fs::read_to_string(format!("/proc/sys/kernel/{name}")).unwrap_or_default();
    line.trim().to_owned()
}
