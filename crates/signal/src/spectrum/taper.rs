//! Window functions.

use std::f64::consts::TAU;

/// The window function of a segment (periodic, as SciPy's for spectra).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taper {
    /// A raised cosine that reaches zero.
    Hann,
    /// A raised cosine that stays above zero.
    Hamming,
    /// Two cosine terms: a wider main lobe with less leakage.
    Blackman,
    /// No window.
    Rectangular,
}

impl Taper {
    /// The weights of a segment of `length` samples.
    pub fn weights(self, length: usize) -> Vec<f64> {
        let terms: &[f64] = match self {
            Taper::Hann => &[0.5, 0.5],
            Taper::Hamming => &[0.54, 0.46],
            Taper::Blackman => &[0.42, 0.5, 0.08],
            Taper::Rectangular => &[1.0],
        };
        if length == 1 {
            return vec![1.0];
        }
        (0..length).map(|k| cosines(terms, TAU * k as f64 / length as f64)).collect()
    }
}

/// t₀ − t₁ cos φ + t₂ cos 2φ …
fn cosines(terms: &[f64], phase: f64) -> f64 {
    let signs = [1.0, -1.0].into_iter().cycle();
    let waves = terms.iter().zip(signs).enumerate();
    waves.map(|(k, (term, sign))| sign * term * (k as f64 * phase).cos()).sum()
}
