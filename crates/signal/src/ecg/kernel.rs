//! Band-pass kernels from derivatives of a Gaussian: smooth, short and without phase shift.

use std::f64::consts::TAU;

/// The number of products accumulated in parallel.
const LANES: usize = 4;

/// A derivative of a Gaussian as weights of the samples from `-half` to `half`, with gain 1 at its peak
/// frequency.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    half: usize,
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

    /// The output at the centre of an even kernel.
    pub(super) fn apply(&self, samples: &[f64]) -> f64 {
        let (before, after) = (&samples[..self.half], &samples[self.half + 1..]);
        let middle = self.weights[self.half] * samples[self.half];
        middle + folded(self.after(), before, after, |before, after| after + before)
    }

    /// The weights after the centre; those before it differ at most in sign.
    fn after(&self) -> &[f64] {
        &self.weights[self.half + 1..]
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
        self
    }
}

/// The energy at the centre: the sum of the squared outputs of an even and an odd kernel of one length.
pub(super) fn energy(even: &Kernel, odd: &Kernel, samples: &[f64]) -> f64 {
    let half = even.half;
    let (before, after) = (&samples[..half], &samples[half + 1..]);
    let middle = even.weights[half] * samples[half];
    let evens = middle + folded(even.after(), before, after, |before, after| after + before);
    let odds = folded(odd.after(), before, after, |before, after| after - before);
    evens.powi(2) + odds.powi(2)
}

/// The weighted sum of the samples after the centre, each combined with the one as far before it.
fn folded(
    weights: &[f64],
    before: &[f64],
    after: &[f64],
    combined: impl Fn(f64, f64) -> f64,
) -> f64 {
    let mut sums = [0.0; LANES];
    let mut weights = weights.chunks_exact(LANES);
    let mut before = before.rchunks_exact(LANES);
    let mut after = after.chunks_exact(LANES);
    for (weights, (before, after)) in weights.by_ref().zip(before.by_ref().zip(after.by_ref())) {
        for lane in 0..LANES {
            sums[lane] += weights[lane] * combined(before[LANES - 1 - lane], after[lane]);
        }
    }
    let rest = before.remainder().iter().rev().zip(after.remainder());
    for ((sum, weight), (before, after)) in sums.iter_mut().zip(weights.remainder()).zip(rest) {
        *sum += weight * combined(*before, *after);
    }
    sums.iter().sum()
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
        assert!((even.apply(&cosine) - 3.0).abs() < 1e-12);
        assert!(even.apply(&samples(half, |_| 1000.0)).abs() < 1e-9);
        let sine = samples(half, |place| (TAU * 10.0 * place / rate_hz).sin() * 3.0);
        let odd = Kernel::odd(10.0, half, rate_hz);
        assert!((energy(&even, &odd, &sine) - 9.0).abs() < 1e-12);
        assert!(energy(&even, &odd, &samples(half, |_| 1000.0)).abs() < 1e-9);
    }
}
