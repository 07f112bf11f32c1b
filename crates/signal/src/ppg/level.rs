//! The usual power of a signal.

use crate::recent::Recent;

/// The median of the mean power of the last eight seconds, fewer at first.
///
/// Unlike a mean, it is robust to a few seconds of motion.
#[derive(Clone, Debug)]
pub(super) struct Level {
    second: usize,
    sum: f64,
    count: usize,
    seconds: Recent,
    usual: Option<f64>,
}

impl Level {
    pub(super) fn new(rate_hz: f64) -> Level {
        let second = rate_hz.round().max(1.0) as usize;
        Level { second, sum: 0.0, count: 0, seconds: Recent::default(), usual: None }
    }

    pub(super) fn push(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
        if self.count == self.second {
            self.seconds.push(self.sum / self.count as f64);
            self.usual = self.seconds.median();
            (self.sum, self.count) = (0.0, 0);
        }
    }

    pub(super) fn usual(&self) -> f64 {
        self.usual.unwrap_or_else(|| self.sum / self.count.max(1) as f64)
    }
}
