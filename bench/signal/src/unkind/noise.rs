//! Noise that is added to signals.

use std::f64::consts::TAU;

use super::random::Random;

/// Makes noise with equal power in each octave and a standard deviation of 1.
pub fn pink(random: &mut Random, count: usize) -> Vec<f64> {
    let mut layers = [0.0f64; 14];
    let mut noise: Vec<f64> = (0..count)
        .map(|_| {
            for (octave, layer) in layers.iter_mut().enumerate() {
                let kept = (-0.5f64.powi(octave as i32)).exp();
                *layer = kept * *layer + (1.0 - kept * kept).sqrt() * random.normal();
            }
            layers.iter().sum()
        })
        .collect();
    let size = deviation(&noise);
    for value in &mut noise {
        *value /= size;
    }
    noise
}

pub fn white(random: &mut Random, count: usize) -> Vec<f64> {
    (0..count).map(|_| random.normal()).collect()
}

/// Makes a mixture of pink and white noise, with at most this much white noise.
pub fn mixed(random: &mut Random, count: usize, most_white: f64) -> Vec<f64> {
    let mut noise = pink(random, count);
    let fast = white(random, count);
    add(&mut noise, &fast, random.within(0.0..most_white));
    noise
}

/// Returns the share of its frequency by which mains hum wanders, for [`hum`]: 20 mHz, also if aliased.
pub fn mains_wander(hz: f64) -> f64 {
    0.02 / hz
}

/// Makes a sine with a frequency [Hz] that wanders by a share of itself over tens of seconds.
pub fn hum(random: &mut Random, count: usize, rate_hz: f64, hz: f64, wander: f64) -> Vec<f64> {
    let (mut phase, slow) = (TAU * random.share(), random.within(0.01..0.05));
    let turn = TAU * random.share();
    (0..count)
        .map(|k| {
            let at = hz * (1.0 + wander * (TAU * slow * k as f64 / rate_hz + turn).sin());
            phase += TAU * at / rate_hz;
            phase.sin()
        })
        .collect()
}

/// Makes the slow waves of breath, sweat and motion: three sines below 0.5 Hz, together up to 1.
pub fn wander(random: &mut Random, count: usize, rate_hz: f64) -> Vec<f64> {
    let waves: Vec<(f64, f64, f64)> = [0.02..0.08, 0.1..0.2, 0.2..0.45]
        .map(|hz| (random.within(hz), TAU * random.share(), random.within(0.2..0.4)))
        .to_vec();
    let value = |k: usize| -> f64 {
        let secs = k as f64 / rate_hz;
        waves.iter().map(|(hz, phase, height)| height * (TAU * hz * secs + phase).sin()).sum()
    };
    (0..count).map(value).collect()
}

pub fn add(signal: &mut [f64], other: &[f64], height: f64) {
    signal.iter_mut().zip(other).for_each(|(value, other)| *value += height * other);
}

pub fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}
