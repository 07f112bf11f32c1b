//! How much the signal usually changes.

use std::collections::VecDeque;

use super::{LEAST_RATIO, LEAST_UV};
use crate::gaps::is_usable;
use crate::robust::quantile_in_place;

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
    /// Of the last minute, in the order of a ring; NaN where there is none.
    bends: Vec<f64>,
    next: usize,
    /// Those there are, in any order: put in order as far as is asked, which is seldom.
    known: Vec<f64>,
    learning: usize,
    told: usize,
}

impl Noise {
    pub(super) fn new(rate_hz: f64) -> Noise {
        let length = (MEMORY_SECS * rate_hz).round() as usize;
        let rise = (RISE_SECS * rate_hz).round() as usize;
        Noise {
            rise,
            newest: std::iter::repeat_n(f64::NAN, 2 * rise + 1).collect(),
            bends: vec![f64::NAN; length],
            next: 0,
            known: Vec::with_capacity(length),
            learning: (LEARNING_SECS * rate_hz) as usize,
            told: 0,
        }
    }

    /// How many samples are remembered.
    pub(super) fn length(&self) -> usize {
        self.bends.len()
    }

    /// Takes in the next sample of the working rate; NaN for one that is missing.
    pub(super) fn push(&mut self, value: f64) {
        self.newest.pop_front();
        self.newest.push_back(value);
        let bend = self.newest[self.rise] - self.newest[0].midpoint(value);
        self.bends[self.next] = bend;
        self.next = (self.next + 1) % self.bends.len();
        self.told = self.told.saturating_add(usize::from(bend.is_finite()));
    }

    /// Whether something of a height [µV], up or down, stands out of what is usual; nothing does until
    /// two seconds were seen.
    pub(super) fn is_surpassed_by(&mut self, height_uv: f64) -> bool {
        let height_uv = height_uv.abs();
        height_uv >= LEAST_UV
            && self.sigma_uv().is_some_and(|sigma_uv| height_uv >= LEAST_RATIO * sigma_uv)
    }

    /// What is usual [µV].
    fn sigma_uv(&mut self) -> Option<f64> {
        if self.told < self.learning {
            return None;
        }
        self.known.clear();
        self.known.extend(self.bends.iter().filter(|bend| is_usable(**bend)));
        let mut quartile = |share: f64| quantile_in_place(&mut self.known, share);
        Some(SIGMA_FROM_IQR * (quartile(0.75)? - quartile(0.25)?))
    }
}
