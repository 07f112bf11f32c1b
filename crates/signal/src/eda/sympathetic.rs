//! Sympathetic power in the spectrum of skin conductance.

use super::checked_rate;
use crate::error::SignalError;
use crate::filter::Cascade;
use crate::filter::butterworth::low_pass;
use crate::spectrum::{Detrend, Rule, Taper, Welch};

/// The sympathetic band [Hz].
const BAND_HZ: (f64, f64) = (0.045, 0.25);
/// The signal is decimated to this rate [Hz], or slightly above.
const SLOW_HZ: f64 = 2.0;
/// The cut-off of the anti-aliasing low-pass [Hz].
const KEPT_HZ: f64 = 0.8;
/// The length of a segment, and of the shortest signal [s].
pub(super) const SEGMENT_SECS: f64 = 64.0;

/// Power in the sympathetic band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sympathetic {
    /// The power between 0.045 and 0.25 Hz [µS²].
    pub power_us2: f64,
    /// The share of this power in all power up to 0.8 Hz [0..1].
    pub share: f64,
}

/// Power of a skin conductance [µS] between 0.045 and 0.25 Hz, which follows sympathetic activity.
///
/// Posada-Quintero et al. (2016), doi:10.1007/s10439-016-1606-6: low-pass at 0.8 Hz (here Butterworth of
/// order 4), decimation to 2 Hz or slightly above, Welch with segments of 64 s (Blackman, 50 % overlap),
/// trapezoids between bins. Instead of their high-pass at 0.01 Hz, each segment is detrended linearly, so
/// that a window is independent of what precedes it. The share is of all power, as in the paper; NeuroKit2's
/// `EDA_SympatheticN` divides by the highest bin.
///
/// Returns an error for less than 64 s, a rate outside 1 to 2000 Hz, or without 64 s of usable samples.
pub fn sympathetic(signal: &[f64], rate_hz: f64) -> Result<Sympathetic, SignalError> {
    let mut slow = SlowDown::new(rate_hz)?;
    let samples: Vec<f64> = signal.iter().filter_map(|&sample| slow.push(sample)).collect();
    of_slow(&samples, slow.rate_hz())
}

/// Like [`sympathetic`], for a signal that is already decimated.
pub(super) fn of_slow(slow: &[f64], rate_hz: f64) -> Result<Sympathetic, SignalError> {
    let segment = (SEGMENT_SECS * rate_hz).floor() as usize;
    if slow.len() < segment {
        return Err(SignalError::TooShort { count: slow.len(), least: segment });
    }
    let (taper, detrend) = (Taper::Blackman, Detrend::Linear);
    let spectrum = Welch { taper, detrend, ..Welch::new(rate_hz, segment) }.of(slow)?;
    let power =
        |(low_hz, high_hz)| spectrum.band_power(low_hz, high_hz, Rule::Trapezoid).unwrap_or(0.0);
    let (power_us2, all) = (power(BAND_HZ), power((0.0, KEPT_HZ)));
    if all > 0.0 {
        Ok(Sympathetic { power_us2, share: power_us2 / all })
    } else {
        Err(SignalError::Constant)
    }
}

/// Decimates a signal to about 2 Hz, causally.
#[derive(Clone, Debug)]
pub(super) struct SlowDown {
    filter: Option<Cascade>,
    every: usize,
    next: usize,
    rate_hz: f64,
}

impl SlowDown {
    pub(super) fn new(rate_hz: f64) -> Result<SlowDown, SignalError> {
        checked_rate(rate_hz)?;
        let every = (rate_hz / SLOW_HZ).floor().max(1.0) as usize;
        let filter = (every > 1).then(|| low_pass(4, KEPT_HZ, rate_hz)).transpose()?;
        let filter = filter.map(|design| Cascade::settled(&design));
        Ok(SlowDown { filter, every, next: 0, rate_hz: rate_hz / every as f64 })
    }

    /// The decimated rate [Hz].
    pub(super) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Takes in the next sample, and returns a decimated one when it is due.
    pub(super) fn push(&mut self, sample: f64) -> Option<f64> {
        let slow = self.filter.as_mut().map_or(sample, |filter| filter.push(sample));
        let is_due = self.next == 0;
        self.next = if is_due { self.every - 1 } else { self.next - 1 };
        is_due.then_some(slow)
    }

    /// Restarts at another level, without a transient.
    pub(super) fn settle(&mut self, level: f64) {
        self.filter.iter_mut().for_each(|filter| filter.settle(level));
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn wave(hz: f64, rate_hz: f64) -> Vec<f64> {
        (0..(300.0 * rate_hz) as usize)
            .map(|k| 5.0 + (TAU * hz * k as f64 / rate_hz).sin())
            .collect()
    }

    #[test]
    fn a_wave_in_the_band_has_its_power_and_one_outside_has_none() {
        for rate_hz in [2.0, 4.0, 32.0, 128.0] {
            let inside = sympathetic(&wave(0.15, rate_hz), rate_hz).unwrap();
            assert!((inside.power_us2 - 0.5).abs() < 0.02 && inside.share > 0.98, "{inside:?}");
            let outside = sympathetic(&wave(0.4, rate_hz), rate_hz).unwrap();
            assert!(outside.power_us2 < 0.005 && outside.share < 0.02, "{outside:?}");
        }
    }

    #[test]
    fn a_minute_is_too_short_and_a_flat_line_has_no_rhythm() {
        assert!(matches!(
            sympathetic(&wave(0.1, 4.0)[..240], 4.0),
            Err(SignalError::TooShort { .. })
        ));
        assert_eq!(sympathetic(&[0.0; 600], 4.0), Err(SignalError::Constant));
        assert!(sympathetic(&[1.0; 600], 0.0).is_err());
    }
}
