//! Welch's averaged spectrum.

use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use super::transforms::Transforms;
use super::{Detrend, Spectrum, Taper};
use crate::error::{SignalError, checked, checked_rate_hz};
use crate::gaps::is_usable;
use crate::robust::median_in_place;

/// The longest segment or transform [samples].
const MOST_LENGTH: f64 = 16_777_216.0;

/// Settings of the one-sided spectrum of an even series, averaged over segments.
///
/// Equals `scipy.signal.welch`, with SciPy's options and defaults ([`Welch::new`]). Welch (1967),
/// doi:10.1109/TAU.1967.1161901. Bins lie rate / transform length apart; to resolve two bins, a segment of about two
/// periods of their difference is needed. Segments with a sample that is not [usable](crate::gaps::is_usable) are left
/// out, which keeps gaps from leaking into all bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Welch {
    /// The sampling rate [Hz].
    pub rate_hz: f64,
    /// The length of a segment [samples]; a shorter signal is one segment.
    pub segment: usize,
    /// The overlap of successive segments [samples]; half when `None`.
    pub overlap: Option<usize>,
    /// The length of the zero-padded transform [samples]; that of the segment when `None`.
    pub transform: Option<usize>,
    /// The window function.
    pub taper: Taper,
    /// The detrending of each segment.
    pub detrend: Detrend,
    /// The unit of the result.
    pub scaling: Scaling,
    /// The averaging of segments.
    pub average: Average,
}

/// The unit of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scaling {
    /// Power per Hertz [unit² / Hz]: its integral is the variance.
    Density,
    /// Power [unit²]: the height of a line is its mean square.
    Power,
}

/// The averaging of segments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Average {
    /// The mean of the segments.
    Mean,
    /// The median of the segments, corrected for bias: robust to a few segments with artefacts.
    Median,
}

impl Welch {
    /// SciPy's defaults for segments of `segment` samples (SciPy's own is 256): Hann, 50 % overlap, mean
    /// removed, density, mean of the segments.
    pub fn new(rate_hz: f64, segment: usize) -> Welch {
        Welch {
            rate_hz,
            segment,
            overlap: None,
            transform: None,
            taper: Taper::Hann,
            detrend: Detrend::Constant,
            scaling: Scaling::Density,
            average: Average::Mean,
        }
    }

    /// Computes the spectrum of `signal`; an error for inconsistent settings, or without a whole segment of usable
    /// samples.
    pub fn of(&self, signal: &[f64]) -> Result<Spectrum, SignalError> {
        let lengths = self.lengths(signal.len())?;
        self.by(&mut Transform::new(self, lengths), lengths, signal)
    }

    /// Like [`of`](Self::of), with cached FFT plans.
    pub(crate) fn of_next(
        &self,
        signal: &[f64],
        kept: &Transforms,
    ) -> Result<Spectrum, SignalError> {
        let lengths = self.lengths(signal.len())?;
        kept.with(self, lengths, |transform| self.by(transform, lengths, signal))
    }

    fn by(
        &self,
        transform: &mut Transform,
        lengths: Lengths,
        signal: &[f64],
    ) -> Result<Spectrum, SignalError> {
        let segments = signal.windows(lengths.segment).step_by(lengths.step);
        let whole = segments.filter(|segment| segment.iter().all(|&value| is_usable(value)));
        let mut averaging = Averaging::new(self.average, lengths.transform / 2 + 1);
        let add = |segment| averaging.add(transform.power(segment));
        let segments = whole.map(add).count();
        if segments == 0 {
            return Err(SignalError::NothingFinite);
        }
        let frequency_hz = |bin: usize| bin as f64 * self.rate_hz / lengths.transform as f64;
        let frequencies_hz = (0..=lengths.transform / 2).map(frequency_hz).collect();
        let spectrum = Spectrum { frequencies_hz, power: averaging.average(segments), segments };
        spectrum.finite()
    }

    /// Plans the transform of a full segment.
    pub(crate) fn transform(&self) -> Result<Transform, SignalError> {
        self.lengths(self.segment).map(|lengths| Transform::new(self, lengths))
    }

    fn lengths(&self, count: usize) -> Result<Lengths, SignalError> {
        checked_rate_hz(self.rate_hz)?;
        checked("segment", self.segment as f64, (1.0, MOST_LENGTH))?;
        if count == 0 {
            return Err(SignalError::TooShort { count, least: 1 });
        }
        let segment = self.segment.min(count);
        let overlap = self.overlap.unwrap_or(segment / 2);
        checked("overlap", overlap as f64, (0.0, segment as f64 - 1.0))?;
        let transform = self.transform.unwrap_or(segment);
        checked("transform", transform as f64, (segment as f64, MOST_LENGTH))?;
        Ok(Lengths { segment, step: segment - overlap, transform })
    }
}

/// The accumulated segments.
enum Averaging {
    /// The sum of powers of each bin.
    Mean(Vec<f64>),
    /// All powers of each bin.
    Median(Vec<Vec<f64>>),
}

impl Averaging {
    fn new(average: Average, bins: usize) -> Averaging {
        match average {
            Average::Mean => Averaging::Mean(vec![0.0; bins]),
            Average::Median => Averaging::Median(vec![Vec::new(); bins]),
        }
    }

    fn add(&mut self, power: impl Iterator<Item = f64>) {
        match self {
            Averaging::Mean(sums) => {
                sums.iter_mut().zip(power).for_each(|(sum, power)| *sum += power);
            }
            Averaging::Median(bins) => {
                bins.iter_mut().zip(power).for_each(|(bin, power)| bin.push(power));
            }
        }
    }

    /// The average over `segments` segments.
    fn average(self, segments: usize) -> Vec<f64> {
        let count = segments as f64;
        let median = |mut bin: Vec<f64>| {
            median_in_place(&mut bin).unwrap_or(f64::NAN) / median_bias(segments)
        };
        match self {
            Averaging::Mean(sums) => sums.into_iter().map(|sum| sum / count).collect(),
            Averaging::Median(bins) => bins.into_iter().map(median).collect(),
        }
    }
}

/// The mean of the median of `count` values with an exponential distribution of mean 1. Allen et al. (2012),
/// doi:10.1103/PhysRevD.85.122006, appendix B.
fn median_bias(count: usize) -> f64 {
    let pairs = (1..=(count - 1) / 2).map(|k| 2.0 * k as f64);
    1.0 + pairs.map(|even| 1.0 / (even + 1.0) - 1.0 / even).sum::<f64>()
}

#[derive(Clone, Copy, PartialEq)]
pub(super) struct Lengths {
    segment: usize,
    step: usize,
    transform: usize,
}

/// Computes the power of one segment.
pub(crate) struct Transform {
    fourier: Arc<dyn RealToComplex<f64>>,
    weights: Vec<f64>,
    detrend: Detrend,
    scale: f64,
    buffer: Vec<f64>,
    output: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Transform {
    pub(super) fn new(settings: &Welch, lengths: Lengths) -> Transform {
        let fourier = RealFftPlanner::<f64>::new().plan_fft_forward(lengths.transform);
        let weights = settings.taper.weights(lengths.segment);
        let scale = match settings.scaling {
            Scaling::Density => settings.rate_hz * weights.iter().map(|w| w * w).sum::<f64>(),
            Scaling::Power => weights.iter().sum::<f64>().powi(2),
        };
        Transform {
            weights,
            detrend: settings.detrend,
            scale: 1.0 / scale,
            buffer: fourier.make_input_vec(),
            output: fourier.make_output_vec(),
            scratch: fourier.make_scratch_vec(),
            fourier,
        }
    }

    /// The one-sided power of a segment: all bins but those at zero and Nyquist stand for two frequencies.
    pub(crate) fn power(&mut self, segment: &[f64]) -> impl Iterator<Item = f64> {
        self.buffer.fill(0.0);
        let tapered = &mut self.buffer[..segment.len()];
        tapered.copy_from_slice(segment);
        self.detrend.apply(tapered);
        tapered.iter_mut().zip(&self.weights).for_each(|(value, weight)| *value *= weight);
        let done = self.fourier.process_with_scratch(
            &mut self.buffer,
            &mut self.output,
            &mut self.scratch,
        );
        done.expect("its buffers are of the lengths it asked for");
        let length = self.buffer.len();
        let sides = move |bin: usize| if bin == 0 || 2 * bin == length { 1.0 } else { 2.0 };
        let (bins, scale) = (self.output.iter().enumerate(), self.scale);
        bins.map(move |(bin, value)| value.norm_sqr() * scale * sides(bin))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::spectrum::Rule;

    fn noise(count: u32) -> Vec<f64> {
        (0..count).map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 1e6).collect()
    }

    #[test]
    fn a_gap_costs_its_segments_only() {
        let mut signal = noise(1024);
        let whole = Welch::new(100.0, 128).of(&signal).unwrap();
        signal[500] = f64::NAN;
        let gap = Welch::new(100.0, 128).of(&signal).unwrap();
        assert_eq!((whole.segments, gap.segments), (15, 13));
        let power = |spectrum: &Spectrum| spectrum.band_power(5.0, 45.0, Rule::Sum).unwrap();
        assert!((power(&gap) / power(&whole) - 1.0).abs() < 0.1);
    }

    #[test]
    fn the_density_adds_up_to_the_variance() {
        let settings = Welch { taper: Taper::Rectangular, ..Welch::new(100.0, 1000) };
        let signal = noise(1000);
        let mean = signal.iter().sum::<f64>() / 1000.0;
        let variance = signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 1000.0;
        let power = settings.of(&signal).unwrap().band_power(0.0, 51.0, Rule::Sum).unwrap();
        assert!((power / variance - 1.0).abs() < 1e-12);
    }

    #[test]
    fn settings_that_do_not_fit_are_refused() {
        let of = |settings: Welch| settings.of(&noise(100)).unwrap_err();
        assert!(matches!(of(Welch::new(0.0, 10)), SignalError::Rate { .. }));
        assert!(matches!(of(Welch::new(1.0, 0)), SignalError::Setting { .. }));
        let overlap = Welch { overlap: Some(10), ..Welch::new(1.0, 10) };
        assert!(matches!(of(overlap), SignalError::Setting { .. }));
        let transform = Welch { transform: Some(9), ..Welch::new(1.0, 10) };
        assert!(matches!(of(transform), SignalError::Setting { .. }));
        assert!(Welch::new(1.0, 10).of(&[]).is_err());
    }

    proptest! {
        #[test]
        fn any_signal_gives_finite_numbers_or_an_error(
            signal in prop::collection::vec(prop::num::f64::ANY, 0..80),
            segment in 0..40usize,
            rate_hz in prop::num::f64::ANY,
        ) {
            for rate_hz in [rate_hz, 1e9] {
                if let Ok(spectrum) = Welch::new(rate_hz, segment).of(&signal) {
                    prop_assert!(spectrum.power.iter().all(|power| power.is_finite()));
                }
            }
        }
    }
}
