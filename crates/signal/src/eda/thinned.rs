//! Decimation for slow methods.

use super::checked_rate;
use crate::error::SignalError;
use crate::filter::butterworth::low_pass;
use crate::filter::zero_phase;

/// The cut-off of the anti-aliasing low-pass, as a share of the new rate; Nyquist is one half.
const KEPT: f64 = 0.4;
/// The order of the low-pass; twice that in effect, as it is zero-phase.
const ORDER: u32 = 8;

/// A decimated signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Thinned {
    /// The samples kept, from the first one on.
    pub values: Vec<f64>,
    /// The decimation factor.
    pub every: usize,
    /// The new rate [Hz].
    pub rate_hz: f64,
}

/// Decimates a signal by an integer factor to `least_hz` [Hz] or above, but below twice that.
///
/// A zero-phase Butterworth of order 8 at 0.4 of the new rate prevents aliasing. A signal already below twice
/// `least_hz` is unchanged. If the signal is filtered, values that are [not usable](crate::gaps::is_usable) are
/// bridged. Returns an error for a rate outside 1 to 2000 Hz, and for a signal that is too short or has no usable
/// value.
pub fn thinned(signal: &[f64], rate_hz: f64, least_hz: f64) -> Result<Thinned, SignalError> {
    checked_rate(rate_hz)?;
    let every = (rate_hz / least_hz).floor().clamp(1.0, 2000.0) as usize;
    if every == 1 {
        return Ok(Thinned { values: signal.to_vec(), every, rate_hz });
    }
    let new_hz = rate_hz / every as f64;
    let slow = zero_phase(&low_pass(ORDER, KEPT * new_hz, rate_hz)?, signal)?;
    Ok(Thinned { values: slow.into_iter().step_by(every).collect(), every, rate_hz: new_hz })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn slow_waves_stay_and_fast_ones_do_not_come_back_as_slow_ones() {
        let wave = |k: u32, hz: f64| (TAU * hz * f64::from(k) / 128.0).sin();
        let signal: Vec<f64> = (0..12800).map(|k| wave(k, 0.5) + wave(k, 3.9)).collect();
        let thinned = thinned(&signal, 128.0, 4.0).unwrap();
        assert_eq!((thinned.every, thinned.rate_hz, thinned.values.len()), (32, 4.0, 400));
        for (k, value) in thinned.values.iter().enumerate().skip(20).take(360) {
            assert!((value - wave(32 * k as u32, 0.5)).abs() < 1e-3, "{k}: {value}");
        }
    }
}
