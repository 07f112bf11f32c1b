//! Sliding minimum and maximum.

use super::checked_length;
use super::fold::{Fold, Merge};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// Minimum and maximum of the newest samples, in amortised constant time.
#[derive(Clone, Debug)]
pub struct SlidingExtremes {
    fold: Fold<Extremes>,
}

#[derive(Clone, Copy, Debug)]
struct Extremes {
    least: f64,
    greatest: f64,
}

impl SlidingExtremes {
    /// Creates a window of `length` samples; an error unless 1 ≤ length ≤ [`MOST_SAMPLES`](super::MOST_SAMPLES).
    pub fn new(length: usize) -> Result<SlidingExtremes, SignalError> {
        Ok(SlidingExtremes { fold: Fold::new(checked_length(length)?) })
    }

    /// Takes in the next sample.
    pub fn push(&mut self, sample: f64) {
        let one = Extremes { least: sample, greatest: sample };
        self.fold.push(if is_usable(sample) { one } else { Extremes::NOTHING });
    }

    /// The smallest usable sample in the window. `None` without any.
    pub fn least(&self) -> Option<f64> {
        Some(self.fold.merged().least).filter(|least| least.is_finite())
    }

    /// The largest usable sample in the window. `None` without any.
    pub fn greatest(&self) -> Option<f64> {
        Some(self.fold.merged().greatest).filter(|greatest| greatest.is_finite())
    }
}

impl Merge for Extremes {
    const NOTHING: Extremes = Extremes { least: f64::INFINITY, greatest: f64::NEG_INFINITY };

    fn merged(self, other: Extremes) -> Extremes {
        let (least, greatest) = (self.least.min(other.least), self.greatest.max(other.greatest));
        Extremes { least, greatest }
    }
}
