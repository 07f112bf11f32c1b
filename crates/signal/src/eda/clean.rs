//! Removal of frequencies that sweat glands cannot produce.

use super::checked_rate;
use crate::error::SignalError;
use crate::filter::butterworth::low_pass;
use crate::filter::zero_phase;
use crate::gaps::bridged;

/// The upper limit of skin conductance [Hz].
pub(super) const FASTEST_HZ: f64 = 3.0;
/// Recordings below this rate [Hz] are not filtered: there is no room for the low-pass.
pub(super) const LEAST_FILTERED_HZ: f64 = 7.0;
/// Order of the low-pass.
pub(super) const ORDER: u32 = 4;

/// The signal [µS] below 3 Hz: Butterworth of order 4, zero-phase, as NeuroKit2's `eda_clean`.
///
/// Below 7 Hz nothing is filtered. Values that are [not usable](crate::gaps::is_usable) are interpolated
/// linearly. Returns an error for a rate outside 1 to 2000 Hz, without a usable value, and for fewer than 16
/// samples if they are to be filtered.
pub fn clean(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    checked_rate(rate_hz)?;
    if rate_hz < LEAST_FILTERED_HZ {
        return bridged(signal);
    }
    zero_phase(&low_pass(ORDER, FASTEST_HZ, rate_hz)?, signal)
}
