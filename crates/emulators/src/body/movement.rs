//! How the arm of a body is held, and how it moves.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::chance::Chance;
use super::step::{STEP_SECS, Step};
use super::traits::Traits;
use crate::noise::{Drift, Noise};

/// The rotation of the arm [rad], and its time constant [s].
const TILT_RAD: f64 = 0.15;
const TILT_SECS: f64 = 60.0;
/// The strength of a spontaneous movement [g].
const USUAL_G: Range<f64> = 0.03..0.12;
/// The duration of movements [s], and the frequency of their oscillation [Hz].
const LASTS_SECS: Range<f64> = 0.5..2.0;
const SWINGS_HZ: Range<f64> = 1.0..3.0;
/// The rate of movements while the script makes the body move [1/min].
const ASKED_PER_MIN: f64 = 120.0;

/// A movement of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// When the movement begins, after the start [s].
    pub from_secs: f64,
    /// When the movement ends [s].
    pub to_secs: f64,
    /// The strength of the movement [g].
    pub strength_g: f64,
    hz: f64,
    angle: f64,
    direction: [f64; 3],
}

/// The movements of a body.
#[derive(Clone, Debug)]
pub struct Movement {
    per_min: f64,
    by_itself: Mover,
    asked: Mover,
    swings: Vec<Swing>,
    tilts: [Drift; 2],
    gravity: [f64; 3],
}

/// A cause of movements.
#[derive(Clone, Debug)]
struct Mover {
    chance: Chance,
    noise: Noise,
}

impl Movement {
    /// Creates a seated body that moves spontaneously, according to its traits.
    pub fn new(traits: &Traits, mut noise: Noise) -> Movement {
        let mut mover = || Mover { chance: Chance::new(noise.fork()), noise: noise.fork() };
        let (by_itself, asked) = (mover(), mover());
        Movement {
            per_min: traits.movements_per_min,
            by_itself,
            asked,
            swings: Vec::new(),
            tilts: [Drift::new(TILT_SECS, noise.fork()), Drift::new(TILT_SECS, noise.fork())],
            gravity: [0.0, 0.0, 1.0],
        }
    }

    /// Advances by one step while the body moves with this strength [g], and returns the movements that begin in it.
    pub fn advance(&mut self, step: Step, movement_g: f64) -> impl Iterator<Item = Swing> {
        let [pitch, roll] = self.tilts.each_mut().map(|tilt| TILT_RAD * tilt.after(STEP_SECS));
        self.gravity = [pitch.sin(), -roll.sin() * pitch.cos(), roll.cos() * pitch.cos()];
        self.swings.retain(|swing| swing.to_secs > step.from_secs);
        if let Some(at_secs) = self.by_itself.chance.within(step, self.per_min) {
            let strength_g = self.by_itself.noise.uniform(USUAL_G);
            self.swings.push(self.by_itself.swing(at_secs, strength_g));
        }
        let asked_per_min = if movement_g > 0.0 { ASKED_PER_MIN } else { 0.0 };
        if let Some(at_secs) = self.asked.chance.within(step, asked_per_min) {
            let strength_g = movement_g * self.asked.noise.uniform(0.6..1.0);
            self.swings.push(self.asked.swing(at_secs, strength_g));
        }
        self.swings.iter().filter(move |swing| swing.from_secs >= step.from_secs).copied()
    }

    /// The acceleration at the wrist at a time of the present step [g].
    pub fn acceleration_g(&self, secs: f64) -> [f64; 3] {
        let mut sum = self.gravity;
        for swing in &self.swings {
            let strength = swing.at(secs);
            sum.iter_mut().zip(swing.direction).for_each(|(axis, part)| *axis += strength * part);
        }
        sum
    }

    /// The acceleration of a sensor on the skin by all movements, at a time of the present step [g].
    pub fn shake_g(&self, secs: f64) -> f64 {
        self.swings.iter().map(|swing| swing.at(secs)).sum()
    }
}

impl Mover {
    fn swing(&mut self, from_secs: f64, strength_g: f64) -> Swing {
        let noise = &mut self.noise;
        let direction: [f64; 3] = std::array::from_fn(|_| noise.normal());
        let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt().max(1e-9);
        Swing {
            from_secs,
            to_secs: from_secs + noise.uniform(LASTS_SECS),
            strength_g,
            hz: noise.uniform(SWINGS_HZ),
            angle: noise.uniform(0.0..TAU),
            direction: direction.map(|part| part / length),
        }
    }
}

impl Swing {
    fn at(&self, secs: f64) -> f64 {
        if !(self.from_secs..self.to_secs).contains(&secs) {
            return 0.0;
        }
        let after_secs = secs - self.from_secs;
        let swell = (PI * after_secs / (self.to_secs - self.from_secs)).sin().powi(2);
        self.strength_g * swell * (TAU * self.hz * after_secs + self.angle).sin()
    }
}
