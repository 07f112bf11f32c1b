//! The contents of a file: signals of one device, on the device's own clock.

use crate::date::StatedDate;
use crate::error::FormatError;

/// The most numbers that are read from a file: eleven days of all signals of an E4, or an hour of 64 channels
/// at 256 Hz; 512 MB.
pub const MOST_VALUES: usize = 64 << 20;

/// The signals in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The device, as a lower-case word: `empatica_e4`; empty if the file does not state it.
    pub device: String,
    /// Whether times count from 1970, by the device's clock; otherwise they count from the start of the recording, or
    /// from an origin that only the writer of the file knows.
    pub is_dated: bool,
    /// The date of time zero for times that do not count from 1970, if the file states it.
    pub date: Option<StatedDate>,
    /// The signals, in the order of the file.
    pub signals: Vec<Signal>,
    /// Choices made in reading the file, and what was skipped.
    pub notes: Vec<String>,
}

/// A signal of the recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// The signal's name in the file.
    pub name: String,
    /// The measured quantity.
    pub quantity: Quantity,
    /// The numbers of each sample; empty for marks.
    pub channels: Vec<Channel>,
    /// The nominal rate [Hz]; 0 if each sample has its own time.
    pub rate_hz: f64,
    /// The samples.
    pub content: Content,
}

/// A channel: one number of each sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The channel's name.
    pub name: String,
    /// The channel's unit, as spelt in the file; empty if it is not stated.
    pub unit: String,
}

/// The measured quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// An electrocardiogram.
    Ecg,
    /// A photoplethysmogram.
    Ppg,
    /// Skin conductance.
    Eda,
    /// Electromyograms.
    Emg,
    /// Electroencephalograms.
    Eeg,
    /// Breathing.
    Respiration,
    /// The temperature of the skin.
    Temperature,
    /// Acceleration.
    Acceleration,
    /// Intervals between heartbeats; a sample's time is the end of its interval.
    Interval,
    /// Marks, such as the presses of a button.
    Mark,
    /// Any other quantity.
    Other,
}

/// The samples of a signal.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Evenly spaced samples, with a new run after each gap.
    Even(Vec<Run>),
    /// Samples, each with its own time.
    Uneven {
        /// The time of each sample [ns].
        at_ns: Vec<i64>,
        /// The values, sample by sample, with all channels of each.
        values: Vec<f64>,
    },
    /// Times, each with a text.
    Marks(Vec<Mark>),
}

/// Evenly spaced samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The time of the first sample [ns].
    pub start_ns: i64,
    /// The time between two samples [ns].
    pub period_ns: f64,
    /// The values, sample by sample, with all channels of each; NaN for a missing number.
    pub samples: Vec<f64>,
}

/// A time with a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mark {
    /// When the mark begins [ns].
    pub at_ns: i64,
    /// How long the mark lasts [ns]; 0 for a moment.
    pub duration_ns: i64,
    /// The text.
    pub label: String,
}

impl Mark {
    /// Creates a mark without a duration.
    pub(crate) fn new(at_ns: i64, label: impl Into<String>) -> Mark {
        Mark { at_ns, duration_ns: 0, label: label.into() }
    }
}

impl Channel {
    /// Creates a channel.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Channel {
        Channel { name: name.into(), unit: unit.into() }
    }
}

impl Content {
    /// The time of the first sample [ns]; `None` if there are none.
    pub fn first_ns(&self) -> Option<i64> {
        match self {
            Content::Even(runs) => runs.iter().map(|run| run.start_ns).min(),
            Content::Uneven { at_ns, .. } => at_ns.iter().min().copied(),
            Content::Marks(marks) => marks.iter().map(|mark| mark.at_ns).min(),
        }
    }
}

impl Signal {
    /// Creates an evenly sampled signal.
    pub(crate) fn even(
        name: &str,
        quantity: Quantity,
        channels: Vec<Channel>,
        rate_hz: f64,
        runs: Vec<Run>,
    ) -> Signal {
        Signal { name: name.into(), quantity, channels, rate_hz, content: Content::Even(runs) }
    }

    /// Creates a signal of marks.
    pub(crate) fn marks(name: &str, marks: Vec<Mark>) -> Signal {
        let content = Content::Marks(marks);
        let (quantity, channels) = (Quantity::Mark, Vec::new());
        Signal { name: name.into(), quantity, channels, rate_hz: 0.0, content }
    }

    /// Whether the signal has no samples.
    pub fn is_empty(&self) -> bool {
        match &self.content {
            Content::Even(runs) => runs.iter().all(|run| run.samples.is_empty()),
            Content::Uneven { at_ns, .. } => at_ns.is_empty(),
            Content::Marks(marks) => marks.is_empty(),
        }
    }
}

/// Fails if there are too many numbers to read.
pub(crate) fn bounded(values: usize) -> Result<(), FormatError> {
    if values > MOST_VALUES { Err(FormatError::TooLarge) } else { Ok(()) }
}

/// Converts seconds to nanoseconds, with a precision of a microsecond for dates; `None` if out of range.
pub(crate) fn nanos(secs: f64) -> Option<i64> {
    // Whole seconds and the fraction are converted separately, as a date in nanoseconds has more digits than an `f64`
    // holds.
    let (whole, fraction) = (secs.trunc(), (secs.fract() * 1e9).round());
    (whole.abs() < 9.2e9).then(|| whole as i64 * 1_000_000_000 + fraction as i64)
}
