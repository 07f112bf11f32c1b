//! Clock models: when a sample was measured, by the session's clock, and how sure that is.
//!
//! There is one model for each device (or computer) that has a clock, shared by all of its
//! streams. A model is a function of the stamps that it was given so far, and of ticks.

mod host;
mod latency;
mod interval;
mod counter;
mod fit;
mod straight;
mod envelope;
mod line;
mod trains;
mod beat;
mod epoch;
mod one_way;
mod rate;
mod sample_index;
mod smooth;
#[cfg(test)]
mod simulated;
mod news;
mod remote;

pub use counter::Counter;
pub use host::Host;
pub use interval::ConnectionInterval;
pub use latency::{DEVICES, KnownDevice, Latency};
pub use news::News;
pub use one_way::{OneWay, OneWaySettings};
pub use remote::Remote;
pub use sample_index::SampleIndex;
pub use smooth::{Smoothed, Smoother};

/// The stamps of one reading: of one sample, or of a batch that came at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamps {
    /// The device's own clock at the first sample [ns], as the device gave it; `None` when it has
    /// none.
    pub device: Option<i64>,
    /// The stamp that its source put on the first sample [ns since the Unix epoch]; `None` when it
    /// put none.
    pub source: Option<i64>,
    /// What that stamp says.
    pub says: Says,
    /// When the reading arrived, by the session's clock [ns since the Unix epoch].
    pub arrival: i64,
    /// Which of its source's streams it belongs to.
    pub stream: u32,
    /// The number of the first sample among all samples of its stream, lost ones counted.
    pub index: u64,
    /// How many samples came at once; at least one.
    pub count: u32,
    /// From one sample of the batch to the next, by the device's clock or nominally [ns]; 0 for a
    /// single sample.
    pub period_nanos: f64,
}

impl Stamps {
    /// The stamps of a single sample that only arrived.
    pub fn arrived(arrival: i64) -> Stamps {
        Stamps {
            device: None,
            source: None,
            says: Says::Sent,
            arrival,
            stream: 0,
            index: 0,
            count: 1,
            period_nanos: 0.0,
        }
    }

    /// From the first to the last sample of the batch [ns].
    pub fn span_nanos(&self) -> f64 {
        f64::from(self.count.saturating_sub(1)) * self.period_nanos
    }
}

/// What a source's stamp says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Says {
    /// When it was sent, or little before: the fastest messages arrive at once.
    Sent,
    /// When a device measured it, as its computer has it: its way there may have been long, and the same for
    /// all.
    Measured,
    /// When something happened that was kept for those who join later.
    Kept,
}

/// A reading's place in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// When its first sample was measured, by the session's clock [ns since the Unix epoch].
    pub measured: i64,
    /// From one sample of the batch to the next, by the session's clock [ns].
    pub period_nanos: f64,
    /// Whether its stamp could not be believed, so that its arrival stands in.
    pub disbelieved: bool,
}

/// What is known of a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockState {
    /// How it is modelled.
    pub kind: ClockKind,
    /// How often it has begun anew.
    pub epoch: u32,
    /// How far it is ahead of the session's clock [s]; NaN where unknown.
    pub offset_secs: f64,
    /// How much faster than the session's clock it runs [ppm]; NaN where unknown.
    pub skew_ppm: f64,
    /// The spread of delays around their lower envelope, as a standard deviation [s]; NaN where
    /// unknown.
    pub jitter_secs: f64,
    /// Half the width of the interval that holds the true time of a sample with a probability of
    /// 95 % [s]; NaN where unknown.
    pub uncertainty_secs: f64,
}

/// How a clock is modelled. The numbers stand in recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ClockKind {
    /// The source stamps by this host's clock, or not at all.
    Host = 0,
    /// A device's ticks against their arrival.
    OneWay = 1,
    /// Another computer's stamps, and probes that went there and back.
    TwoWay = 2,
    /// No clock: a steady rate and numbered samples.
    SampleIndex = 3,
    /// Another computer's stamps against their arrival.
    Remote = 4,
}

/// One exchange with another computer's clock, as its caller saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// When the reply arrived, by the session's clock [ns since the Unix epoch].
    pub arrival: i64,
    /// How far the other clock was ahead, half the way there and half the way back assumed [s].
    pub offset_secs: f64,
    /// How long the exchange took, without the time spent over there [s].
    pub round_trip_secs: f64,
}

/// A clock of a device or a computer, as it is modelled.
pub trait ClockModel: Send {
    /// The place in time of the next reading.
    fn correct(&mut self, stamps: &Stamps) -> Corrected;

    /// An exchange with this clock has ended.
    fn probe(&mut self, _probe: &Probe) {}

    /// Time passes: it is `now`, and all that arrived before was handed over.
    fn tick(&mut self, _now: i64) {}

    /// What is known of the clock.
    fn state(&self) -> ClockState;

    /// What happened to the clock since the last call, oldest first; `None` when all is reported.
    fn news(&mut self) -> Option<News> {
        None
    }
}
