//! Breathing: rate, depth, and duration of inspiration.

use std::f64::consts::PI;

use super::state::State;
use super::step::{STEP_SECS, Step};
use super::traits::Traits;
use crate::noise::{Correlated, Noise};

/// The rise of the breathing rate at full workload [1/min]; the depth stays the same (Grassmann et al. 2016,
/// doi:10.1155/2016/8146809).
const RISE_PER_MIN: f64 = 5.0;
/// The relative variation of the rate, and its time constant [s].
const RATE_SIGMA: f64 = 0.05;
const RATE_SECS: f64 = 15.0;
/// The relative variation of the depth of breaths.
const DEPTH_SIGMA: f64 = 0.08;

/// A breath.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breath {
    /// When inhaling began, after the start [s].
    pub inhale_secs: f64,
    /// When exhaling began [s].
    pub exhale_secs: f64,
    /// The expansion of the chest, relative to the usual one.
    pub depth: f64,
}

/// The lungs of a body.
#[derive(Clone, Debug)]
pub struct Lungs {
    per_min: f64,
    inhale_share: f64,
    wander: Correlated,
    noise: Noise,
    /// The phase of the breath at the start of the present step [0..1], and the breathing rate [Hz].
    from_secs: f64,
    place: f64,
    per_sec: f64,
    depth: f64,
    next_depth: f64,
    inhale_secs: f64,
}

impl Lungs {
    /// Creates lungs at the start of a breath.
    pub fn new(traits: &Traits, mut noise: Noise) -> Lungs {
        Lungs {
            per_min: traits.breaths_per_min,
            inhale_share: traits.inhale_share,
            wander: Correlated::new(RATE_SECS, noise.fork()),
            from_secs: 0.0,
            place: 0.0,
            per_sec: 0.0,
            depth: 1.0,
            next_depth: noise.factor(DEPTH_SIGMA),
            inhale_secs: 0.0,
            noise,
        }
    }

    /// Advances by one step, and returns a breath as soon as it is exhaled.
    pub fn advance(&mut self, step: Step, state: State) -> Option<Breath> {
        self.settle();
        let per_min = self.per_min + RISE_PER_MIN * state.workload;
        let wander = (RATE_SIGMA * self.wander.after(STEP_SECS)).exp();
        (self.from_secs, self.per_sec) = (step.from_secs, per_min / 60.0 * wander);
        let end = self.place + self.per_sec * STEP_SECS;
        let when = |place: f64| step.from_secs + (place - self.place) / self.per_sec;
        let exhales = self.place < self.inhale_share && end >= self.inhale_share;
        let breath = Breath {
            inhale_secs: self.inhale_secs,
            exhale_secs: when(self.inhale_share),
            depth: self.depth,
        };
        if end >= 1.0 {
            self.inhale_secs = when(1.0);
        }
        exhales.then_some(breath)
    }

    /// Moves the start of the step to the end of the previous one.
    fn settle(&mut self) {
        self.place += self.per_sec * STEP_SECS;
        if self.place >= 1.0 {
            self.place -= 1.0;
            self.depth = self.next_depth;
            self.next_depth = self.noise.factor(DEPTH_SIGMA);
        }
    }

    /// The present breathing rate [1/min].
    pub fn rate_per_min(&self) -> f64 {
        60.0 * self.per_sec
    }

    /// The expansion of the chest at a time of the present step: from 0 after exhaling to about 1 after inhaling.
    pub fn volume(&self, secs: f64) -> f64 {
        let place = self.place + self.per_sec * (secs - self.from_secs);
        let (place, depth) =
            if place >= 1.0 { (place - 1.0, self.next_depth) } else { (place, self.depth) };
        let angle = if place < self.inhale_share {
            PI * place / self.inhale_share
        } else {
            PI * (1.0 + (place - self.inhale_share) / (1.0 - self.inhale_share))
        };
        0.5 * depth * (1.0 - angle.cos())
    }
}
