/// A quantity that a device measures under one name. It is output before the first [`Reading`], and again when a scale
/// or rate changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The name that readings refer to, such as `ecg`.
    pub name: &'static str,
    /// The channels, in the order of the values of a sample.
    pub channels: Vec<Channel>,
    /// The nominal sampling rate \[Hz\]; `None` if irregular. Measure the true rate.
    pub rate_hz: Option<f64>,
    /// Whether device times are from a clock in the device. Otherwise there are none, or they are stamps of a program
    /// that passed on the samples.
    pub has_clock: bool,
    /// Whether the clock of this stream is the beats that the device reports: the stream holds the intervals between
    /// them, or is sent together with them. False for a value that is merely derived from beats.
    pub by_beats: bool,
    /// Whether a reading may hold several samples with one period, as in a notification.
    pub in_runs: bool,
}

impl Stream {
    /// Creates a stream of single, irregular samples from a device without a clock.
    pub const fn irregular(name: &'static str, channels: Vec<Channel>) -> Self {
        Self { name, channels, rate_hz: None, has_clock: false, by_beats: false, in_runs: false }
    }
}

/// One value of each sample of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The quantity, such as `x` or `conductance`.
    pub name: &'static str,
    /// The unit of `raw * scale` in ASCII (`uV`, `1/min`); empty for a pure number.
    pub unit: &'static str,
    /// One step of the raw value in `unit`.
    pub scale: f64,
}

impl Channel {
    /// Creates a channel whose raw values are in `unit` already.
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit, scale: 1.0 }
    }

    /// Returns the same channel with raw values whose step is `scale` units.
    #[must_use]
    pub const fn scaled(self, scale: f64) -> Self {
        Self { scale, ..self }
    }
}

/// Samples of one stream that arrived together.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The name of the [`Stream`].
    pub stream: &'static str,
    /// The number of samples before the first one of this reading since the session was created, including samples
    /// known to be lost, so that a jump is a gap of that length. (The index of a `teampulse_core::source::Reading`, in
    /// contrast, counts readings.)
    pub index: u64,
    /// The device's clock at the first sample \[ns\], since an epoch that the device's module documents; `None` if the
    /// device has no clock.
    pub device_time_ns: Option<i64>,
    /// The time from one sample to the next by the device's clock \[ns\]; `None` if samples are irregular or the device
    /// has no clock.
    pub period_ns: Option<f64>,
    /// Raw values as the device sent them, sample by sample, each with all channels. Integers of up to 53 bits are
    /// exact. NaN means that the device reported no value.
    pub values: Vec<f64>,
}

impl Reading {
    /// Creates a reading of a device without a clock.
    pub(crate) fn untimed(stream: &'static str, index: u64, values: Vec<f64>) -> Self {
        Self { stream, index, device_time_ns: None, period_ns: None, values }
    }
}
