//! Activity counts.

use super::magnitude::magnitude;
use super::unit::checked_rate;
use crate::error::SignalError;
use crate::filter::{Cascade, Design, butterworth, zero_phase};
use crate::gaps::is_usable;

/// The band of human movement [Hz].
const LOW_HZ: f64 = 0.25;
const HIGH_HZ: f64 = 2.5;
const ORDER: u32 = 2;

/// The band of human movement, 0.25 to 2.5 Hz: Butterworth, order 2.
///
/// The passband of the classic activity counters (Brønd et al. 2017, doi:10.1249/MSS.0000000000001344).
/// Returns an error for a rate outside 8 Hz to 10 kHz.
pub fn activity_band(rate_hz: f64) -> Result<Design, SignalError> {
    butterworth::band_pass(ORDER, LOW_HZ, HIGH_HZ, checked_rate(rate_hz)?)
}

/// Computes the activity at each sample of a whole recording, in the unit of the axes: the vector magnitude of the axes
/// in the [band](activity_band), without delay. NaN where an axis is missing.
///
/// Its integral is proportional to activity counts but has a physical unit (60 times its mean is in g·s per
/// minute); the counts of commercial devices come in converter steps, with dead bands, and differ between
/// devices. Axes of different lengths are cut to the shortest. Returns an error for a rate outside 8 Hz to 10
/// kHz, fewer than 16 samples, or an axis without a usable number.
pub fn counts_of(axes: [&[f64]; 3], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    let band = activity_band(rate_hz)?;
    let length = axes.iter().map(|axis| axis.len()).min().unwrap_or(0);
    let [x, y, z] = axes.map(|axis| &axis[..length]);
    let moved = [zero_phase(&band, x)?, zero_phase(&band, y)?, zero_phase(&band, z)?];
    let is_whole = |k: usize| [x, y, z].iter().all(|axis| is_usable(axis[k]));
    let height = |k: usize| magnitude([moved[0][k], moved[1][k], moved[2][k]]);
    Ok((0..length).map(|k| if is_whole(k) { height(k) } else { f64::NAN }).collect())
}

/// Computes the activity as samples arrive; the causal counterpart of [`counts_of`].
///
/// The band-pass delays it by about a quarter of a second and starts settled on the first sample. Independent
/// of chunking; no sample allocates.
#[derive(Clone, Debug)]
pub struct Counts {
    axes: [Cascade; 3],
}

impl Counts {
    /// Creates the filter for a sampling rate [Hz]; an error outside 8 Hz to 10 kHz.
    pub fn new(rate_hz: f64) -> Result<Counts, SignalError> {
        let axis = Cascade::settled(&activity_band(rate_hz)?);
        Ok(Counts { axes: [axis.clone(), axis.clone(), axis] })
    }

    /// Takes in the next sample; NaN where an axis is missing.
    pub fn push(&mut self, axes: [f64; 3]) -> f64 {
        let mut moved = [0.0; 3];
        for ((moved, filter), axis) in moved.iter_mut().zip(&mut self.axes).zip(axes) {
            *moved = filter.push(axis);
        }
        if axes.iter().all(|&axis| is_usable(axis)) { magnitude(moved) } else { f64::NAN }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn wave(at_hz: f64) -> Vec<f64> {
        (0..6400).map(|k| 0.3 * (TAU * at_hz * f64::from(k) / 32.0).sin()).collect()
    }

    fn mean_of_middle(counts: &[f64]) -> f64 {
        counts[3200..4800].iter().sum::<f64>() / 1600.0
    }

    #[test]
    fn what_is_in_the_band_counts_and_the_rest_does_not() {
        let still = vec![1.0; 6400];
        for (at_hz, share) in [(0.02, 0.0), (0.8, 1.0), (12.0, 0.0)] {
            let counts = counts_of([&wave(at_hz), &still, &still], 32.0).unwrap();
            let mean = mean_of_middle(&counts);
            assert!(
                (mean - share * 0.3 * 2.0 / std::f64::consts::PI).abs() < 0.01,
                "{at_hz} {mean}"
            );
        }
    }

    #[test]
    fn causal_counts_are_the_same_on_average() {
        let mut running = Counts::new(32.0).unwrap();
        let causal: Vec<f64> =
            wave(0.8).into_iter().map(|x| running.push([x, 1.0, -1.0])).collect();
        let [up, down] = [1.0, -1.0].map(|level| vec![level; 6400]);
        let whole = counts_of([&wave(0.8), &up, &down], 32.0).unwrap();
        assert!((mean_of_middle(&causal) / mean_of_middle(&whole) - 1.0).abs() < 0.02);
        assert!(running.push([f64::NAN, 0.0, 0.0]).is_nan());
    }

    #[test]
    fn absurd_rates_are_refused() {
        for rate_hz in [0.0, 1e-9, 7.0, 1e9, f64::NAN, f64::INFINITY] {
            assert!(Counts::new(rate_hz).is_err());
            assert!(counts_of([&[0.0; 99]; 3], rate_hz).is_err());
        }
        assert!(counts_of([&[], &[0.0], &[0.0]], 32.0).is_err());
    }
}
