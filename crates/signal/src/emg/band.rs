//! The EMG band and its envelope.

use crate::error::{SignalError, checked, checked_rate_hz};
use crate::filter::{Cascade, Design, apply_zero_phase, butterworth};
use crate::gaps::is_usable;

/// The slowest and fastest supported rates [Hz].
pub const RATES_HZ: (f64, f64) = (100.0, 10_000.0);
/// The band of muscle activity [Hz], as far as the rate permits.
const LOW_HZ: f64 = 20.0;
const HIGH_HZ: f64 = 450.0;
/// The highest cut-off, as a share of the Nyquist frequency.
const MOST_OF_NYQUIST: f64 = 0.95;
const ORDER: u32 = 4;
/// The cut-off of the envelope [Hz].
const ENVELOPE_HZ: f64 = 6.0;
const ENVELOPE_ORDER: u32 = 2;
/// The frequency of most EMG power [Hz], at which the delay is taken.
const USUAL_HZ: f64 = 80.0;

/// The band of muscle activity: Butterworth, order 4, from 20 Hz to the lesser of 450 Hz and 95 % of the
/// Nyquist frequency.
///
/// Returns an error for a rate outside [`RATES_HZ`].
pub fn band(rate_hz: f64) -> Result<Design, SignalError> {
    let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
    let high_hz = HIGH_HZ.min(rate_hz / 2.0 * MOST_OF_NYQUIST);
    butterworth::band_pass(ORDER, LOW_HZ, high_hz, rate_hz)
}

/// The filter of the rectified signal: Butterworth low-pass, order 2, 6 Hz.
pub fn envelope_filter(rate_hz: f64) -> Result<Design, SignalError> {
    let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
    butterworth::low_pass(ENVELOPE_ORDER, ENVELOPE_HZ, rate_hz)
}

/// Filters a whole recording to the [band](band()), without delay: mean removed, then filtered forwards and backwards.
///
/// Samples that are not [usable](is_usable) are bridged. Returns an error for a rate outside [`RATES_HZ`], a
/// recording of fewer than 28 samples, or one without a usable number.
pub fn clean(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    let band = band(rate_hz)?;
    let usable = || signal.iter().filter(|&&sample| is_usable(sample));
    let mean = usable().sum::<f64>() / usable().count().max(1) as f64;
    let mut clean: Vec<f64> = signal.iter().map(|sample| sample - mean).collect();
    apply_zero_phase(&band, &mut clean)?;
    Ok(clean)
}

/// Computes the envelope of a [cleaned](clean) recording, without delay: rectified, then low-passed at 6 Hz forwards
/// and backwards, never negative. In the unit of the signal; its mean is the mean absolute value.
pub fn envelope(clean: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    let mut envelope: Vec<f64> = clean.iter().map(|sample| sample.abs()).collect();
    apply_zero_phase(&envelope_filter(rate_hz)?, &mut envelope)?;
    for height in &mut envelope {
        *height = height.max(0.0);
    }
    Ok(envelope)
}

/// Computes the band and the envelope of a signal, sample by sample.
///
/// Independent of chunking; no sample allocates. A sample that is not usable repeats the one before; before
/// the first usable one, both outputs are zero.
#[derive(Clone, Debug)]
pub struct Cleaner {
    band: Cascade,
    envelope: Cascade,
    delay_secs: f64,
}

impl Cleaner {
    /// Creates the filters for a rate; an error outside [`RATES_HZ`].
    pub fn new(rate_hz: f64) -> Result<Cleaner, SignalError> {
        let (band, envelope) = (band(rate_hz)?, envelope_filter(rate_hz)?);
        let usual_hz = USUAL_HZ.min(rate_hz / 4.0);
        let delay_secs = band.group_delay_secs(usual_hz) + envelope.group_delay_secs(0.0);
        let (band, envelope) = (Cascade::settled(&band), Cascade::at_rest(&envelope));
        Ok(Cleaner { band, envelope, delay_secs })
    }

    /// The delay of the envelope [s], about 45 ms.
    pub fn delay_secs(&self) -> f64 {
        self.delay_secs
    }

    /// Takes in the next sample; returns the band-passed sample and the envelope.
    pub fn push(&mut self, sample: f64) -> (f64, f64) {
        let band = self.band.push(sample);
        let band = if band.is_nan() { 0.0 } else { band };
        (band, self.envelope.push(band.abs()).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_band_ends_at_450_hz_or_before_half_the_rate() {
        let gain = |rate_hz: f64, at_hz: f64| band(rate_hz).unwrap().gain(at_hz);
        for (rate_hz, high_hz) in [(200.0, 95.0), (1000.0, 450.0), (4000.0, 450.0)] {
            assert!((gain(rate_hz, 20.0) - 0.5f64.sqrt()).abs() < 1e-9);
            assert!((gain(rate_hz, high_hz) - 0.5f64.sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn other_rates_are_refused() {
        for rate_hz in [0.0, 1e-9, 99.0, 10_001.0, 1e9, f64::NAN, f64::INFINITY] {
            assert!(band(rate_hz).is_err() && envelope_filter(rate_hz).is_err());
            assert!(Cleaner::new(rate_hz).is_err() && clean(&[0.0; 100], rate_hz).is_err());
        }
    }

    #[test]
    fn the_envelope_of_an_oscillation_is_its_mean_absolute_value() {
        let wave = |k: u32| 3.0 * (TAU * 80.0 * f64::from(k) / 1000.0).sin();
        let clean: Vec<f64> = (0..2000).map(wave).collect();
        let envelope = envelope(&clean, 1000.0).unwrap();
        assert!((envelope[1000] - 3.0 * 2.0 / std::f64::consts::PI).abs() < 0.01);
    }

    #[test]
    fn the_envelope_is_as_late_as_stated() {
        let mut cleaner = Cleaner::new(1000.0).unwrap();
        let burst = |k: u32| (-((f64::from(k) - 1000.0) / 150.0).powi(2)).exp();
        let wave = |k: u32| burst(k) * (TAU * 80.0 * f64::from(k) / 1000.0).sin();
        let envelope: Vec<f64> = (0..2000).map(|k| cleaner.push(wave(k)).1).collect();
        let sum: f64 = envelope.iter().sum();
        let centre = envelope.iter().enumerate().map(|(k, v)| k as f64 * v).sum::<f64>() / sum;
        assert!((centre - 1000.0 - 1000.0 * cleaner.delay_secs()).abs() < 1.0, "{centre}");
    }
}
