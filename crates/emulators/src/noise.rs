//! Seeded random noise, with a separate stream for each quantity that varies.

use std::f64::consts::TAU;
use std::ops::Range;

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// A seeded stream of random numbers, the same on every machine.
#[derive(Clone, Debug)]
pub struct Noise(Xoshiro256PlusPlus);

impl Noise {
    /// Creates the stream with this seed.
    pub fn seeded(seed: u64) -> Noise {
        Noise(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Creates a separate stream for a part, so that the numbers drawn by one part never change another's.
    #[must_use]
    pub fn fork(&mut self) -> Noise {
        Noise::seeded(self.0.random())
    }

    /// Returns a uniformly distributed number from the range.
    pub fn uniform(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.0.random::<f64>()
    }

    /// Returns a normal number with mean 0 and standard deviation 1, after Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (TAU * self.0.random::<f64>()).cos()
    }

    /// Returns several normal numbers at once, at half the cost.
    pub fn normals<const N: usize>(&mut self) -> [f64; N] {
        let mut numbers = [0.0; N];
        for pair in numbers.chunks_mut(2) {
            let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
            let (sine, cosine) = (TAU * self.0.random::<f64>()).sin_cos();
            pair.iter_mut().zip([cosine, sine]).for_each(|(number, part)| *number = radius * part);
        }
        numbers
    }

    /// Returns a normal number around a mean, at most two standard deviations from it.
    pub fn around(&mut self, mean: f64, deviation: f64) -> f64 {
        mean + deviation * self.normal().clamp(-2.0, 2.0)
    }

    /// Returns a lognormal factor with mean 1; `sigma` is the standard deviation of its logarithm.
    pub fn factor(&mut self, sigma: f64) -> f64 {
        (sigma * self.normal() - 0.5 * sigma * sigma).exp()
    }

    /// Returns an exponential waiting time with mean 1.
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.0.random::<f64>()).ln()
    }

    /// Returns `true` with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }
}

/// A normal process with standard deviation 1 whose correlation falls exponentially with distance or time.
#[derive(Clone, Debug)]
pub struct Correlated {
    value: f64,
    scale: f64,
    noise: Noise,
}

impl Correlated {
    /// Creates a process whose correlation falls to 1/e over `scale`, in the unit of its steps.
    pub fn new(scale: f64, mut noise: Noise) -> Correlated {
        Correlated { value: noise.normal(), scale, noise }
    }

    /// Returns the value after another `step`.
    pub fn after(&mut self, step: f64) -> f64 {
        let kept = (-step / self.scale).exp();
        self.value = kept * self.value + (1.0 - kept * kept).sqrt() * self.noise.normal();
        self.value
    }
}

/// A normal process with a standard deviation of about 1 that wanders without jumps: its slope is finite.
#[derive(Clone, Debug)]
pub struct Drift {
    walk: Correlated,
    value: f64,
    scale: f64,
}

/// The time constant with which a drift follows its walk, as a share of the walk's scale.
const SMOOTH_SHARE: f64 = 0.2;

impl Drift {
    /// Creates a drift whose correlation falls to 1/e over about `scale`, in the unit of its steps.
    pub fn new(scale: f64, noise: Noise) -> Drift {
        let walk = Correlated::new(scale, noise);
        Drift { value: walk.value, scale, walk }
    }

    /// Returns the value after another `step`.
    pub fn after(&mut self, step: f64) -> f64 {
        // The smoothing divides the variance of the walk by 1 + SMOOTH_SHARE.
        let target = self.walk.after(step) * (1.0 + SMOOTH_SHARE).sqrt();
        self.value += (target - self.value) * (1.0 - (-step / (SMOOTH_SHARE * self.scale)).exp());
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_and_variance(numbers: &[f64]) -> (f64, f64) {
        let count = numbers.len() as f64;
        let mean = numbers.iter().sum::<f64>() / count;
        (mean, numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count)
    }

    #[test]
    fn normal_numbers_have_mean_zero_and_deviation_one() {
        let mut noise = Noise::seeded(7);
        let single: Vec<f64> = (0..20_000).map(|_| noise.normal()).collect();
        let together: Vec<f64> = (0..5_000).flat_map(|_| noise.normals::<5>()).collect();
        for numbers in [single, together] {
            let (mean, variance) = mean_and_variance(&numbers);
            assert!(mean.abs() < 0.03, "{mean}");
            assert!((variance - 1.0).abs() < 0.05, "{variance}");
        }
    }

    #[test]
    fn factors_and_waiting_times_have_mean_one() {
        let mut noise = Noise::seeded(8);
        let factors: Vec<f64> = (0..20_000).map(|_| noise.factor(0.5)).collect();
        let waits: Vec<f64> = (0..20_000).map(|_| noise.exponential()).collect();
        assert!((mean_and_variance(&factors).0 - 1.0).abs() < 0.02);
        assert!((mean_and_variance(&waits).0 - 1.0).abs() < 0.03);
    }

    #[test]
    fn a_correlated_process_falls_to_one_over_e_along_its_scale() {
        let mut process = Correlated::new(2.0, Noise::seeded(3));
        let values: Vec<f64> = (0..200_000).map(|_| process.after(0.5)).collect();
        let products = values.windows(5).map(|five| five[0] * five[4]).sum::<f64>();
        let correlation = products / values.len() as f64;
        assert!((correlation - (-1.0_f64).exp()).abs() < 0.03, "{correlation}");
    }

    #[test]
    fn a_drift_has_deviation_one_and_no_jumps() {
        let mut drift = Drift::new(10.0, Noise::seeded(5));
        let values: Vec<f64> = (0..400_000).map(|_| drift.after(0.1)).collect();
        let (_, variance) = mean_and_variance(&values);
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
        let most = values.windows(2).map(|two| (two[1] - two[0]).abs()).fold(0.0, f64::max);
        assert!(most < 0.4, "{most}");
    }
}
