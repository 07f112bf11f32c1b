//! A PPG without drift and noise.

use crate::error::{SignalError, checked, checked_rate_hz};
use crate::filter::{Design, butterworth, zero_phase};

/// Where pulse waves have their power [Hz] (Elgendi et al. 2013).
pub const BAND_HZ: (f64, f64) = (0.5, 8.0);
/// Order of the Butterworth filter.
const ORDER: u32 = 2;
/// The lower edge for the causal detector [Hz].
const QUICK_LOW_HZ: f64 = 0.7;
/// Rates at which a pulse wave is resolved well enough, without needless cost [Hz].
const RATES_HZ: (f64, f64) = (20.0, 2000.0);

/// The band-pass filter for a PPG at 20 to 2000 Hz: Butterworth of second order, 0.5 to 8 Hz.
///
/// Run by a settled [`Cascade`](crate::filter::Cascade) it is causal, and changes the shape of pulse
/// waves: what is slow comes early, what is fast up to 30 ms late. [`clean`] has no such changes.
pub fn band_pass(rate_hz: f64) -> Result<Design, SignalError> {
    butterworth::band_pass(ORDER, BAND_HZ.0, BAND_HZ.1, checked_ppg_rate_hz(rate_hz)?)
}

/// A whole PPG between 0.5 and 8 Hz, without delay: SciPy's `sosfiltfilt` of the [filter](band_pass).
///
/// An error when the rate does not lie between 20 and 2000 Hz, when no sample is a usable number, or
/// with fewer than 16 samples.
pub fn clean(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    zero_phase(&band_pass(rate_hz)?, signal)
}

/// What the causal detector looks at: the same low-pass filter, and a high-pass filter of first order
/// at 0.7 Hz. One of second order at 0.5 Hz swings below the mean after each pulse, where a weak pulse
/// soon after would be lost.
pub(super) fn quick_band(rate_hz: f64) -> Result<Design, SignalError> {
    let slow = butterworth::high_pass(1, QUICK_LOW_HZ, rate_hz)?;
    butterworth::low_pass(ORDER, BAND_HZ.1, rate_hz)?.then(&slow)
}

pub(super) fn checked_ppg_rate_hz(rate_hz: f64) -> Result<f64, SignalError> {
    checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)
}
