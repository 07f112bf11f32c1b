//! Removal of drift and mains hum for display.

use super::checked_rate_hz;
use crate::error::SignalError;
use crate::filter::{Design, butterworth, notch, zero_phase};

/// The cut-off of the high-pass [Hz].
const HIGH_PASS_HZ: f64 = 1.0;
/// The quality factor of the notch.
const NOTCH_QUALITY: f64 = 30.0;

/// The filter that removes drift and mains hum from an EEG at 100 to 5000 Hz.
///
/// Butterworth high-pass of order 2 at 1 Hz, then a notch of quality 30 at `mains_hz` (50 or 60), unless that exceeds
/// the Nyquist frequency. For causal use, run it as [`Cascade::settled`](crate::filter::Cascade::settled); for a whole
/// recording use [`clean`]. At 1 Hz it passes half of the power, and with zero phase a quarter, so spectra are computed
/// from the raw signal. Returns an error for other rates or an invalid mains frequency.
pub fn cleaning(rate_hz: f64, mains_hz: f64) -> Result<Design, SignalError> {
    let rate_hz = checked_rate_hz(rate_hz)?;
    let high_pass = butterworth::high_pass(2, HIGH_PASS_HZ, rate_hz)?;
    if mains_hz >= rate_hz / 2.0 && mains_hz.is_finite() {
        return Ok(high_pass);
    }
    high_pass.then(&notch(mains_hz, NOTCH_QUALITY, rate_hz)?)
}

/// Removes drift and hum from a whole EEG: [`cleaning`] with zero phase.
///
/// Values that are not [usable numbers](crate::gaps::is_usable) are bridged. Errors as for [`cleaning`], and
/// for a signal that is too short or has no usable number.
pub fn clean(signal: &[f64], rate_hz: f64, mains_hz: f64) -> Result<Vec<f64>, SignalError> {
    zero_phase(&cleaning(rate_hz, mains_hz)?, signal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_and_mains_go_and_the_bands_stay() {
        for mains_hz in [50.0, 60.0] {
            let design = cleaning(256.0, mains_hz).unwrap();
            assert!(design.gain(mains_hz) < 1e-9 && design.gain(0.1) < 0.011);
            assert!([2.5, 10.0, 30.0, 40.0].iter().all(|&hz| design.gain(hz) > 0.98));
        }
    }

    #[test]
    fn mains_that_cannot_be_seen_are_not_taken_out() {
        assert_eq!(cleaning(100.0, 60.0).unwrap().sections().len(), 1);
        for (rate_hz, mains_hz) in [(f64::NAN, 50.0), (0.0, 50.0), (1e9, 50.0)] {
            assert!(cleaning(rate_hz, mains_hz).is_err());
        }
        assert!(
            [0.0, -50.0, f64::NAN, f64::INFINITY].iter().all(|&hz| cleaning(256.0, hz).is_err())
        );
    }
}
