//! The clock model of a device without a clock.

use super::one_way::{OneWay, OneWaySettings};
use super::{ClockKind, ClockModel, ClockState, Corrected, Latency, News, Stamps};

/// How much the true rates of such devices differ from their nominal ones (standard deviation)
/// [ppm]: a Polar H10 is within 2 % at room temperature, others within 5 %.
const USUAL_SKEW_PPM: f64 = 10_000.0;

/// No clock: a steady rate, and numbered samples.
///
/// The samples' numbers, at the nominal rate, stand in for the device's time; their true rate is
/// estimated from arrivals. A jump in the numbers is a gap in time. A pause that the numbers do not
/// show begins a new epoch.
#[derive(Clone, Debug)]
pub struct SampleIndex {
    period_nanos: f64,
    clock: OneWay,
}

impl SampleIndex {
    /// A stream of nominally `rate_hz` samples a second. Without a usable rate, readings are placed
    /// at their arrival, less the latency.
    pub fn new(rate_hz: f64, latency: Latency) -> SampleIndex {
        let usable = rate_hz.is_finite() && rate_hz > 0.0;
        let settings =
            OneWaySettings { usual_skew_ppm: USUAL_SKEW_PPM, ..OneWaySettings::new(latency) };
        let period_nanos = if usable { 1e9 / rate_hz } else { f64::NAN };
        SampleIndex { period_nanos, clock: OneWay::new(settings) }
    }

    /// The true rate as far as it is known [Hz].
    pub fn rate_hz(&self) -> f64 {
        let skew = self.clock.state().skew_ppm * 1e-6;
        1e9 / self.period_nanos * if skew.is_nan() { 1.0 } else { 1.0 + skew }
    }

    fn by_number(&self, stamps: &Stamps) -> Stamps {
        let device = (stamps.index as f64 * self.period_nanos).round();
        let device = (device < 9e18).then_some(device as i64);
        Stamps { device, period_nanos: self.period_nanos, ..*stamps }
    }
}

impl ClockModel for SampleIndex {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        if self.period_nanos.is_nan() {
            return self.clock.arrived(&Stamps { device: None, ..*stamps });
        }
        let stamps = self.by_number(stamps);
        self.clock.correct(&stamps)
    }

    fn state(&self) -> ClockState {
        self.clock.state_as(ClockKind::SampleIndex)
    }

    fn news(&mut self) -> Option<News> {
        self.clock.news()
    }
}
