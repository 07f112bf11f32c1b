//! Band-pass kernels from derivatives of a Gaussian: smooth, short and without phase shift.

use std::f64::consts::TAU;

/// The number of products accumulated in parallel.
const LANES: usize = 8;

/// A derivative of a Gaussian as weights of the samples from `-half` to `half`, with gain 1 at its peak
/// frequency.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    half: usize,
    /// The weights, preceded by zeros that fill up the lanes.
    weights: Vec<f64>,
}

impl Kernel {
    /// The (negative) second derivative: the deflection itself, upright.
    pub(super) fn even(frequency_hz: f64, half: usize, rate_hz: f64) -> Kernel {
        let sigma = sigma_secs(2, frequency_hz) * rate_hz;
        let bell = samples(half, |place| (-(place / sigma).powi(2) / 2.0).exp());
        let mut weights = samples(half, |place| {
            let x = place / sigma;
            (1.0 - x * x) * (-x * x / 2.0).exp()
        });
        let excess = weights.iter().sum::<f64>() / bell.iter().sum::<f64>();
        weights.iter_mut().zip(bell).for_each(|(weight, bell)| *weight -= excess * bell);
        Kernel { half, weights }.normal(frequency_hz, rate_hz)
    }

    /// The third derivative: the slopes.
    pub(super) fn odd(frequency_hz: f64, half: usize, rate_hz: f64) -> Kernel {
        let sigma = sigma_secs(3, frequency_hz) * rate_hz;
        let weights = samples(half, |place| {
            let x = place / sigma;
            (x * x * x - 3.0 * x) * (-x * x / 2.0).exp()
        });
        Kernel { half, weights }.normal(frequency_hz, rate_hz)
    }

    /// The number of samples needed after the centre.
    pub(super) fn half(&self) -> usize {
        self.half
    }

    /// The number of samples needed, the last of them `half` after the centre.
    pub(super) fn length(&self) -> usize {
        self.weights.len()
    }

    /// The output at the centre.
    pub(super) fn apply(&self, samples: &[f64]) -> f64 {
        let mut sums = [0.0; LANES];
        let weights = self.weights.chunks_exact(LANES);
        for (samples, weights) in samples.chunks_exact(LANES).zip(weights) {
            for lane in 0..LANES {
                sums[lane] += samples[lane] * weights[lane];
            }
        }
        sums.iter().sum()
    }

    fn normal(mut self, frequency_hz: f64, rate_hz: f64) -> Kernel {
        let half = self.half as f64;
        let (mut real, mut imaginary) = (0.0, 0.0);
        for (index, weight) in self.weights.iter().enumerate() {
            let angle = TAU * frequency_hz * (index as f64 - half) / rate_hz;
            real += weight * angle.cos();
            imaginary += weight * angle.sin();
        }
        let gain = real.hypot(imaginary);
        self.weights.iter_mut().for_each(|weight| *weight /= gain);
        let filling = self.weights.len().next_multiple_of(LANES) - self.weights.len();
        self.weights.splice(..0, std::iter::repeat_n(0.0, filling));
        self
    }
}

/// The energy at the centre: the sum of the squared outputs of two kernels of one length.
pub(super) fn energy(even: &Kernel, odd: &Kernel, samples: &[f64]) -> f64 {
    let (mut evens, mut odds) = ([0.0; LANES], [0.0; LANES]);
    let weights = even.weights.chunks_exact(LANES).zip(odd.weights.chunks_exact(LANES));
    for (samples, (even, odd)) in samples.chunks_exact(LANES).zip(weights) {
        for lane in 0..LANES {
            evens[lane] += samples[lane] * even[lane];
            odds[lane] += samples[lane] * odd[lane];
        }
    }
    evens.iter().sum::<f64>().powi(2) + odds.iter().sum::<f64>().powi(2)
}

/// The width of the Gaussian whose derivative of this order peaks at a frequency [s].
pub(super) fn sigma_secs(order: u32, frequency_hz: f64) -> f64 {
    f64::from(order).sqrt() / (TAU * frequency_hz)
}

fn samples(half: usize, value: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=2 * half).map(|index| value(index as f64 - half as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_at_its_frequency_keeps_its_height_and_a_level_vanishes() {
        let (half, rate_hz) = (40, 360.0);
        let cosine = samples(half, |place| (TAU * 10.0 * place / rate_hz).cos() * 3.0);
        let even = Kernel::even(10.0, half, rate_hz);
        let filled = |newest: Vec<f64>| [vec![9.0; even.length() - newest.len()], newest].concat();
        assert!((even.apply(&filled(cosine)) - 3.0).abs() < 1e-12);
        assert!(even.apply(&filled(samples(half, |_| 1000.0))).abs() < 1e-9);
    }
}
