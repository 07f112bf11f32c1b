//! Noise: seeded randomness, with a stream of its own for each thing that varies.

use std::f64::consts::TAU;
use std::ops::Range;

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// A seeded stream of random numbers, the same on every machine.
#[derive(Clone, Debug)]
pub struct Noise(Xoshiro256PlusPlus);

impl Noise {
    /// The stream of a seed.
    pub fn seeded(seed: u64) -> Noise {
        Noise(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// A stream of its own for a part, so that what one part draws never moves another.
    pub fn fork(&mut self) -> Noise {
        Noise::seeded(self.0.random())
    }

    /// A number from the range, all equally likely.
    pub fn uniform(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.0.random::<f64>()
    }

    /// A normal number of mean 0 and standard deviation 1, after Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (TAU * self.0.random::<f64>()).cos()
    }
}

/// A normal process of standard deviation 1 whose correlation falls off exponentially along a way
/// or a time.
#[derive(Clone, Debug)]
pub struct Correlated {
    value: f64,
    scale: f64,
    noise: Noise,
}

impl Correlated {
    /// A process whose correlation falls to 1/e over `scale`, in the unit of its steps.
    pub fn new(scale: f64, mut noise: Noise) -> Correlated {
        Correlated { value: noise.normal(), scale, noise }
    }

    /// Its value after another `step`.
    pub fn after(&mut self, step: f64) -> f64 {
        let kept = (-step / self.scale).exp();
        self.value = kept * self.value + (1.0 - kept * kept).sqrt() * self.noise.normal();
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_deviation_one() {
        let mut noise = Noise::seeded(7);
        let numbers: Vec<f64> = (0..20_000).map(|_| noise.normal()).collect();
        let mean = numbers.iter().sum::<f64>() / 20_000.0;
        let variance = numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.03, "{mean}");
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
    }

    #[test]
    fn a_correlated_process_falls_to_one_over_e_along_its_scale() {
        let mut process = Correlated::new(2.0, Noise::seeded(3));
        let values: Vec<f64> = (0..200_000).map(|_| process.after(0.5)).collect();
        let products = values.windows(5).map(|five| five[0] * five[4]).sum::<f64>();
        let correlation = products / values.len() as f64;
        assert!((correlation - (-1.0_f64).exp()).abs() < 0.03, "{correlation}");
    }
}
