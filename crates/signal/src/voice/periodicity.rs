//! Pitch candidates of a frame, from the autocorrelation of its sound.
//!
//! Boersma (1993), Proc. IFA 17: the autocorrelation of the windowed sound is divided by that of the
//! window, so that its peaks are the share of periodic power at any lag.

use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// The maximum number of candidates of a frame.
pub(super) const MOST: usize = 15;
/// The window's length in periods of the lowest pitch.
const PERIODS: f64 = 3.0;
/// The minimum rate to which the autocorrelation is interpolated [Hz], so that a parabola fits its peaks.
const FINE_HZ: f64 = 32_000.0;
/// The lowest periodicity of a candidate.
const LEAST: f64 = 0.2;
/// The cost of a candidate per octave below the highest: between a period and its double, the period is
/// chosen.
const OCTAVE_COST: f64 = 0.01;

/// A possible pitch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Candidate {
    pub(super) pitch_hz: f64,
    /// The share of periodic power minus the cost of a low pitch.
    pub(super) strength: f64,
    /// The share of periodic power [0..1].
    pub(super) periodicity: f64,
}

/// The candidates of a frame, the strongest [`MOST`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Candidates {
    all: [Candidate; MOST],
    count: usize,
}

impl Candidates {
    pub(super) fn as_slice(&self) -> &[Candidate] {
        &self.all[..self.count]
    }

    fn add(&mut self, candidate: Candidate) {
        if self.count < MOST {
            self.all[self.count] = candidate;
            self.count += 1;
            return;
        }
        let weakest = self.all.iter_mut().min_by(|a, b| a.strength.total_cmp(&b.strength));
        if let Some(weakest) = weakest.filter(|weakest| weakest.strength < candidate.strength) {
            *weakest = candidate;
        }
    }
}

/// Finds the pitch candidates of frames.
pub(super) struct Periodicity {
    window: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    scratch: Vec<Complex64>,
    padded: Vec<f64>,
    spectrum: Vec<Complex64>,
    powers: Vec<f64>,
    power_spectrum: Vec<Complex64>,
    correlation: Vec<f64>,
    /// The autocorrelation of the window at fine lags, 1 at lag zero.
    of_window: Vec<f64>,
    fine_hz: f64,
    lowest_hz: f64,
    /// The range of lags to search, fine.
    lags: std::ops::Range<usize>,
    transform_hz: f64,
}

impl Periodicity {
    pub(super) fn new(rate_hz: f64, lowest_hz: f64, highest_hz: f64) -> Periodicity {
        let half = (PERIODS / lowest_hz * rate_hz / 2.0).round() as usize;
        let length = 2 * half + 1;
        let size = (length + (rate_hz / lowest_hz).ceil() as usize + 2).next_power_of_two();
        let finer = (FINE_HZ / rate_hz).ceil().max(1.0) as usize;
        let finer = finer.next_power_of_two();
        let fine_hz = rate_hz * finer as f64;
        let mut planner = RealFftPlanner::new();
        let (forward, inverse) =
            (planner.plan_fft_forward(size), planner.plan_fft_inverse(size * finer));
        let scratch = forward.get_scratch_len().max(inverse.get_scratch_len());
        let turn = std::f64::consts::TAU / (length + 1) as f64;
        let lags = (fine_hz / highest_hz).floor() as usize..(fine_hz / lowest_hz).ceil() as usize;
        let mut periodicity = Periodicity {
            window: (1..=length).map(|k| 0.5 - 0.5 * (turn * k as f64).cos()).collect(),
            scratch: vec![Complex64::default(); scratch],
            padded: vec![0.0; size],
            spectrum: forward.make_output_vec(),
            powers: vec![0.0; size / 2 + 1],
            power_spectrum: inverse.make_input_vec(),
            correlation: inverse.make_output_vec(),
            forward,
            inverse,
            of_window: Vec::new(),
            fine_hz,
            lowest_hz,
            lags,
            transform_hz: rate_hz / size as f64,
        };
        periodicity.padded[..length].copy_from_slice(&periodicity.window);
        periodicity.correlate();
        let upto = periodicity.lags.end + 2;
        let whole = periodicity.correlation[0];
        periodicity.of_window =
            periodicity.correlation[..upto].iter().map(|each| each / whole).collect();
        periodicity
    }

    /// Half the window length, excluding its middle sample.
    pub(super) fn half(&self) -> usize {
        self.window.len() / 2
    }

    /// The candidates of a frame that has the window's length and no missing samples.
    pub(super) fn of(&mut self, frame: &[f64]) -> Candidates {
        let mean = frame.iter().sum::<f64>() / frame.len() as f64;
        self.padded.fill(0.0);
        for ((to, sample), weight) in self.padded.iter_mut().zip(frame).zip(&self.window) {
            *to = (sample - mean) * weight;
        }
        self.correlate();
        let mut candidates = Candidates::default();
        if self.correlation[0] <= f64::MIN_POSITIVE {
            return candidates;
        }
        for lag in self.lags.clone() {
            if let Some(candidate) = self.peak(lag) {
                candidates.add(candidate);
            }
        }
        candidates
    }

    /// The power spectrum of the last frame, and the spacing of its frequencies [Hz].
    pub(super) fn powers(&self) -> (&[f64], f64) {
        (&self.powers, self.transform_hz)
    }

    /// The normalised autocorrelation at a fine lag.
    fn at(&self, lag: usize) -> f64 {
        self.correlation[lag] / self.correlation[0] / self.of_window[lag]
    }

    fn peak(&self, lag: usize) -> Option<Candidate> {
        let [before, here, after] = [lag - 1, lag, lag + 1].map(|lag| self.at(lag));
        if here < LEAST || here <= before || here < after {
            return None;
        }
        let curve = before - 2.0 * here + after;
        let aside = 0.5 * (before - after) / curve;
        let height = here - 0.25 * (before - after) * aside;
        // Values beyond 1 are an artefact of noise in a short window.
        let periodicity = if height > 1.0 { 1.0 / height } else { height };
        let pitch_hz = self.fine_hz / (lag as f64 + aside);
        let strength = periodicity - OCTAVE_COST * (self.lowest_hz / pitch_hz).log2();
        Some(Candidate { pitch_hz, strength, periodicity })
    }

    /// The autocorrelation of the padded buffer, at fine lags.
    fn correlate(&mut self) {
        let scratch = &mut self.scratch[..self.forward.get_scratch_len()];
        let done = self.forward.process_with_scratch(&mut self.padded, &mut self.spectrum, scratch);
        debug_assert!(done.is_ok(), "buffers are those of the plan");
        self.power_spectrum.fill(Complex64::default());
        for (k, bin) in self.spectrum.iter().enumerate() {
            self.powers[k] = bin.norm_sqr();
            self.power_spectrum[k].re = self.powers[k];
        }
        let scratch = &mut self.scratch[..self.inverse.get_scratch_len()];
        let done = self.inverse.process_with_scratch(
            &mut self.power_spectrum,
            &mut self.correlation,
            scratch,
        );
        debug_assert!(done.is_ok(), "buffers are those of the plan, and the ends are real");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strongest_candidate_of_a_buzz_is_its_pitch_at_any_rate() {
        for (rate_hz, pitch_hz) in [(8_000.0, 431.7), (16_000.0, 80.3), (44_100.0, 222.2)] {
            let mut periodicity = Periodicity::new(rate_hz, 65.0, 500.0);
            let sample = |k: usize| {
                let turn = std::f64::consts::TAU * pitch_hz * k as f64 / rate_hz;
                (1..7).map(|n| (turn * f64::from(n)).sin() / f64::from(n)).sum::<f64>()
            };
            let frame: Vec<f64> = (0..=2 * periodicity.half()).map(sample).collect();
            let candidates = periodicity.of(&frame);
            let best =
                candidates.as_slice().iter().max_by(|a, b| a.strength.total_cmp(&b.strength));
            let best = best.expect("a buzz has one");
            assert!((best.pitch_hz / pitch_hz - 1.0).abs() < 0.001, "{best:?} of {pitch_hz}");
            assert!(best.periodicity > 0.98, "{best:?}");
        }
    }

    #[test]
    fn silence_has_no_candidate() {
        let mut periodicity = Periodicity::new(16_000.0, 65.0, 500.0);
        let frame = vec![0.25; 2 * periodicity.half() + 1];
        assert!(periodicity.of(&frame).as_slice().iter().all(|each| each.periodicity <= 1.0));
        assert!(periodicity.of(&vec![0.0; frame.len()]).as_slice().is_empty());
    }
}
