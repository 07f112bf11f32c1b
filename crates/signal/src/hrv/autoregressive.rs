//! The spectrum of an autoregressive model.

use std::f64::consts::TAU;

use crate::error::SignalError;
use crate::moments::mean;
use crate::spectrum::Spectrum;

/// The number of bins of the spectrum, up to Nyquist.
const STEPS: usize = 2048;
/// The number of bins computed in parallel, to hide latency.
const LANES: usize = 8;

/// Computes the spectrum of an evenly sampled series, mean removed, by Burg's method with a model of `order`, up to
/// `highest_hz` [Hz].
pub(super) fn burg(
    values: &[f64],
    rate_hz: f64,
    order: usize,
    highest_hz: f64,
) -> Result<Spectrum, SignalError> {
    if values.len() <= 2 * order {
        return Err(SignalError::TooShort { count: values.len(), least: 2 * order + 1 });
    }
    let (coefficients, variance) = model(values, order);
    let step_hz = rate_hz / 2.0 / STEPS as f64;
    let steps = ((highest_hz / step_hz).ceil() as usize).clamp(1, STEPS);
    let frequencies_hz: Vec<f64> = (0..=steps).map(|k| k as f64 * step_hz).collect();
    let mut power = vec![0.0; frequencies_hz.len()];
    for (power, frequencies_hz) in power.chunks_mut(LANES).zip(frequencies_hz.chunks(LANES)) {
        let mut sines = [(0.0, 0.0); LANES];
        for (sine, frequency_hz) in sines.iter_mut().zip(frequencies_hz) {
            *sine = (TAU * frequency_hz / rate_hz).sin_cos();
        }
        let gains = gains(&coefficients, sines);
        power.iter_mut().zip(gains).for_each(|(p, gain)| *p = 2.0 * variance / rate_hz / gain);
    }
    if power.iter().any(|each| !each.is_finite()) {
        return Err(SignalError::Constant);
    }
    Ok(Spectrum { frequencies_hz, power, segments: 1 })
}

/// The squared magnitude of the model's polynomial on the unit circle (Horner).
fn gains(coefficients: &[f64], sines: [(f64, f64); LANES]) -> [f64; LANES] {
    let (sin, cos) = (sines.map(|each| each.0), sines.map(|each| each.1));
    let (mut real, mut imaginary) = ([0.0; LANES], [0.0; LANES]);
    for coefficient in coefficients.iter().rev() {
        for lane in 0..LANES {
            let (x, y) = (real[lane] + coefficient, imaginary[lane]);
            real[lane] = x * cos[lane] + y * sin[lane];
            imaginary[lane] = y * cos[lane] - x * sin[lane];
        }
    }
    std::array::from_fn(|lane| (1.0 + real[lane]).powi(2) + imaginary[lane].powi(2))
}

/// The coefficients of lags 1 to `order`, and the residual variance.
fn model(values: &[f64], order: usize) -> (Vec<f64>, f64) {
    let centre = mean(values);
    let mut forward: Vec<f64> = values.iter().map(|value| value - centre).collect();
    let mut backward = forward.clone();
    let mut variance = forward.iter().map(|each| each * each).sum::<f64>() / values.len() as f64;
    let mut coefficients: Vec<f64> = Vec::with_capacity(order);
    for lag in 1..=order {
        // Forward errors, and backward errors of the value before, share an index.
        let count = values.len() - lag;
        let (forward, backward) = (&mut forward[lag..], &mut backward[..count]);
        let (products, squares) = sums(forward, backward);
        let reflection = -2.0 * products / squares;
        let reversed: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(reversed).for_each(|(each, other)| *each += reflection * other);
        coefficients.push(reflection);
        for (f, b) in forward.iter_mut().zip(backward) {
            (*f, *b) = (*f + reflection * *b, *b + reflection * *f);
        }
        variance *= 1.0 - reflection * reflection;
    }
    (coefficients, variance)
}

/// The sums of products of forward and backward errors, and of their squares.
fn sums(forward: &[f64], backward: &[f64]) -> (f64, f64) {
    let ((ones, rest), (others, other_rest)) = (forward.as_chunks(), backward.as_chunks());
    let (mut products, mut squares) = ([0.0; LANES], [0.0; LANES]);
    let mut add = |lane: usize, f: f64, b: f64| {
        products[lane] += f * b;
        squares[lane] += f * f + b * b;
    };
    for (one, other) in ones.iter().zip(others) {
        let (one, other): (&[f64; LANES], &[f64; LANES]) = (one, other);
        (0..LANES).for_each(|lane| add(lane, one[lane], other[lane]));
    }
    let rest = rest.iter().zip(other_rest).enumerate();
    rest.for_each(|(lane, (f, b))| add(lane, *f, *b));
    (products.iter().sum(), squares.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_of_a_wave_stands_at_its_frequency() {
        let noise = |k: u32| f64::from(k * k % 997) / 997.0 - 0.5;
        let wave = |k: u32| 3.0 * (TAU * 0.25 * f64::from(k) / 4.0).sin() + 0.1 * noise(k);
        let spectrum = burg(&(0..1200).map(wave).collect::<Vec<_>>(), 4.0, 16, 2.0).unwrap();
        let peak = spectrum.peak(0.1, 0.5).unwrap();
        assert!((peak.frequency_hz - 0.25).abs() < 0.002, "{peak:?}");
    }

    #[test]
    fn a_constant_has_no_spectrum() {
        assert_eq!(burg(&[800.0; 100], 4.0, 16, 2.0), Err(SignalError::Constant));
    }
}
