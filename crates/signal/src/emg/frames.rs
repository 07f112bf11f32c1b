//! The features of short frames.

use super::amplitude::{Sums, Thresholds};
use super::band::RATES_HZ;
use super::frequency::Periodogram;
use crate::error::{SignalError, checked, checked_rate_hz};
use crate::gaps::is_usable;

/// The smallest and the largest number of samples in a frame.
const LENGTHS: (f64, f64) = (8.0, 1_000_000.0);

/// The features of one frame of a signal in the [muscle's band](super::band()).
///
/// Phinyomark et al. (2012), doi:10.1016/j.eswa.2012.01.102, with N samples x at a rate r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Root mean square, √(Σx²/N) [unit].
    pub rms: f64,
    /// Mean absolute value, Σ|x|/N [unit].
    pub mav: f64,
    /// Integrated EMG, Σ|x|/r [unit·s].
    pub iemg: f64,
    /// Variance about zero, Σx²/(N − 1) [unit²].
    pub var: f64,
    /// Waveform length, Σ|xₖ₊₁ − xₖ| [unit].
    pub wl: f64,
    /// Zero crossings: changes of sign by at least the threshold.
    pub zc: f64,
    /// Slope sign changes: turns with a step of at least the threshold on one side.
    pub ssc: f64,
    /// Mean frequency, Σfp/Σp of the periodogram [Hz]; NaN where nothing varies.
    pub mnf_hz: f64,
    /// Median frequency: half of the power lies below it, linear between bins [Hz]; NaN where nothing
    /// varies.
    pub mdf_hz: f64,
    /// The largest share of the power in three successive bins of the periodogram, or in the bins at all multiples of a
    /// frequency, less what is there by chance [0..1]: 1 for a tone with or without harmonics, a fifth for a muscle;
    /// NaN where nothing varies.
    pub tone: f64,
}

/// Features of frames of one length at a fixed hop.
///
/// A frame has ⌊length · rate⌋ samples; its spectrum is SciPy's periodogram with a periodic Hann window and
/// the mean removed, planned once. No frame allocates. Frames shorter than 0.1 s resolve frequencies
/// coarsely: bins are 1 / length apart.
///
/// ```
/// use teampulse_signal::emg::Frames;
/// let wave: Vec<f64> = (0..500).map(|k| (0.5 * f64::from(k)).sin()).collect();
/// let features = Frames::new(1000.0, 0.25, 0.125)?.of(&wave);
/// let first = features[0].expect("all samples are usable");
/// assert!((first.rms - 0.5f64.sqrt()).abs() < 0.01);
/// assert!((first.mnf_hz - 79.6).abs() < 0.5);
/// # Ok::<(), teampulse_signal::error::SignalError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Frames {
    rate_hz: f64,
    length: usize,
    hop: usize,
    thresholds: Thresholds,
    periodogram: Periodogram,
}

impl Frames {
    /// Creates frames of `length_secs` [s], `hop_secs` [s] apart, without thresholds.
    ///
    /// Returns an error for a rate outside [`RATES_HZ`], fewer than 8 or more than a million samples in a
    /// frame, or a hop of less than a sample.
    pub fn new(rate_hz: f64, length_secs: f64, hop_secs: f64) -> Result<Frames, SignalError> {
        let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
        // A product of decimal fractions may fall just short of an integer.
        let samples = |secs: f64| (secs * rate_hz + 1e-9).floor();
        let length = checked("samples of a frame", samples(length_secs), LENGTHS)? as usize;
        let hops = (1.0, LENGTHS.1);
        let hop = checked("samples between frames", samples(hop_secs), hops)? as usize;
        let periodogram = Periodogram::new(rate_hz, length);
        Ok(Frames { rate_hz, length, hop, thresholds: Thresholds::default(), periodogram })
    }

    /// Sets the thresholds.
    #[must_use]
    pub fn with_thresholds(self, thresholds: Thresholds) -> Frames {
        Frames { thresholds, ..self }
    }

    /// The number of samples in a frame.
    pub fn length(&self) -> usize {
        self.length
    }

    /// The number of samples between the starts of successive frames.
    pub fn hop(&self) -> usize {
        self.hop
    }

    /// The features of all whole frames of a signal, `None` for a frame with a sample that is not [usable](is_usable).
    pub fn of(&mut self, signal: &[f64]) -> Vec<Option<Features>> {
        let (length, hop) = (self.length, self.hop);
        signal.windows(length).step_by(hop).map(|frame| self.of_one(frame)).collect()
    }

    /// The features of one frame; `None` when it has another length, or a sample that is not usable.
    pub fn of_one(&mut self, frame: &[f64]) -> Option<Features> {
        // All samples are tested, four at a time, rather than stopping at the first unusable one.
        let are_usable = frame.iter().fold(true, |are, &sample| are & is_usable(sample));
        if frame.len() != self.length || !are_usable {
            return None;
        }
        let sums = Sums::of(frame, self.thresholds);
        let middle = self.periodogram.middle(frame);
        let count = frame.len() as f64;
        Some(Features {
            rms: (sums.squares / count).sqrt(),
            mav: sums.absolutes / count,
            iemg: sums.absolutes / self.rate_hz,
            var: sums.squares / (count - 1.0),
            wl: sums.steps,
            zc: f64::from(sums.crossings),
            ssc: f64::from(sums.turns),
            mnf_hz: middle.mean_hz,
            mdf_hz: middle.median_hz,
            tone: middle.tone,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;

    fn wave(at_hz: f64) -> Vec<f64> {
        (0..250).map(|k| 2.0 * (TAU * at_hz * (f64::from(k) + 0.3) / 1000.0).sin()).collect()
    }

    #[test]
    fn an_oscillation_crosses_zero_and_turns_twice_a_period() {
        let mut frames = Frames::new(1000.0, 0.25, 0.25).unwrap();
        let features = frames.of_one(&wave(100.0)).unwrap();
        assert!((features.zc - 50.0).abs() <= 1.0 && (features.ssc - 50.0).abs() <= 1.0);
        assert!((features.rms - 2f64.sqrt()).abs() < 1e-9);
        assert!((features.wl - 8.0 * 25.0).abs() < 8.0);
        assert!(features.tone > 0.999);
        assert!((features.mnf_hz - 100.0).abs() < 1e-9 && (features.mdf_hz - 98.0).abs() < 4.0);
    }

    #[test]
    fn what_is_smaller_than_the_threshold_does_not_count() {
        let thresholds = Thresholds { zero_crossing: 10.0, slope_change: 10.0 };
        let mut frames = Frames::new(1000.0, 0.25, 0.25).unwrap().with_thresholds(thresholds);
        let features = frames.of_one(&wave(100.0)).unwrap();
        assert_eq!((features.zc, features.ssc), (0.0, 0.0));
    }

    #[test]
    fn a_flat_frame_has_no_frequency() {
        let features = Frames::new(200.0, 0.25, 0.05).unwrap().of_one(&[0.0; 50]).unwrap();
        assert!(features.mnf_hz.is_nan() && features.mdf_hz.is_nan());
        assert_eq!((features.rms, features.wl), (0.0, 0.0));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert!(Frames::new(50.0, 0.25, 0.1).is_err());
        assert!(Frames::new(f64::NAN, 0.25, 0.1).is_err());
        for secs in [0.0, -1.0, 1e-9, 1e12, f64::NAN, f64::INFINITY] {
            assert!(
                Frames::new(1000.0, secs, 0.1).is_err() && Frames::new(1000.0, 0.1, secs).is_err()
            );
        }
    }

    proptest! {
        #[test]
        fn no_frame_gives_nonsense(
            frame in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -1.0..1.0], 0..120),
        ) {
            let mut frames = Frames::new(200.0, 0.25, 0.05).unwrap();
            prop_assert!(frames.of_one(&frame).is_none() || frame.len() == 50);
            for features in frames.of(&frame).into_iter().flatten() {
                prop_assert!(features.rms.is_finite() && features.wl.is_finite());
                prop_assert!(features.mnf_hz.is_nan() || (0.0..=100.0).contains(&features.mnf_hz));
                prop_assert!(features.mdf_hz.is_nan() || (0.0..=100.0).contains(&features.mdf_hz));
            }
        }
    }
}
