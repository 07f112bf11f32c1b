//! Waves of flutter and fibrillation of the ventricles: broad, and without a pause between them.

use super::history::History;
use super::kernel::{Kernel, energy, sigma_secs};

/// Where flutter and fibrillation of the ventricles have most of their energy [Hz].
const FLUTTER_HZ: f64 = 4.5;
/// The half-width of the kernels [standard deviations of the Gaussian].
const REACH_SIGMAS: f64 = 2.5;
/// The stride of the envelope [samples at the working rate]: it changes slowly.
const STEP: i64 = 4;
/// The quietest part of the time before a wave, which shows whether there was a pause, as a share of it.
const QUIET_SHARE: f64 = 0.25;

/// The envelope of an ECG at the frequency of flutter.
#[derive(Clone, Debug)]
pub(super) struct SlowWaves {
    even: Kernel,
    odd: Kernel,
    /// The squared envelope, one value for every `STEP` samples.
    energy: History,
    /// The number of values over which a pause is looked for.
    count: usize,
    values: Vec<f64>,
}

impl SlowWaves {
    /// Looks for a pause in the `before_secs` before a wave.
    pub(super) fn new(working_hz: f64, before_secs: f64) -> SlowWaves {
        let half = (REACH_SIGMAS * sigma_secs(3, FLUTTER_HZ) * working_hz).ceil() as usize;
        let count = (before_secs * working_hz) as usize / STEP as usize;
        SlowWaves {
            even: Kernel::even(FLUTTER_HZ, half, working_hz),
            odd: Kernel::odd(FLUTTER_HZ, half, working_hz),
            energy: History::new(count),
            count,
            values: Vec::with_capacity(count),
        }
    }

    /// Takes in the newest sample of the signal.
    pub(super) fn push(&mut self, signal: &History) {
        if signal.count % STEP == 0 {
            let samples = signal.newest(self.even.length());
            self.energy.push(energy(&self.even, &self.odd, samples));
        }
    }

    /// The energy around a place in the signal; 0 until the signal after it is known.
    pub(super) fn energy_around(&self, place: i64, signal: &History) -> f64 {
        let until = place + self.even.half() as i64 + 1;
        let samples = signal.at(until - self.even.length() as i64..until);
        let is_known = samples.len() == self.even.length();
        if is_known { energy(&self.even, &self.odd, samples) } else { 0.0 }
    }

    /// The lower quartile of the envelope in the time before now.
    pub(super) fn quiet_height(&mut self) -> f64 {
        self.values.clear();
        self.values.extend(self.energy.newest(self.count));
        if self.values.is_empty() {
            return 0.0;
        }
        let index = (self.values.len() as f64 * QUIET_SHARE) as usize;
        self.values.select_nth_unstable_by(index, f64::total_cmp).1.sqrt()
    }
}
