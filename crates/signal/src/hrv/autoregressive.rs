//! The spectrum of an autoregressive model.

use std::f64::consts::TAU;

use crate::error::SignalError;
use crate::moments::mean;
use crate::spectrum::Spectrum;

/// Steps of the spectrum, up to half the sampling rate.
const STEPS: usize = 2048;

/// The spectrum of an even series, less its mean, by a model of `order` whose errors forwards and
/// backwards are least (Burg).
pub(super) fn burg(values: &[f64], rate_hz: f64, order: usize) -> Result<Spectrum, SignalError> {
    if values.len() <= 2 * order {
        return Err(SignalError::TooShort { count: values.len(), least: 2 * order + 1 });
    }
    let (coefficients, variance) = model(values, order);
    let step_hz = rate_hz / 2.0 / STEPS as f64;
    let frequencies_hz: Vec<f64> = (0..=STEPS).map(|k| k as f64 * step_hz).collect();
    // The model's polynomial on the unit circle, from its highest lag down (Horner).
    let power = |frequency_hz: &f64| {
        let (sin, cos) = (TAU * frequency_hz / rate_hz).sin_cos();
        let turned = |(real, imaginary): (f64, f64), coefficient: &f64| {
            let real = real + coefficient;
            (real * cos + imaginary * sin, imaginary * cos - real * sin)
        };
        let (real, imaginary) = coefficients.iter().rev().fold((0.0, 0.0), turned);
        2.0 * variance / rate_hz / ((1.0 + real).powi(2) + imaginary.powi(2))
    };
    let power: Vec<f64> = frequencies_hz.iter().map(power).collect();
    if power.iter().any(|each| !each.is_finite()) {
        return Err(SignalError::Constant);
    }
    Ok(Spectrum { frequencies_hz, power, segments: 1 })
}

/// The coefficients of lags 1 to `order`, and the variance of what they leave.
fn model(values: &[f64], order: usize) -> (Vec<f64>, f64) {
    let centre = mean(values);
    let mut forward: Vec<f64> = values.iter().map(|value| value - centre).collect();
    let mut backward = forward.clone();
    let mut variance = forward.iter().map(|each| each * each).sum::<f64>() / values.len() as f64;
    let mut coefficients: Vec<f64> = Vec::with_capacity(order);
    for lag in 1..=order {
        let pairs = || forward[lag..].iter().zip(&backward[lag - 1..]);
        let products: f64 = pairs().map(|(f, b)| f * b).sum();
        let squares: f64 = pairs().map(|(f, b)| f * f + b * b).sum();
        let reflection = -2.0 * products / squares;
        let reversed: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(reversed).for_each(|(each, other)| *each += reflection * other);
        coefficients.push(reflection);
        for k in (lag..forward.len()).rev() {
            let (f, b) = (forward[k], backward[k - 1]);
            forward[k] = f + reflection * b;
            backward[k] = b + reflection * f;
        }
        variance *= 1.0 - reflection * reflection;
    }
    (coefficients, variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_of_a_wave_stands_at_its_frequency() {
        let noise = |k: u32| f64::from(k * k % 997) / 997.0 - 0.5;
        let wave = |k: u32| 3.0 * (TAU * 0.25 * f64::from(k) / 4.0).sin() + 0.1 * noise(k);
        let spectrum = burg(&(0..1200).map(wave).collect::<Vec<_>>(), 4.0, 16).unwrap();
        let peak = spectrum.peak(0.1, 0.5).unwrap();
        assert!((peak.frequency_hz - 0.25).abs() < 0.002, "{peak:?}");
    }

    #[test]
    fn a_constant_has_no_spectrum() {
        assert_eq!(burg(&[800.0; 100], 4.0, 16), Err(SignalError::Constant));
    }
}
