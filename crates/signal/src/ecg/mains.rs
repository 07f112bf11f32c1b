//! Detection of the mains frequency in an ECG: 50 or 60 Hz.

use std::f64::consts::TAU;

use super::clean::cleaning;
use crate::error::SignalError;
use crate::filter::Cascade;
use crate::gaps::is_usable;

/// The mains frequencies [Hz].
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// The time constant of the detection [s]: long enough for heartbeats to cancel out.
const MEMORY_SECS: f64 = 5.0;
/// The factor by which the other frequency must be louder to be chosen.
const LOUDER: f64 = 1.5;

/// Detects the mains frequency sample by sample; 50 Hz until 60 Hz is louder.
#[derive(Clone, Debug)]
pub(super) struct Mains {
    rate_hz: f64,
    count: u64,
    /// The decay of the sums per sample.
    kept: f64,
    /// The correlation with the cosine and the sine of each frequency.
    sums: [[f64; 2]; 2],
    chosen: usize,
}

impl Mains {
    /// Creates a detector; at 120 Hz and below, 60 Hz cannot be detected and 50 Hz is assumed.
    pub(super) fn new(rate_hz: f64) -> Mains {
        let kept = (-1.0 / (MEMORY_SECS * rate_hz).max(1.0)).exp();
        Mains { rate_hz, count: 0, kept, sums: [[0.0; 2]; 2], chosen: 0 }
    }

    /// Takes in a sample; returns the index of the detected frequency in [`MAINS_HZ`].
    pub(super) fn push(&mut self, sample: f64) -> usize {
        let count = self.count as f64;
        self.count += 1;
        if !is_usable(sample) || self.rate_hz <= 2.0 * MAINS_HZ[1] {
            return self.chosen;
        }
        for (sums, hz) in self.sums.iter_mut().zip(MAINS_HZ) {
            let (sine, cosine) = ((hz * count / self.rate_hz).fract() * TAU).sin_cos();
            *sums = [sums[0] * self.kept + sample * cosine, sums[1] * self.kept + sample * sine];
        }
        let loudness = self.sums.map(|[cosine, sine]| cosine.hypot(sine));
        let other = 1 - self.chosen;
        if loudness[other] > LOUDER * loudness[self.chosen] {
            self.chosen = other;
        }
        self.chosen
    }
}

/// The mains frequency of a whole signal [Hz]: the one detected at most samples.
pub(super) fn mains_hz(signal: &[f64], rate_hz: f64) -> f64 {
    let mut mains = Mains::new(rate_hz);
    let higher = signal.iter().filter(|sample| mains.push(**sample) == 1).count();
    MAINS_HZ[usize::from(2 * higher > signal.len())]
}

/// Removes baseline wander and hum from an ECG, causally.
#[derive(Clone, Debug)]
pub(super) struct Cleaner {
    filters: [Cascade; 2],
    /// `None` where the frequency is given and both filters are the same.
    mains: Option<Mains>,
}

impl Cleaner {
    /// Creates a cleaner that removes hum at a frequency [Hz], or at the detected one if unset.
    pub(super) fn new(rate_hz: f64, mains_hz: Option<f64>) -> Result<Cleaner, SignalError> {
        let filter = |hz: f64| Ok(Cascade::settled(&cleaning(rate_hz, mains_hz.unwrap_or(hz))?));
        let filters = [filter(MAINS_HZ[0])?, filter(MAINS_HZ[1])?];
        Ok(Cleaner { filters, mains: mains_hz.is_none().then(|| Mains::new(rate_hz)) })
    }

    /// The sample without baseline wander and hum.
    pub(super) fn push(&mut self, sample: f64) -> f64 {
        let Some(mains) = &mut self.mains else { return self.filters[0].push(sample) };
        let cleaned = [self.filters[0].push(sample), self.filters[1].push(sample)];
        cleaned[mains.push(sample)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 250.0;

    /// Beats of 1 mV, and a hum of 0.1 mV at a frequency [Hz].
    fn humming(hz: f64) -> Vec<f64> {
        let sample = |k: usize| {
            let secs = k as f64 / RATE_HZ;
            let beat = (-((secs % 0.83 - 0.4) / 0.01).powi(2) / 2.0).exp();
            beat + 0.1 * (TAU * hz * secs + 0.3).sin()
        };
        (0..7500).map(sample).collect()
    }

    #[test]
    fn the_mains_that_hum_are_heard() {
        assert!((mains_hz(&humming(50.0), RATE_HZ) - 50.0).abs() < 1e-9);
        assert!((mains_hz(&humming(60.0), RATE_HZ) - 60.0).abs() < 1e-9);
        // The grid is never exactly in tune.
        assert!((mains_hz(&humming(59.97), RATE_HZ) - 60.0).abs() < 1e-9);
        assert!((mains_hz(&[], RATE_HZ) - 50.0).abs() < 1e-9);
        assert!((mains_hz(&[f64::NAN; 9], RATE_HZ) - 50.0).abs() < 1e-9);
    }

    #[test]
    fn the_hum_that_is_heard_is_taken_out_as_if_it_were_reported() {
        for hz in [50.0, 60.0] {
            let mut known = Cleaner::new(RATE_HZ, Some(hz)).unwrap();
            let mut found = Cleaner::new(RATE_HZ, None).unwrap();
            for (k, sample) in humming(hz).into_iter().enumerate() {
                let (known, found) = (known.push(sample), found.push(sample));
                assert!(k < 1500 || known.to_bits() == found.to_bits(), "{hz} Hz, sample {k}");
            }
        }
    }
}
