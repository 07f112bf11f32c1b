//! The brain waves of a body, as recorded by electrodes behind the ears and over the forehead.

use std::f64::consts::{PI, TAU};

use super::state::State;
use super::step::STEP_SECS;
use super::traits::Traits;
use crate::noise::Noise;

/// The number of electrodes: TP9, AF7, AF8, TP10.
pub const ELECTRODES: usize = 4;
/// How strongly each electrode records the alpha rhythm, frontal theta, and blinks.
const ALPHA: [f64; ELECTRODES] = [1.0, 0.5, 0.5, 1.0];
const THETA: [f64; ELECTRODES] = [0.4, 1.0, 1.0, 0.4];
const BLINK: [f64; ELECTRODES] = [0.1, 1.0, 1.0, 0.1];
/// Which electrodes are on the left and thus record the alpha of the left side.
const LEFT: [bool; ELECTRODES] = [true, true, false, false];
/// The 1/f background from 0.5 to 32 Hz: common to all electrodes, and separate for each [µV RMS].
const COMMON_UV: f64 = 6.0;
const OWN_UV: f64 = 5.0;
/// The amplitude and frequency of frontal theta [µV RMS, Hz].
const THETA_UV: f64 = 3.0;
const THETA_HZ: f64 = 6.0;
/// The bandwidth of rhythms [Hz].
const WIDTH_HZ: f64 = 1.5;
/// The fall of alpha power and the rise of theta power at full workload.
const ALPHA_LOSS: f64 = 0.35;
const THETA_GAIN: f64 = 0.3;
/// The rise of alpha with closed eyes, and its time constant [s].
const CLOSED_EYES: f64 = 1.8;
const CLOSING_SECS: f64 = 0.5;
/// The asymmetry of frontal alpha at the most pleasant valence: ln(right) − ln(left) of its power is this much higher
/// than at neutral valence (Davidson 1992, doi:10.1111/j.1467-9280.1992.tb00254.x).
const ASYMMETRY: f64 = 0.3;
/// The share of alpha power that both sides have in common; the remainder is separate for each side.
const ALPHA_IN_COMMON: f64 = 0.6;

/// The brain of a body, as recorded by electrodes at a sampling rate.
#[derive(Clone, Debug)]
pub struct Brain {
    alpha_uv: f64,
    closed: f64,
    gains: Gains,
    common: Pink,
    own: [Pink; ELECTRODES],
    alphas: [Rhythm; 3],
    theta: Rhythm,
    noise: Noise,
}

/// The strength of the rhythms at each electrode [µV].
#[derive(Clone, Copy, Debug, Default)]
struct Gains {
    alpha_uv: [f64; ELECTRODES],
    theta_uv: [f64; ELECTRODES],
}

impl Brain {
    /// Creates a brain at rest, sampled at a rate [Hz].
    pub fn new(traits: &Traits, rate_hz: f64, noise: Noise) -> Brain {
        let mut brain = Brain {
            alpha_uv: traits.alpha_uv,
            closed: 1.0,
            gains: Gains::default(),
            common: Pink::new(rate_hz),
            own: std::array::from_fn(|_| Pink::new(rate_hz)),
            alphas: [Rhythm::new(traits.alpha_hz, rate_hz); 3],
            theta: Rhythm::new(THETA_HZ, rate_hz),
            noise,
        };
        brain.advance(State::default(), false);
        brain
    }

    /// Advances by one step.
    pub fn advance(&mut self, state: State, eyes_are_closed: bool) {
        let target = if eyes_are_closed { CLOSED_EYES } else { 1.0 };
        self.closed += (target - self.closed) * (1.0 - (-STEP_SECS / CLOSING_SECS).exp());
        let alpha_uv = self.alpha_uv * self.closed * (1.0 - ALPHA_LOSS * state.workload).sqrt();
        let theta_uv = THETA_UV * (1.0 + THETA_GAIN * state.workload).sqrt();
        // Half of the asymmetry for each side, and half again to convert power to amplitude.
        let leaning = ASYMMETRY * (2.0 * state.valence - 1.0) / 4.0;
        self.gains = Gains {
            alpha_uv: std::array::from_fn(|electrode| {
                let side = if LEFT[electrode] { -1.0 } else { 1.0 };
                let is_frontal = THETA[electrode] > ALPHA[electrode];
                let leaning = if is_frontal { (side * leaning).exp() } else { 1.0 };
                alpha_uv * ALPHA[electrode] * leaning
            }),
            theta_uv: THETA.map(|share| theta_uv * share),
        };
    }

    /// Returns the next voltages of the electrodes, with a blink of a given amplitude on the forehead [µV].
    pub fn next_uv(&mut self, blink_uv: f64) -> [f64; ELECTRODES] {
        let [first, second, third, fourth, fifth] = self.noise.normals();
        let common_uv = COMMON_UV * self.common.next(first);
        let theta = self.theta.next(second);
        let [both, left, right] = &mut self.alphas;
        let (both, left, right) = (both.next(third), left.next(fourth), right.next(fifth));
        let white: [f64; ELECTRODES] = self.noise.normals();
        std::array::from_fn(|electrode| {
            let side = if LEFT[electrode] { left } else { right };
            let alpha = ALPHA_IN_COMMON.sqrt() * both + (1.0 - ALPHA_IN_COMMON).sqrt() * side;
            let own_uv = OWN_UV * self.own[electrode].next(white[electrode]);
            common_uv
                + own_uv
                + self.gains.alpha_uv[electrode] * alpha
                + self.gains.theta_uv[electrode] * theta
                + BLINK[electrode] * blink_uv
        })
    }
}

/// A rhythm with standard deviation 1: white noise through a resonator.
#[derive(Clone, Copy, Debug)]
struct Rhythm {
    back: [f64; 2],
    gain: f64,
    values: [f64; 2],
}

impl Rhythm {
    fn new(hz: f64, rate_hz: f64) -> Rhythm {
        let radius = (-PI * WIDTH_HZ / rate_hz).exp();
        let (square, angle) = (radius * radius, TAU * hz / rate_hz);
        // Normalises the variance of a second-order autoregressive process driven by unit white noise.
        let falls = (1.0 - square) * (1.0 + square * square - 2.0 * square * (2.0 * angle).cos());
        let gain = (falls / (1.0 + square)).sqrt();
        Rhythm { back: [2.0 * radius * angle.cos(), -square], gain, values: [0.0; 2] }
    }

    fn next(&mut self, white: f64) -> f64 {
        let [one, two] = self.values;
        let value = self.back[0] * one + self.back[1] * two + self.gain * white;
        self.values = [value, one];
        value
    }
}

/// The poles that shape noise with a 1/f power spectrum [Hz].
const POLES_HZ: [f64; 4] = [0.5, 2.0, 8.0, 32.0];

/// Noise with a 1/f power spectrum and standard deviation 1: white noise through four poles.
#[derive(Clone, Copy, Debug)]
struct Pink {
    kept: [f64; POLES_HZ.len()],
    gains: [f64; POLES_HZ.len()],
    values: [f64; POLES_HZ.len()],
}

impl Pink {
    fn new(rate_hz: f64) -> Pink {
        let kept = POLES_HZ.map(|hz| (-TAU * hz / rate_hz).exp());
        let gains: [f64; POLES_HZ.len()] =
            std::array::from_fn(|pole| (1.0 - kept[pole]) / POLES_HZ[pole].sqrt());
        let pairs = (0..kept.len()).flat_map(|a| (0..kept.len()).map(move |b| (a, b)));
        let variance: f64 =
            pairs.map(|(a, b)| gains[a] * gains[b] / (1.0 - kept[a] * kept[b])).sum();
        let gains = gains.map(|gain| gain / variance.sqrt());
        Pink { kept, gains, values: [0.0; POLES_HZ.len()] }
    }

    fn next(&mut self, white: f64) -> f64 {
        for (pole, value) in self.values.iter_mut().enumerate() {
            *value = self.kept[pole] * *value + self.gains[pole] * white;
        }
        self.values.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deviation(values: &[f64]) -> f64 {
        (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn rhythms_and_background_have_deviation_one_at_any_rate() {
        for rate_hz in [128.0, 256.0, 1000.0] {
            let mut noise = Noise::seeded(1);
            let (mut pink, mut rhythm) = (Pink::new(rate_hz), Rhythm::new(10.0, rate_hz));
            let count = 400 * rate_hz as usize;
            let pinks: Vec<f64> = (0..count).map(|_| pink.next(noise.normal())).collect();
            let rhythms: Vec<f64> = (0..count).map(|_| rhythm.next(noise.normal())).collect();
            assert!((deviation(&pinks) - 1.0).abs() < 0.1, "{}", deviation(&pinks));
            assert!((deviation(&rhythms) - 1.0).abs() < 0.1, "{}", deviation(&rhythms));
        }
    }
}
