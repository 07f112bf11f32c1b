//! Clock models: when a sample was measured, by the session's clock, and with what uncertainty.
//!
//! Each device (or computer) with a clock has one model, shared by all of its streams. A model depends only
//! on the stamps and ticks it has received so far.

mod host;
mod latency;
mod interval;
mod counter;
mod fit;
mod straight;
mod envelope;
mod line;
mod trains;
mod comb;
mod beat;
mod epoch;
mod one_way;
mod rate;
mod sample_index;
mod smooth;
#[cfg(test)]
mod simulated;
mod event;
mod remote;

pub use counter::Counter;
pub use event::ClockEvent;
pub use host::Host;
pub use interval::ConnectionInterval;
pub use latency::{DEVICES, KnownDevice, Latency};
pub use one_way::{OneWay, OneWaySettings};
pub use remote::Remote;
pub use sample_index::SampleIndex;
pub use smooth::{Smoothed, Smoother};

/// The timestamps of one reading: a single sample, or a batch of samples that arrived together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamps {
    /// The device's own clock at the first sample [ns], as the device reported it; `None` when it has none.
    pub device: Option<i64>,
    /// The timestamp that the source put on the first sample [ns since the Unix epoch]; `None` without one.
    pub source: Option<i64>,
    /// What the source's timestamp refers to.
    pub stamp_of: StampOf,
    /// When the reading arrived, by the session's clock [ns since the Unix epoch].
    pub arrival: i64,
    /// The stream of the source that the reading belongs to.
    pub stream: u32,
    /// The index of the first sample in its stream, counting lost samples.
    pub index: u64,
    /// The number of samples in the batch; at least one.
    pub count: u32,
    /// The sampling period within the batch, by the device's clock or nominal [ns]; 0 for a single sample.
    pub period_nanos: f64,
}

impl Stamps {
    /// The stamps of a single sample for which only the arrival time is known.
    pub fn arrived(arrival: i64) -> Stamps {
        Stamps {
            device: None,
            source: None,
            stamp_of: StampOf::Sent,
            arrival,
            stream: 0,
            index: 0,
            count: 1,
            period_nanos: 0.0,
        }
    }

    /// The time from the first to the last sample of the batch [ns].
    pub fn span_nanos(&self) -> f64 {
        f64::from(self.count.saturating_sub(1)) * self.period_nanos
    }
}

/// What a source's timestamp refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampOf {
    /// When the message was sent, or slightly earlier: the fastest messages arrive almost immediately.
    Sent,
    /// When a device took the measurement, by its computer's clock: the delay until the arrival may be long and
    /// constant.
    Measured,
    /// When something happened that was stored for late joiners.
    Kept,
}

/// A reading placed in session time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// When its first sample was measured, by the session's clock [ns since the Unix epoch].
    pub measured: i64,
    /// The sampling period within the batch, by the session's clock [ns].
    pub period_nanos: f64,
    /// Whether the timestamp was rejected and the arrival time used instead.
    pub disbelieved: bool,
}

/// The current estimate of a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockState {
    /// How the clock is modelled.
    pub kind: ClockKind,
    /// The number of times that the clock has been reset or restarted.
    pub epoch: u32,
    /// The clock's offset, positive when ahead of the session's clock [s]; NaN where unknown.
    pub offset_secs: f64,
    /// The clock's rate error relative to the session's clock, positive when fast [ppm]; NaN where unknown.
    pub skew_ppm: f64,
    /// The standard deviation of delays around their lower envelope [s]; NaN where unknown.
    pub jitter_secs: f64,
    /// Half the width of the 95 % interval of a sample's true time [s]; NaN where unknown.
    pub uncertainty_secs: f64,
}

/// How a clock is modelled. The discriminants appear in recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ClockKind {
    /// The source uses this host's clock, or no timestamps at all.
    Host = 0,
    /// A device's timestamps compared with their arrival times.
    OneWay = 1,
    /// Another computer's timestamps, and round-trip probes of its clock.
    TwoWay = 2,
    /// No clock: a constant rate and numbered samples.
    SampleIndex = 3,
    /// Another computer's timestamps compared with their arrival times.
    Remote = 4,
}

/// One round-trip measurement of another computer's clock, as seen by the requester.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// When the reply arrived, by the session's clock [ns since the Unix epoch].
    pub arrival: i64,
    /// The offset of the other clock, positive when ahead, assuming a symmetric path [s].
    pub offset_secs: f64,
    /// The round-trip time, excluding the processing time at the other end [s].
    pub round_trip_secs: f64,
}

/// A model of the clock of a device or computer.
pub trait ClockModel: Send {
    /// Places the next reading in session time.
    fn correct(&mut self, stamps: &Stamps) -> Corrected;

    /// Takes the result of a round-trip probe of this clock.
    fn probe(&mut self, _probe: &Probe) {}

    /// Advances session time to `now` [ns]; everything that arrived earlier has been passed to the model.
    fn tick(&mut self, _now: i64) {}

    /// The current estimate of the clock.
    fn state(&self) -> ClockState;

    /// The oldest clock event that has not been reported yet; `None` when there is none.
    fn next_event(&mut self) -> Option<ClockEvent> {
        None
    }
}
