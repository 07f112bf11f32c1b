//! The power of a segment in the bands of ECG quality.

use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use crate::spectrum::Taper;

/// Baseline wander, the QRS complex, the QRS complex with all faster components, and all frequencies [Hz] (Li et al.
/// 2008, doi:10.1088/0967-3334/29/1/002; Behar et al. 2013, doi:10.1109/TBME.2013.2240452).
const BANDS_HZ: [(f64, f64); 4] = [(0.0, 1.0), (5.0, 15.0), (5.0, 40.0), (0.0, 40.0)];

/// Band powers of segments of one length: Hann window, mean removed, summed over low ≤ f < high.
#[derive(Clone)]
pub(super) struct Bands {
    rate_hz: f64,
    fourier: Arc<dyn RealToComplex<f64>>,
    weights: Vec<f64>,
    buffer: Vec<f64>,
    output: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Bands {
    pub(super) fn new(rate_hz: f64, length: usize) -> Bands {
        let fourier = RealFftPlanner::<f64>::new().plan_fft_forward(length);
        Bands {
            rate_hz,
            weights: Taper::Hann.weights(length),
            buffer: fourier.make_input_vec(),
            output: fourier.make_output_vec(),
            scratch: fourier.make_scratch_vec(),
            fourier,
        }
    }

    /// The power in each band, up to a common factor.
    pub(super) fn powers(&mut self, piece: &[f64]) -> [f64; 4] {
        let mean = piece.iter().sum::<f64>() / piece.len() as f64;
        let weighted =
            piece.iter().zip(&self.weights).map(|(value, weight)| (value - mean) * weight);
        self.buffer.iter_mut().zip(weighted).for_each(|(place, value)| *place = value);
        let buffers = (&mut self.buffer, &mut self.output, &mut self.scratch);
        let done = self.fourier.process_with_scratch(buffers.0, buffers.1, buffers.2);
        done.expect("its buffers are of the lengths it asked for");
        let bin = |hz: f64| (hz * piece.len() as f64 / self.rate_hz).ceil() as usize;
        BANDS_HZ.map(|(low_hz, high_hz)| {
            let bins = bin(low_hz).min(self.output.len())..bin(high_hz).min(self.output.len());
            let doubled: f64 = self.output[bins].iter().map(Complex64::norm_sqr).sum();
            // All bins but the first stand for a positive and a negative frequency.
            doubled - if low_hz > 0.0 { 0.0 } else { self.output[0].norm_sqr() / 2.0 }
        })
    }
}
