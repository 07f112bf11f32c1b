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

/// A phase is computed anew after this many turns by one sample, so that errors do not add up.
const MOST_TURNS: u64 = 64;

/// Detects the mains frequency sample by sample; 50 Hz until 60 Hz is louder.
#[derive(Clone, Debug)]
pub(super) struct Mains {
    rate_hz: f64,
    count: u64,
    /// The phase of each frequency at the next sample, as cosine and sine, and its turn by one sample.
    phases: [[f64; 2]; 2],
    turns: [[f64; 2]; 2],
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
        let turns = MAINS_HZ.map(|hz| phase(hz / rate_hz));
        let (phases, sums) = ([[1.0, 0.0]; 2], [[0.0; 2]; 2]);
        Mains { rate_hz, count: 0, phases, turns, kept, sums, chosen: 0 }
    }

    /// Takes in a sample; returns the index of the detected frequency in [`MAINS_HZ`].
    pub(super) fn push(&mut self, sample: f64) -> usize {
        if self.rate_hz <= 2.0 * MAINS_HZ[1] {
            return self.chosen;
        }
        let phases = self.phases;
        self.turn();
        if !is_usable(sample) {
            return self.chosen;
        }
        for (sums, [cosine, sine]) in self.sums.iter_mut().zip(phases) {
            *sums = [sums[0] * self.kept + sample * cosine, sums[1] * self.kept + sample * sine];
        }
        let loudness = self.sums.map(|[cosine, sine]| cosine * cosine + sine * sine);
        let other = 1 - self.chosen;
        if loudness[other] > LOUDER * LOUDER * loudness[self.chosen] {
            self.chosen = other;
        }
        self.chosen
    }

    /// Turns the phases to the next sample.
    fn turn(&mut self) {
        self.count += 1;
        if self.count.is_multiple_of(MOST_TURNS) {
            let samples = self.count as f64;
            self.phases = MAINS_HZ.map(|hz| phase(hz * samples / self.rate_hz));
            return;
        }
        for ([cosine, sine], [turn_cosine, turn_sine]) in self.phases.iter_mut().zip(self.turns) {
            (*cosine, *sine) = (
                *cosine * turn_cosine - *sine * turn_sine,
                *sine * turn_cosine + *cosine * turn_sine,
            );
        }
    }
}

/// The cosine and the sine after this many periods.
fn phase(periods: f64) -> [f64; 2] {
    let (sine, cosine) = (periods.fract() * TAU).sin_cos();
    [cosine, sine]
}

/// The mains frequency of a whole signal [Hz]: the one detected at most samples.
pub(super) fn mains_hz(signal: &[f64], rate_hz: f64) -> f64 {
    let mut mains = Mains::new(rate_hz);
    let higher = signal.iter().filter(|sample| mains.push(**sample) == 1).count();
    MAINS_HZ[usize::from(2 * higher > signal.len())]
}

/// Removes baseline wander and hum from an ECG causally.
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
