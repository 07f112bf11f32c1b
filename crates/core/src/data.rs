//! Data: the closed set of shapes in which samples come.

use std::fmt;
use std::sync::Arc;

use bytes::Bytes;

use crate::status::StreamStatus;
use crate::stream::Stream;
use crate::text::{self, LONGEST_LABEL, LONGEST_NAME};
use crate::words::words;

/// The content of a sample: a closed set of shapes, not of sensors. A new sensor needs no new
/// shape.
#[derive(Clone, Debug)]
pub enum Data {
    /// One reading, a number for each channel.
    Sample(Arc<[f64]>),
    /// Several samples.
    Wave(Wave),
    /// The values of a feature over one window.
    Feature(Arc<FeatureValues>),
    /// Something that happened.
    Event(Arc<Event>),
    /// The health of a stream.
    Status(Arc<StreamStatus>),
    /// A stream that was declared.
    Description(Arc<Stream>),
    /// A ROS message of another program, byte for byte: CDR with its four-byte header.
    Message(Bytes),
}

impl Data {
    /// The heap memory of the data [bytes]; shared data count in full.
    #[must_use]
    pub fn held_bytes(&self) -> usize {
        match self {
            Data::Sample(values) => size_of_val(&**values),
            Data::Wave(wave) => size_of_val(&*wave.samples),
            Data::Feature(feature) => {
                let FeatureValues { values, sigmas, reasons, .. } = &**feature;
                let numbers = (values.capacity() + sigmas.capacity()) * size_of::<f64>();
                size_of::<FeatureValues>() + numbers + reasons.capacity()
            }
            Data::Event(event) => size_of::<Event>() + event.label.capacity(),
            Data::Status(status) => {
                size_of::<StreamStatus>() + status.name.capacity() + status.reason.capacity()
            }
            Data::Description(stream) => size_of::<Stream>() + stream.held_bytes(),
            Data::Message(bytes) => bytes.len(),
        }
    }

    /// The number of samples: at least 1 for a wave, and 1 for any other shape.
    #[must_use]
    pub fn samples(&self) -> u32 {
        let Data::Wave(wave) = self else { return 1 };
        let count = wave.samples.len() / wave.channels.max(1) as usize;
        u32::try_from(count).unwrap_or(u32::MAX).max(1)
    }

    /// The same data with their texts [cut and cleaned](crate::text); messages of other programs stay unchanged.
    #[must_use]
    pub fn cleaned(self) -> Data {
        match self {
            Data::Event(event) if !text::is_clean(&event.label, LONGEST_LABEL) => {
                let mut event = Arc::unwrap_or_clone(event);
                event.label = text::label(event.label, LONGEST_LABEL);
                Data::Event(Arc::new(event))
            }
            Data::Status(status) if !status.is_clean() => {
                let mut status = Arc::unwrap_or_clone(status);
                status.name = text::name(status.name, 2 * LONGEST_NAME);
                status.reason = text::label(status.reason, LONGEST_LABEL);
                Data::Status(Arc::new(status))
            }
            // A stream is cleaned where it is declared or decoded.
            other => other,
        }
    }
}

/// A run of samples with one period, such as those in one notification of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// The time from one sample to the next [ns].
    pub period_ns: f64,
    /// The number of channels in each sample.
    pub channels: u32,
    /// The values, sample by sample and channel by channel; a whole number of samples.
    pub samples: Arc<[f64]>,
}

impl Wave {
    /// Whether the wave can be timed and recorded: its period is a valid duration, and its samples are complete.
    pub fn is_valid(&self) -> bool {
        let width = self.channels as usize;
        let is_whole = width > 0 && self.samples.len().is_multiple_of(width);
        self.period_ns.is_finite() && self.period_ns >= 0.0 && is_whole
    }
}

/// The values of a feature over one window, in the order of its stream's channels.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureValues {
    /// Length of the window [s].
    pub window_secs: f64,
    /// The share of the window with data [0..1].
    pub coverage: f32,
    /// The quality of the data [0..1].
    pub quality: f32,
    /// A value for each channel; NaN exactly where `reasons` is not [`Reason::Ok`].
    pub values: Vec<f64>,
    /// The standard uncertainty of each value, in its unit; empty when none can be stated.
    pub sigmas: Vec<f64>,
    /// Why a value is missing, for each channel.
    pub reasons: Vec<Reason>,
}

/// Why a feature has no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Reason {
    /// There is a value.
    Ok = 0,
    /// The window is not yet full enough.
    Short = 1,
    /// Data are missing inside the window.
    Gap = 2,
    /// The quality of the data is too low.
    Quality = 3,
    /// The input does not contain this quantity.
    Missing = 4,
    /// The formula is undefined for these data.
    Undefined = 5,
    /// No baseline has ended yet, so there is nothing to compare with.
    NoBaseline = 6,
    /// The event has not happened or is over, or the window contains nothing to measure, such as no speech.
    Nothing = 7,
    /// The baseline is too short to estimate how much its values vary.
    BriefBaseline = 8,
}

impl Reason {
    /// Every reason, in the order of their codes.
    pub const ALL: [Reason; 9] = [
        Self::Ok,
        Self::Short,
        Self::Gap,
        Self::Quality,
        Self::Missing,
        Self::Undefined,
        Self::NoBaseline,
        Self::Nothing,
        Self::BriefBaseline,
    ];

    /// The reason with this code on the wire; `None` for an unknown code.
    pub fn from_code(code: u8) -> Option<Reason> {
        Self::ALL.get(usize::from(code)).copied()
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Reason::Ok => "ok",
            Reason::Short => "window too short",
            Reason::Gap => "data missing in the window",
            Reason::Quality => "data too poor",
            Reason::Missing => "not measured by this device",
            Reason::Undefined => "undefined for these data",
            Reason::NoBaseline => "no baseline yet to compare with",
            Reason::Nothing => "there is none",
            Reason::BriefBaseline => "baseline too short to compare with",
        })
    }
}

/// Something that happened at one time, or over a span of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The kind of event.
    pub kind: EventKind,
    /// The label: the name of the phase, the text of the marker, the stream with the fault.
    pub label: String,
    /// The value; NaN if there is none.
    pub value: f64,
    /// The duration [s]; 0 if instantaneous, NaN where unknown.
    pub duration_secs: f64,
}

words! {
    /// The kinds of events.
    EventKind {
        /// A phase of the study begins; the phase named `baseline` is the reference.
        Phase = "phase",
        /// A mark set by a person or a program.
        Marker = "marker",
        /// A self-report.
        Report = "report",
        /// A heartbeat.
        Beat = "beat",
        /// A skin conductance response.
        Response = "response",
        /// A breath.
        Breath = "breath",
        /// A burst of muscle activity.
        Burst = "burst",
        /// A blink.
        Blink = "blink",
        /// A person intervenes and commands a robot.
        Intervention = "intervention",
        /// A command to the session; see [`Accepted`](crate::command::Accepted).
        Command = "command",
        /// Something went wrong.
        Fault = "fault",
        /// A clock stepped or restarted, or the session ended.
        Clock = "clock",
    }
}
