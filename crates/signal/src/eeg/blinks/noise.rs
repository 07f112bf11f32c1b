//! How much the signal usually changes.

use std::collections::VecDeque;

use crate::error::SignalError;
use crate::sliding::SlidingQuantiles;

/// Standard deviation of a normal distribution over its interquartile range, 1 / (2 Φ⁻¹(3/4)).
const SIGMA_FROM_IQR: f64 = 0.741_301_109_252_801;
/// Over this time a blink rises, and falls [s].
const RISE_SECS: f64 = 0.15;
/// How long what is usual is remembered [s], and how long it is learnt at first.
const MEMORY_SECS: f64 = 60.0;
const LEARNING_SECS: f64 = 2.0;

/// How far the signal usually stands out of the mean of what is 0.15 s before and after, as a standard
/// deviation: 0.7413 times the range of the middle half of the last minute, which neither blinks nor
/// drift raise much.
pub(super) struct Noise {
    rise: usize,
    newest: VecDeque<f64>,
    bends: SlidingQuantiles,
    length: usize,
    learning: usize,
    told: usize,
}

impl Noise {
    pub(super) fn new(rate_hz: f64) -> Result<Noise, SignalError> {
        let length = (MEMORY_SECS * rate_hz).round() as usize;
        let rise = (RISE_SECS * rate_hz).round() as usize;
        Ok(Noise {
            rise,
            newest: std::iter::repeat_n(f64::NAN, 2 * rise + 1).collect(),
            bends: SlidingQuantiles::new(length)?,
            length,
            learning: (LEARNING_SECS * rate_hz) as usize,
            told: 0,
        })
    }

    /// How many samples are remembered.
    pub(super) fn length(&self) -> usize {
        self.length
    }

    /// Takes in the next sample of the working rate; NaN for one that is missing.
    pub(super) fn push(&mut self, value: f64) {
        self.newest.pop_front();
        self.newest.push_back(value);
        let bend = self.newest[self.rise] - self.newest[0].midpoint(value);
        self.bends.push(bend);
        self.told = self.told.saturating_add(usize::from(bend.is_finite()));
    }

    /// What is usual [µV]; `None` until two seconds were seen.
    pub(super) fn sigma_uv(&self) -> Option<f64> {
        let quartile = |share: f64| self.bends.quantile(share);
        let range = (self.told >= self.learning).then(|| Some(quartile(0.75)? - quartile(0.25)?));
        Some(SIGMA_FROM_IQR * range??)
    }
}
