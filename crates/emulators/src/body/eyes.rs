//! The eyes: when they blink.

use super::chance::Chance;
use super::state::State;
use super::step::Step;
use super::traits::Traits;
use crate::noise::Noise;

/// The reduction of the blink rate at full workload, relative to rest.
const LOSS: f64 = 0.4;
/// The time from the start of a blink until the lid is down [s], and the standard deviations of the closing and of the
/// opening [s].
const DOWN_SECS: f64 = 0.12;
const DOWN_WIDTH_SECS: f64 = 0.035;
const UP_WIDTH_SECS: f64 = 0.07;
/// The amplitude of a blink on the forehead [µV], and its variation.
const HEIGHT_UV: f64 = 120.0;
const HEIGHT_SIGMA: f64 = 0.15;
/// The duration of a blink [s]; the next one begins at the earliest when it has passed.
const LAST_SECS: f64 = 0.5;

/// A blink of both eyes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blink {
    /// When the lids start to close [s].
    pub onset_secs: f64,
    /// When the lids are down [s].
    pub peak_secs: f64,
    /// The amplitude over the forehead [µV].
    pub height_uv: f64,
}

/// The eyes of a body.
#[derive(Clone, Debug)]
pub struct Eyes {
    per_min: f64,
    are_closed: bool,
    chance: Chance,
    noise: Noise,
    blink: Option<Blink>,
}

impl Eyes {
    /// Creates open eyes.
    pub fn new(traits: &Traits, mut noise: Noise) -> Eyes {
        let per_min = traits.blinks_per_min;
        let chance = Chance::new(noise.fork());
        Eyes { per_min, are_closed: false, chance, noise, blink: None }
    }

    /// Closes the eyes: they no longer blink.
    pub fn close(&mut self) {
        self.are_closed = true;
    }

    /// Opens the eyes.
    pub fn open(&mut self) {
        self.are_closed = false;
    }

    /// Whether the eyes are closed.
    pub fn are_closed(&self) -> bool {
        self.are_closed
    }

    /// Advances by one step, and returns the blink that begins in it.
    pub fn advance(&mut self, step: Step, state: State) -> Option<Blink> {
        let lasts = |blink: &Blink| step.from_secs <= blink.onset_secs + LAST_SECS;
        self.blink = self.blink.filter(lasts);
        let can_blink = !self.are_closed && self.blink.is_none();
        let per_min = if can_blink { self.per_min * (1.0 - LOSS * state.workload) } else { 0.0 };
        let onset_secs = self.chance.within(step, per_min)?;
        let height_uv = HEIGHT_UV * self.noise.factor(HEIGHT_SIGMA);
        self.blink = Some(Blink { onset_secs, peak_secs: onset_secs + DOWN_SECS, height_uv });
        self.blink
    }

    /// The voltage that a blink adds on the forehead at a time of the present step [µV].
    pub fn at_uv(&self, secs: f64) -> f64 {
        self.blink.map_or(0.0, |blink| blink.at_uv(secs))
    }
}

impl Blink {
    fn at_uv(&self, secs: f64) -> f64 {
        let after_secs = secs - self.peak_secs;
        let width_secs = if after_secs < 0.0 { DOWN_WIDTH_SECS } else { UP_WIDTH_SECS };
        self.height_uv * (-0.5 * (after_secs / width_secs).powi(2)).exp()
    }
}
