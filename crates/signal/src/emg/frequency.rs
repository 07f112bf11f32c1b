//! Mean and median frequency of a frame.

use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use super::amplitude::sum;
use super::comb::tone;
use crate::spectrum::Taper;

/// Spectra of frames of one length, planned once: SciPy's `periodogram` with a Hann window and the mean
/// removed.
#[derive(Clone)]
pub(super) struct Periodogram {
    fourier: Arc<dyn RealToComplex<f64>>,
    weights: Vec<f64>,
    step_hz: f64,
    tapered: Vec<f64>,
    waves: Vec<Complex64>,
    scratch: Vec<Complex64>,
    power: Vec<f64>,
}

impl std::fmt::Debug for Periodogram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Periodogram").field("length", &self.weights.len()).finish_non_exhaustive()
    }
}

/// Mean and median frequency [Hz], and the share of the power of a [tone](tone()) with or without harmonics.
#[derive(Clone, Copy, Debug)]
pub(super) struct Middle {
    pub(super) mean_hz: f64,
    pub(super) median_hz: f64,
    pub(super) tone: f64,
}

impl Periodogram {
    pub(super) fn new(rate_hz: f64, length: usize) -> Periodogram {
        let fourier = RealFftPlanner::<f64>::new().plan_fft_forward(length);
        Periodogram {
            weights: Taper::Hann.weights(length),
            step_hz: rate_hz / length as f64,
            tapered: fourier.make_input_vec(),
            waves: fourier.make_output_vec(),
            scratch: fourier.make_scratch_vec(),
            power: vec![0.0; length / 2 + 1],
            fourier,
        }
    }

    /// The mean and median frequency and the strongest line of a frame; NaN if it is constant. Expects the planned
    /// length.
    pub(super) fn middle(&mut self, frame: &[f64]) -> Middle {
        let none = Middle { mean_hz: f64::NAN, median_hz: f64::NAN, tone: f64::NAN };
        if self.transform(frame).is_none() {
            return none;
        }
        let (mut total, mut weighted) = (0.0, 0.0);
        for (bin, power) in self.power.iter().enumerate() {
            total += power;
            weighted += power * bin as f64;
        }
        if !(total.is_normal() && weighted.is_finite()) {
            return none;
        }
        Middle {
            mean_hz: weighted / total * self.step_hz,
            median_hz: self.halving_bin(total) * self.step_hz,
            tone: tone(&self.power, total),
        }
    }

    fn transform(&mut self, frame: &[f64]) -> Option<()> {
        let mean = sum(frame, frame, |sample, _| sample) / frame.len() as f64;
        for ((tapered, weight), sample) in self.tapered.iter_mut().zip(&self.weights).zip(frame) {
            *tapered = weight * (sample - mean);
        }
        let (waves, scratch) = (&mut self.waves, &mut self.scratch);
        self.fourier.process_with_scratch(&mut self.tapered, waves, scratch).ok()?;
        for (power, wave) in self.power.iter_mut().zip(&self.waves) {
            *power = 2.0 * wave.norm_sqr();
        }
        // The bins at zero and at Nyquist each stand for one frequency.
        self.power[0] /= 2.0;
        if self.weights.len().is_multiple_of(2) {
            *self.power.last_mut()? /= 2.0;
        }
        Some(())
    }

    /// The bin at which the cumulative power reaches half of the total, interpolated linearly.
    fn halving_bin(&self, total: f64) -> f64 {
        let half = total / 2.0;
        let mut sum = self.power[0];
        if sum > half {
            return 0.0;
        }
        for (bin, power) in self.power.iter().enumerate().skip(1) {
            if sum + power > half {
                return (bin - 1) as f64 + (half - sum) / power;
            }
            sum += power;
        }
        (self.power.len() - 1) as f64
    }
}
