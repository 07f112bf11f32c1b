//! The breathing band.

use crate::error::{SignalError, checked, checked_rate_hz};
use crate::filter::{Design, butterworth, zero_phase};

/// The rates that resolve breaths without needless cost [Hz].
pub const RATES_HZ: (f64, f64) = (5.0, 2000.0);
/// From 3 to 180 breaths a minute, as in NeuroKit2 [Hz].
const BAND_HZ: (f64, f64) = (0.05, 3.0);
/// The cut-off at low rates, as a share of the sampling rate.
const HIGHEST_SHARE: f64 = 0.45;

/// The filter that removes drift and frequencies above breathing.
///
/// Butterworth band-pass of order 2 from 0.05 to 3 Hz (or to 0.45 of the sampling rate if that is less): NeuroKit2's
/// `khodadad2018`, after Khodadad et al. (2018), doi:10.1088/1361-6579/aad7e6. For causal use, run it as
/// [`Cascade::settled`](crate::filter::Cascade::settled); a breath of 4 s then comes 0.2 s early, a faster one less.
/// Returns an error when the rate is not one of [`RATES_HZ`].
pub fn band(rate_hz: f64) -> Result<Design, SignalError> {
    within(BAND_HZ.1, rate_hz)
}

/// Filters a signal to its [band], without delay: NeuroKit2's `rsp_clean`. Not causal.
pub fn clean(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    zero_phase(&band(rate_hz)?, signal)
}

/// The band with another upper cut-off.
pub(super) fn within(high_hz: f64, rate_hz: f64) -> Result<Design, SignalError> {
    let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
    butterworth::band_pass(2, BAND_HZ.0, high_hz.min(HIGHEST_SHARE * rate_hz), rate_hz)
}
