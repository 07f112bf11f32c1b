//! Spectra of the pulse wave.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::pulse_wave::{WAVE_HZ, WaveSample};

/// The length of the segment for one spectrum [samples]: 15 s.
pub(super) const LENGTH: usize = 450;
/// The hop between spectra [samples]: 2.5 s.
const HOP: usize = 75;
/// The range of pulses [Hz]: 42 to 210 a minute; above it, up to `MOST_HZ`, is their second harmonic.
pub(super) const PULSES_HZ: (f64, f64) = (0.7, 3.5);
const MOST_HZ: f64 = 7.2;
/// The step of frequencies [Hz].
pub(super) const STEP_HZ: f64 = 0.02;
/// The number of frequencies.
pub(super) const COUNT: usize = 326;

/// The spectrum of a segment of 15 s.
#[derive(Clone, Debug)]
pub(super) struct Spectrum {
    /// The times of the first and the last sample [ns].
    pub first_ns: i64,
    pub last_ns: i64,
    /// The power of the pulse wave at each frequency from the lowest.
    pub pulse: Vec<f64>,
    /// The relative amplitudes of the brightness of the whole view and of the green of the skin, at each
    /// pulse frequency.
    pub view: Vec<f64>,
    pub green: Vec<f64>,
    /// The mean share of the view that is skin.
    pub skin: f64,
}

impl Spectrum {
    /// The frequency at an index [Hz].
    pub fn hz(place: f64) -> f64 {
        PULSES_HZ.0 + STEP_HZ * place
    }

    /// The indices of the pulse frequencies.
    pub fn of_pulses() -> std::ops::Range<usize> {
        0..((PULSES_HZ.1 - PULSES_HZ.0) / STEP_HZ).round() as usize + 1
    }
}

/// Computes spectra of a wave.
#[derive(Clone, Debug)]
pub(super) struct Spectra {
    samples: VecDeque<WaveSample>,
    until_next: usize,
    /// The taper (Hann).
    weights: Vec<f64>,
}

impl Default for Spectra {
    fn default() -> Spectra {
        debug_assert!(((MOST_HZ - PULSES_HZ.0) / STEP_HZ) as usize <= COUNT);
        let weight = |k: usize| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / LENGTH as f64).cos();
        Spectra {
            samples: VecDeque::with_capacity(LENGTH),
            until_next: 0,
            weights: (0..LENGTH).map(weight).collect(),
        }
    }
}

impl Spectra {
    /// Takes in the next sample; returns the spectrum of the last 15 s when one is due.
    pub fn push(&mut self, sample: WaveSample) -> Option<Spectrum> {
        if self.samples.len() == LENGTH {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        self.until_next = self.until_next.saturating_sub(1);
        if self.samples.len() < LENGTH || self.until_next > 0 {
            return None;
        }
        self.until_next = HOP;
        self.spectrum()
    }

    /// Handles an interruption of the wave.
    pub fn pause(&mut self) {
        self.samples.clear();
        self.until_next = 0;
    }

    fn spectrum(&self) -> Option<Spectrum> {
        let (first, last) = (self.samples.front()?, self.samples.back()?);
        let of = |number: &dyn Fn(&WaveSample) -> f64, count: usize| {
            let mean = self.samples.iter().map(number).sum::<f64>() / LENGTH as f64;
            let slope = self.slope(number, mean);
            let middle = (LENGTH - 1) as f64 / 2.0;
            let levelled = |(k, sample): (usize, &WaveSample)| {
                (number(sample) - mean - slope * (k as f64 - middle)) * self.weights[k]
            };
            let wave: Vec<f64> = self.samples.iter().enumerate().map(levelled).collect();
            let amplitudes: Vec<f64> =
                (0..count).map(|place| amplitude(&wave, Spectrum::hz(place as f64))).collect();
            (amplitudes, mean)
        };
        let pulses = Spectrum::of_pulses().len();
        let (pulse, _) = of(&|sample| sample.pulse, COUNT);
        let (view, brightness) = of(&|sample| sample.brightness, pulses);
        let (green, mean_green) = of(&|sample| sample.green, pulses);
        Some(Spectrum {
            first_ns: first.at_ns,
            last_ns: last.at_ns,
            pulse: pulse.into_iter().map(|amplitude| amplitude * amplitude).collect(),
            view: view.into_iter().map(|amplitude| amplitude / brightness).collect(),
            green: green.into_iter().map(|amplitude| amplitude / mean_green).collect(),
            skin: self.samples.iter().map(|sample| sample.skin).sum::<f64>() / LENGTH as f64,
        })
    }

    /// The slope of a quantity over the samples, per sample.
    fn slope(&self, number: &dyn Fn(&WaveSample) -> f64, mean: f64) -> f64 {
        let middle = (LENGTH - 1) as f64 / 2.0;
        let (mut product, mut square) = (0.0, 0.0);
        for (k, sample) in self.samples.iter().enumerate() {
            let x = k as f64 - middle;
            product += x * (number(sample) - mean);
            square += x * x;
        }
        product / square
    }
}

/// The amplitude of a tapered wave at a frequency [Hz], by Goertzel's recursion.
fn amplitude(wave: &[f64], hz: f64) -> f64 {
    let turn = TAU * hz / WAVE_HZ;
    let twice = 2.0 * turn.cos();
    let (mut before, mut last) = (0.0, 0.0);
    for sample in wave {
        (before, last) = (last, sample + twice * last - before);
    }
    let power = before * before + last * last - twice * before * last;
    // The mean weight of the taper is a half.
    power.max(0.0).sqrt() * 4.0 / wave.len() as f64
}
