//! Units of acceleration.

use crate::error::{SignalError, checked, checked_rate_hz};

/// The slowest and fastest supported rates [Hz]; activity extends to 2.5 Hz.
pub const RATES_HZ: (f64, f64) = (8.0, 10_000.0);

/// The unit of an accelerometer's readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Unit {
    /// Standard gravity.
    #[default]
    G,
    /// m/s².
    MetresPerSecondSquared,
    /// Raw readings, with the number of steps per g: 64 on an Empatica E4.
    StepsPerG(f64),
}

impl Unit {
    /// Readings in g.
    pub fn in_g(self, axes: [f64; 3]) -> [f64; 3] {
        axes.map(|axis| axis / self.one_g())
    }

    /// The reading for 1 g.
    pub fn one_g(self) -> f64 {
        match self {
            Unit::G => 1.0,
            Unit::MetresPerSecondSquared => 9.806_65,
            Unit::StepsPerG(steps) => steps,
        }
    }

    pub(super) fn checked(self) -> Result<Unit, SignalError> {
        checked("readings for 1 g", self.one_g(), (1e-9, 1e9)).map(|_| self)
    }
}

/// The rate, if acceleration can be analysed at this rate.
pub(super) fn checked_rate(rate_hz: f64) -> Result<f64, SignalError> {
    checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)
}
