//! Sliding mean and variance.

use super::checked_length;
use super::fold::{Fold, Merge};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// Mean, variance and root mean square of the newest samples.
///
/// Amortised constant time. Merged as in Chan et al. (1983), doi:10.1080/00031305.1983.10483115, which is as
/// accurate as two passes.
#[derive(Clone, Debug)]
pub struct SlidingMoments {
    fold: Fold<Moments>,
}

#[derive(Clone, Copy, Debug)]
struct Moments {
    count: f64,
    mean: f64,
    /// The sum of squared deviations from the mean.
    deviations: f64,
}

impl SlidingMoments {
    /// Creates a window of `length` samples; an error unless 1 ≤ length ≤ [`MOST_SAMPLES`](super::MOST_SAMPLES).
    pub fn new(length: usize) -> Result<SlidingMoments, SignalError> {
        Ok(SlidingMoments { fold: Fold::new(checked_length(length)?) })
    }

    /// Takes in the next sample.
    pub fn push(&mut self, sample: f64) {
        let one = Moments { count: 1.0, mean: sample, deviations: 0.0 };
        self.fold.push(if is_usable(sample) { one } else { Moments::NOTHING });
    }

    /// The number of usable samples in the window.
    pub fn count(&self) -> usize {
        self.fold.merged().count as usize
    }

    /// The mean of the usable samples; `None` without any.
    pub fn mean(&self) -> Option<f64> {
        let moments = self.fold.merged();
        (moments.count > 0.0).then_some(moments.mean)
    }

    /// The variance of the usable samples, over n − 1; `None` with fewer than two.
    pub fn variance(&self) -> Option<f64> {
        let moments = self.fold.merged();
        (moments.count > 1.0).then(|| moments.deviations / (moments.count - 1.0))
    }

    /// The standard deviation of the usable samples, over n − 1; `None` with fewer than two.
    pub fn sd(&self) -> Option<f64> {
        self.variance().map(f64::sqrt)
    }

    /// The root mean square of the usable samples; `None` without any.
    pub fn rms(&self) -> Option<f64> {
        let moments = self.fold.merged();
        let square = moments.mean * moments.mean + moments.deviations / moments.count;
        (moments.count > 0.0).then(|| square.sqrt())
    }
}

impl Merge for Moments {
    const NOTHING: Moments = Moments { count: 0.0, mean: 0.0, deviations: 0.0 };

    fn merged(self, other: Moments) -> Moments {
        let count = self.count + other.count;
        if other.count == 0.0 || self.count == 0.0 {
            return if other.count == 0.0 { self } else { other };
        }
        let distance = other.mean - self.mean;
        let share = other.count / count;
        Moments {
            count,
            mean: self.mean + distance * share,
            deviations: self.deviations
                + other.deviations
                + distance * distance * self.count * share,
        }
    }
}
