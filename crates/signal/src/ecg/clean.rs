//! Removal of baseline wander and mains hum from an ECG.

use crate::error::{SignalError, checked};
use crate::filter::{Design, butterworth, notch, zero_phase};

/// The upper limit of breathing, sweat and motion artefacts [Hz] (Kligfield et al. 2007,
/// doi:10.1161/CIRCULATIONAHA.106.180200, allow this cut-off for zero-phase filters).
const WANDER_HZ: f64 = 0.5;
/// The order of the high-pass.
const ORDER: u32 = 2;
/// The quality factor of the notch: 50 Hz ± 0.8 Hz.
const NOTCH_QUALITY: f64 = 30.0;
/// The supported mains frequencies [Hz].
const MAINS_HZ: (f64, f64) = (10.0, 1000.0);

/// The filter that cleans an ECG: a Butterworth high-pass at 0.5 Hz of order 2, and a notch of quality 30 at
/// `mains_hz` (50 or 60 Hz) where the rate is more than twice that.
///
/// For causal use, run it as [`Cascade::settled`](crate::filter::Cascade::settled), which starts without a
/// transient. Returns an error for a rate below 1 Hz, or mains outside 10 to 1000 Hz.
pub fn cleaning(rate_hz: f64, mains_hz: f64) -> Result<Design, SignalError> {
    let mains_hz = checked("mains_hz", mains_hz, MAINS_HZ)?;
    let wander = without_wander(rate_hz)?;
    if 2.0 * mains_hz < rate_hz {
        wander.then(&notch(mains_hz, NOTCH_QUALITY, rate_hz)?)
    } else {
        Ok(wander)
    }
}

/// The filter without the notch.
pub(super) fn without_wander(rate_hz: f64) -> Result<Design, SignalError> {
    butterworth::high_pass(ORDER, WANDER_HZ, rate_hz)
}

/// A whole ECG without baseline wander and hum: [`cleaning`] applied forwards and backwards.
///
/// In the unit of the signal, without delay. Missing values are bridged. Returns the errors of [`zero_phase`], and one
/// for a rate below 1 Hz.
pub fn clean(signal: &[f64], rate_hz: f64, mains_hz: f64) -> Result<Vec<f64>, SignalError> {
    zero_phase(&cleaning(rate_hz, mains_hz)?, signal)
}
