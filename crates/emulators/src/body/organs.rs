//! The organs of a body, and how they depend on each other.

use super::brain::Brain;
use super::breath::Lungs;
use super::electrocardiogram::electrocardiogram;
use super::eyes::Eyes;
use super::heart::Heart;
use super::movement::Movement;
use super::muscle::{Contraction, Muscles, shared};
use super::probe::MOST_CHANNELS;
use super::rates::Rates;
use super::record::{Moment, Truth};
use super::sensor::Sensor;
use super::skin::Skin;
use super::state::{State, Transition};
use super::step::Step;
use super::traits::Traits;
use super::vessels::Vessels;
use super::warmth::Warmth;
use crate::noise::Noise;

/// The modulation by breathing of the R wave's height, as a share of it, and of the baseline [mV].
const R_WAVE_SWING: f64 = 0.12;
const BASE_SWING_MV: f64 = 0.06;
/// How strongly the forearm contracts during a movement of the arm [µV RMS per g].
const MOVING_UV_PER_G: f64 = 300.0;

/// All organs of a body.
#[derive(Clone, Debug)]
pub struct Organs {
    pub transition: Transition,
    pub skin: Skin,
    pub muscles: Muscles,
    pub eyes: Eyes,
    r_wave_mv: f64,
    lungs: Lungs,
    heart: Heart,
    vessels: Vessels,
    brain: Brain,
    warmth: Warmth,
    movement: Movement,
}

impl Organs {
    /// Creates the organs of a person, sampled at rates that can be simulated.
    pub fn new(traits: &Traits, rates: &Rates, noise: &mut Noise) -> Organs {
        let seen_hz = |sensor: Sensor| match rates.of(sensor) {
            0.0 => sensor.usual_rate_hz(),
            rate_hz => rate_hz,
        };
        let muscles = Muscles::new(traits, seen_hz(Sensor::Emg), noise.fork());
        Organs {
            transition: Transition::default(),
            r_wave_mv: traits.r_wave_mv,
            lungs: Lungs::new(traits, noise.fork()),
            heart: Heart::new(traits, noise.fork()),
            vessels: Vessels::new(traits, noise.fork()),
            skin: Skin::new(traits, noise.fork()),
            muscles: muscles.expect("the band is below half of every rate that can be simulated"),
            brain: Brain::new(traits, seen_hz(Sensor::Eeg), noise.fork()),
            eyes: Eyes::new(traits, noise.fork()),
            warmth: Warmth::new(traits, noise.fork()),
            movement: Movement::new(traits, noise.fork()),
        }
    }

    /// Advances by one step while the body moves with this strength [g].
    pub fn advance(&mut self, step: Step, movement_g: f64, truth: &mut Truth) {
        self.transition.advance();
        let state = self.transition.now();
        truth.breaths.extend(self.lungs.advance(step, state));
        let volume = self.lungs.volume(step.from_secs);
        if let Some(beat) = self.heart.advance(step, state, volume) {
            self.vessels.beat(beat, state, volume);
            truth.beats.push(beat);
        }
        truth.pulses.extend(self.vessels.advance(step));
        truth.responses.extend(self.skin.advance(step, state));
        truth.blinks.extend(self.eyes.advance(step, state));
        self.brain.advance(state, self.eyes.are_closed());
        self.warmth.advance(state);
        self.move_on(step, movement_g, state, truth);
        truth.contractions.extend(self.muscles.advance(step, state));
    }

    /// Moves the arm, which contracts its muscles.
    fn move_on(&mut self, step: Step, movement_g: f64, state: State, truth: &mut Truth) {
        for swing in self.movement.advance(step, movement_g) {
            truth.swings.push(swing);
            self.muscles.contract(Contraction {
                from_secs: swing.from_secs,
                to_secs: swing.to_secs,
                strength_uv: MOVING_UV_PER_G * swing.strength_g,
                flexes: true,
                shared: shared(state),
            });
        }
    }

    /// Returns the state of the body at the end of a step.
    pub fn moment(&self, step: Step) -> Moment {
        Moment {
            secs: step.to_secs,
            state: self.transition.now(),
            heart_rate_bpm: self.heart.rate_bpm(),
            breaths_per_min: self.lungs.rate_per_min(),
            skin_level_us: self.skin.level_us(),
            temperature_c: self.warmth.temperature_c(),
        }
    }

    /// The acceleration of the sensors by movements at a time of the present step [g].
    pub fn shake_g(&self, secs: f64) -> f64 {
        self.movement.shake_g(secs)
    }

    /// Returns the values of a sensor's channels at a time of the present step.
    pub fn give(&mut self, sensor: Sensor, secs: f64) -> [f64; MOST_CHANNELS] {
        let volume = || self.lungs.volume(secs);
        match sensor {
            Sensor::Ecg => first([self.ecg_mv(secs)]),
            Sensor::Ppg => first([self.vessels.at(secs, volume())]),
            Sensor::EdaWrist | Sensor::EdaFingers => first([self.skin.at(secs)]),
            Sensor::Emg => self.muscles.next_uv(secs),
            Sensor::Eeg => first(self.brain.next_uv(self.eyes.at_uv(secs))),
            Sensor::Respiration => first([volume()]),
            Sensor::Temperature => first([self.warmth.temperature_c()]),
            Sensor::Acceleration => first(self.movement.acceleration_g(secs)),
        }
    }

    fn ecg_mv(&self, secs: f64) -> f64 {
        let breath = self.lungs.volume(secs) - 0.5;
        let height_mv = self.r_wave_mv * (1.0 - R_WAVE_SWING * breath);
        height_mv * electrocardiogram(self.heart.place(secs)) + BASE_SWING_MV * breath
    }
}

fn first<const N: usize>(values: [f64; N]) -> [f64; MOST_CHANNELS] {
    std::array::from_fn(|channel| values.get(channel).copied().unwrap_or(0.0))
}
