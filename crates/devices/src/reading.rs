/// What a device measures under one name: the description that comes before the first [`Reading`],
/// and again when a scale or a rate changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The name that readings refer to, such as `ecg`.
    pub name: &'static str,
    /// The values of one sample, in order.
    pub channels: Vec<Channel>,
    /// Nominal samples per second; `None` if irregular. Measure the true rate.
    pub rate_hz: Option<f64>,
    /// Whether device times are from a clock in the device; otherwise there are none, or they are stamps of a program
    /// that passed the samples on.
    pub has_clock: bool,
    /// Whether the beats that the device reports are the clock of this stream: it holds the intervals between them, or
    /// it is sent together with them. False for a value that is merely derived from beats.
    pub by_beats: bool,
    /// Whether a reading holds several samples with one period, as in a notification.
    pub in_runs: bool,
}

impl Stream {
    /// A stream of single, irregular samples from a device without a clock.
    pub const fn irregular(name: &'static str, channels: Vec<Channel>) -> Self {
        Self { name, channels, rate_hz: None, has_clock: false, by_beats: false, in_runs: false }
    }
}

/// One value of each sample of a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// What is measured, such as `x` or `conductance`.
    pub name: &'static str,
    /// The unit of `raw * scale` in ASCII (`uV`, `1/min`); empty for a pure number.
    pub unit: &'static str,
    /// One step of the raw value in `unit`.
    pub scale: f64,
}

impl Channel {
    /// A channel whose raw values are in `unit` already.
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit, scale: 1.0 }
    }

    /// The same channel with raw values whose step is `scale` units.
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
    /// The number of the first sample since the session was created: it counts samples, and not readings as the index of
    /// a reading of a session (`teampulse_core::source::Reading`) does. Samples known to be lost are counted, so a jump
    /// is a gap of that length.
    pub index: u64,
    /// The device's own clock at the first sample \[ns\], since an epoch that the device's module
    /// documents; `None` where the device has no clock.
    pub device_time_ns: Option<i64>,
    /// From one sample to the next by the device's clock \[ns\]; `None` where samples are irregular
    /// or the device has no clock.
    pub period_ns: Option<f64>,
    /// Raw values as the device sent them, sample by sample, each with all channels. Integers of up
    /// to 53 bits are exact. NaN where the device said that it has no value.
    pub values: Vec<f64>,
}

impl Reading {
    /// A reading of a device without a clock.
    pub(crate) fn untimed(stream: &'static str, index: u64, values: Vec<f64>) -> Self {
        Self { stream, index, device_time_ns: None, period_ns: None, values }
    }
}
