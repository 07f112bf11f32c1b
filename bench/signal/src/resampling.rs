//! Resamples recordings as if a slower device had made them.

use std::f64::consts::PI;

/// The number of samples at the new rate that contribute from each side.
const REACH: f64 = 16.0;

/// Returns the signal at another, lower rate, by a sinc under a Hann window, cut off at 45 % of that rate.
pub fn resampled(signal: &[f64], from_hz: f64, to_hz: f64) -> Vec<f64> {
    let step = from_hz / to_hz;
    let count = (signal.len() as f64 / step) as usize;
    (0..count).map(|index| sample_at(signal, index as f64 * step, step)).collect()
}

fn sample_at(signal: &[f64], place: f64, step: f64) -> f64 {
    let reach = REACH * step;
    let begin = (place - reach).ceil().max(0.0) as usize;
    let end = ((place + reach).floor() as usize).min(signal.len() - 1);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (index, sample) in (begin..).zip(&signal[begin..=end]) {
        let away = (index as f64 - place) / step;
        let weight = sinc(0.9 * away) * (1.0 + (PI * away / REACH).cos());
        sum += weight * sample;
        weights += weight;
    }
    sum / weights
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-9 { 1.0 } else { (PI * x).sin() / (PI * x) }
}
