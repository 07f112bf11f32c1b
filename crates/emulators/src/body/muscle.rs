//! The muscles of a forearm.

use std::ops::Range;

use teampulse_signal::error::SignalError;
use teampulse_signal::filter::{Cascade, Design, butterworth};

use super::chance::Chance;
use super::state::State;
use super::step::Step;
use super::traits::Traits;
use crate::noise::Noise;

/// The number of electrodes around the forearm: the first half is over the flexors, the second over the extensors.
pub const ELECTRODES: usize = 8;
/// The rise of tone at full workload, relative to rest.
const TONE_RISE: f64 = 0.2;
/// The variation between electrodes.
const ELECTRODE_SIGMA: f64 = 0.15;
/// The band of the signal: from `LOW_HZ` to `HIGH_HZ`, or to `HIGH_SHARE` of the rate if that is lower.
const LOW_HZ: f64 = 20.0;
const HIGH_HZ: f64 = 450.0;
const HIGH_SHARE: f64 = 0.45;
/// The rise and fall times of a contraction [s].
const RAMP_SECS: f64 = 0.03;
/// The co-contraction of the antagonists at rest and at full workload [0..1].
const CO_CONTRACTION: (f64, f64) = (0.2, 0.4);
/// The rate of spontaneous contractions [1/min], their duration [s] and strength [µV RMS].
const BY_ITSELF_PER_MIN: f64 = 1.0;
const LASTS_SECS: Range<f64> = 0.3..1.2;
const STRENGTH_UV: Range<f64> = 20.0..60.0;
/// The largest number of contractions that are active or pending at once.
const MOST_CONTRACTIONS: usize = 256;

/// A contraction of muscles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contraction {
    /// When the contraction begins, after the start [s].
    pub from_secs: f64,
    /// When the contraction ends [s].
    pub to_secs: f64,
    /// The strength over the contracting muscles [µV RMS].
    pub strength_uv: f64,
    /// Whether the flexors contract, or else the extensors.
    pub flexes: bool,
    /// The co-contraction of the antagonists [0..1].
    pub shared: f64,
}

/// The muscles of a body, as recorded by electrodes at a sampling rate.
#[derive(Clone, Debug)]
pub struct Muscles {
    tones_uv: [f64; ELECTRODES],
    tone_rise: f64,
    chance: Chance,
    noise: Noise,
    contractions: Vec<Contraction>,
    bands: [Cascade; ELECTRODES],
    /// The gain that gives the filtered noise a standard deviation of 1.
    gain: f64,
    fibres: Noise,
}

impl Muscles {
    /// Creates muscles at rest, sampled at a rate [Hz].
    pub fn new(traits: &Traits, rate_hz: f64, mut noise: Noise) -> Result<Muscles, SignalError> {
        let band = butterworth::band_pass(2, LOW_HZ, HIGH_HZ.min(HIGH_SHARE * rate_hz), rate_hz)?;
        let tone_uv = traits.muscle_tone_uv;
        Ok(Muscles {
            tones_uv: std::array::from_fn(|_| tone_uv * noise.factor(ELECTRODE_SIGMA)),
            tone_rise: 0.0,
            chance: Chance::new(noise.fork()),
            fibres: noise.fork(),
            noise,
            contractions: Vec::new(),
            gain: 1.0 / deviation(&band),
            bands: std::array::from_fn(|_| Cascade::at_rest(&band)),
        })
    }

    /// Adds a contraction, which may start now or later.
    pub fn contract(&mut self, contraction: Contraction) {
        if self.contractions.len() < MOST_CONTRACTIONS {
            self.contractions.push(contraction);
        }
    }

    /// Advances by one step, and returns the contractions that start in it.
    pub fn advance(&mut self, step: Step, state: State) -> impl Iterator<Item = Contraction> {
        self.tone_rise = 1.0 + TONE_RISE * state.workload;
        self.contractions.retain(|each| each.to_secs > step.from_secs);
        if let Some(from_secs) = self.chance.within(step, BY_ITSELF_PER_MIN) {
            let noise = &mut self.noise;
            let to_secs = from_secs + noise.uniform(LASTS_SECS);
            let strength_uv = noise.uniform(STRENGTH_UV);
            let flexes = noise.chance(0.5);
            let shared = shared(state);
            let contraction = Contraction { from_secs, to_secs, strength_uv, flexes, shared };
            self.contract(contraction);
        }
        let within = step.from_secs..step.to_secs;
        self.contractions.iter().filter(move |each| within.contains(&each.from_secs)).copied()
    }

    /// Returns the next voltages of the electrodes, at a time of the present step [µV].
    pub fn next_uv(&mut self, secs: f64) -> [f64; ELECTRODES] {
        let [flexors, extensors] = [true, false]
            .map(|flexors| self.contractions.iter().map(|c| c.power(secs, flexors)).sum::<f64>());
        let white: [f64; ELECTRODES] = self.fibres.normals();
        std::array::from_fn(|electrode| {
            let contracted = if electrode < ELECTRODES / 2 { flexors } else { extensors };
            let tone_uv = self.tones_uv[electrode] * self.tone_rise;
            let rms_uv = (tone_uv * tone_uv + contracted).sqrt();
            rms_uv * self.gain * self.bands[electrode].push(white[electrode])
        })
    }
}

/// Returns the co-contraction of the antagonists in a state [0..1].
pub fn shared(state: State) -> f64 {
    let (rest, full) = CO_CONTRACTION;
    rest + (full - rest) * state.workload
}

impl Contraction {
    /// The power that the contraction adds over the flexors or the extensors [µV²].
    fn power(&self, secs: f64, flexors: bool) -> f64 {
        let share = if flexors == self.flexes { 1.0 } else { self.shared };
        let ramp = ((secs - self.from_secs).min(self.to_secs - secs) / RAMP_SECS).clamp(0.0, 1.0);
        (self.strength_uv * share * ramp).powi(2)
    }
}

/// Returns the standard deviation of unit white noise after a filter, which is the norm of its impulse response.
fn deviation(band: &Design) -> f64 {
    let mut cascade = Cascade::at_rest(band);
    let ones = std::iter::once(1.0).chain(std::iter::repeat(0.0));
    ones.take(10_000).map(|one| cascade.push(one).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms(muscles: &mut Muscles, from: u32, to: u32) -> f64 {
        let squares: Vec<f64> =
            (from..to).map(|k| muscles.next_uv(f64::from(k) / 200.0)[0].powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn a_contraction_is_as_strong_as_it_says() {
        let traits = Traits { muscle_tone_uv: 3.0, ..Traits::of_seed(1) };
        let mut muscles = Muscles::new(&traits, 200.0, Noise::seeded(1)).unwrap();
        muscles.advance(Step::nth(0), State::default()).for_each(drop);
        let tone_uv = muscles.tones_uv[0];
        assert!((rms(&mut muscles, 0, 4000) / tone_uv - 1.0).abs() < 0.05);
        let (from_secs, to_secs) = (20.0, 40.0);
        let grip = Contraction { from_secs, to_secs, strength_uv: 50.0, flexes: true, shared: 0.2 };
        muscles.contract(grip);
        assert!((rms(&mut muscles, 4010, 7990) / 50.0 - 1.0).abs() < 0.05);
    }
}
