//! The usual variation of the signal.

use std::collections::VecDeque;

use super::{LEAST_RATIO, LEAST_UV};
use crate::gaps::is_usable;
use crate::robust::quantile_in_place;

/// Ratio of standard deviation to interquartile range of a normal distribution, 1 / (2 Φ⁻¹(3/4)).
const SIGMA_FROM_IQR: f64 = 0.741_301_109_252_801;
/// The time over which a blink rises or falls [s].
const RISE_SECS: f64 = 0.15;
/// The memory of the estimate [s], and the initial learning time.
const MEMORY_SECS: f64 = 60.0;
const LEARNING_SECS: f64 = 2.0;

/// The usual deviation of the signal from the mean of its values 0.15 s before and after, as a standard
/// deviation: 0.7413 times the interquartile range over the last minute, robust to blinks and drift.
pub(super) struct Noise {
    rise: usize,
    newest: VecDeque<f64>,
    /// The deviations of the last minute in a ring buffer; NaN where one is missing.
    bends: Vec<f64>,
    next: usize,
    /// The deviations that are present, partially sorted on demand.
    known: Vec<f64>,
    learning: usize,
    counted: usize,
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
            counted: 0,
        }
    }

    /// The number of samples remembered.
    pub(super) fn length(&self) -> usize {
        self.bends.len()
    }

    /// Takes in the next sample at the working rate; NaN if it is missing.
    pub(super) fn push(&mut self, value: f64) {
        self.newest.pop_front();
        self.newest.push_back(value);
        let bend = self.newest[self.rise] - self.newest[0].midpoint(value);
        self.bends[self.next] = bend;
        self.next = (self.next + 1) % self.bends.len();
        self.counted = self.counted.saturating_add(usize::from(bend.is_finite()));
    }

    /// Whether a height [µV], of either sign, exceeds the usual variation; never in the first two seconds.
    pub(super) fn is_surpassed_by(&mut self, height_uv: f64) -> bool {
        let height_uv = height_uv.abs();
        height_uv >= LEAST_UV
            && self.sigma_uv().is_some_and(|sigma_uv| height_uv >= LEAST_RATIO * sigma_uv)
    }

    /// The usual variation [µV].
    fn sigma_uv(&mut self) -> Option<f64> {
        if self.counted < self.learning {
            return None;
        }
        self.known.clear();
        self.known.extend(self.bends.iter().filter(|bend| is_usable(**bend)));
        let mut quartile = |share: f64| quantile_in_place(&mut self.known, share);
        Some(SIGMA_FROM_IQR * (quartile(0.75)? - quartile(0.25)?))
    }
}
