//! Band-pass filtering of a PPG.

use crate::error::{SignalError, checked, checked_rate_hz};
use crate::filter::{Design, butterworth, zero_phase};

/// The band of pulse waves [Hz] (Elgendi et al. 2013).
pub const BAND_HZ: (f64, f64) = (0.5, 8.0);
/// Order of the Butterworth filter.
const ORDER: u32 = 2;
/// The high-pass cut-off of the causal detector [Hz].
const QUICK_LOW_HZ: f64 = 0.7;
/// The rates that resolve a pulse wave without needless cost [Hz].
const RATES_HZ: (f64, f64) = (20.0, 2000.0);

/// The band-pass filter for a PPG at 20 to 2000 Hz: Butterworth of order 2, 0.5 to 8 Hz.
///
/// With a settled [`Cascade`](crate::filter::Cascade) it is causal, and distorts pulse waves: slow components come
/// early, fast ones up to 30 ms late. [`clean`] does not distort them.
pub fn band_pass(rate_hz: f64) -> Result<Design, SignalError> {
    butterworth::band_pass(ORDER, BAND_HZ.0, BAND_HZ.1, checked_ppg_rate_hz(rate_hz)?)
}

/// Filters a whole PPG to 0.5 to 8 Hz, without delay: SciPy's `sosfiltfilt` of the [filter](band_pass).
///
/// Returns an error for a rate outside 20 to 2000 Hz, when no sample is a usable number, or with fewer than 16
/// samples.
pub fn clean(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    zero_phase(&band_pass(rate_hz)?, signal)
}

/// The filter of the causal detector: the same low-pass, and a first-order high-pass at 0.7 Hz. A high-pass of order 2
/// at 0.5 Hz undershoots after each pulse, which would hide a weak pulse soon after.
pub(super) fn quick_band(rate_hz: f64) -> Result<Design, SignalError> {
    let slow = butterworth::high_pass(1, QUICK_LOW_HZ, rate_hz)?;
    butterworth::low_pass(ORDER, BAND_HZ.1, rate_hz)?.then(&slow)
}

pub(super) fn checked_ppg_rate_hz(rate_hz: f64) -> Result<f64, SignalError> {
    checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)
}
