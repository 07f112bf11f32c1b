//! Sliding median and quantiles.

use super::checked_length;
use super::tree::Tree;
use crate::error::SignalError;
use crate::gaps::is_usable;

/// Quantiles of the newest samples, in time logarithmic in the window.
#[derive(Clone, Debug)]
pub struct SlidingQuantiles {
    tree: Tree,
    /// The index that the next sample takes.
    next: usize,
}

impl SlidingQuantiles {
    /// Creates a window of `length` samples; an error unless 1 ≤ length ≤ [`MOST_SAMPLES`](super::MOST_SAMPLES).
    pub fn new(length: usize) -> Result<SlidingQuantiles, SignalError> {
        Ok(SlidingQuantiles { tree: Tree::new(checked_length(length)?), next: 0 })
    }

    /// Takes in the next sample.
    pub fn push(&mut self, sample: f64) {
        self.tree.remove(self.next);
        if is_usable(sample) {
            self.tree.insert(self.next, sample);
        }
        self.next = (self.next + 1) % self.tree.places();
    }

    /// The number of usable samples in the window.
    pub fn count(&self) -> usize {
        self.tree.count()
    }

    /// The median of the usable samples; `None` without any.
    pub fn median(&self) -> Option<f64> {
        let upper = self.count() / 2;
        let is_odd = self.count() % 2 == 1;
        let lower = if is_odd { upper } else { upper.checked_sub(1)? };
        Some(self.tree.ranked(lower)?.midpoint(self.tree.ranked(upper)?))
    }

    /// The value below which a `share` of the usable samples lies, interpolated linearly, as by `numpy.quantile`.
    ///
    /// `None` without usable samples, and for a share outside 0..=1.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        if !(0.0..=1.0).contains(&share) {
            return None;
        }
        let rank = share * self.count().checked_sub(1)? as f64;
        let (lower, upper) = (rank.floor() as usize, rank.ceil() as usize);
        let (low, high) = (self.tree.ranked(lower)?, self.tree.ranked(upper)?);
        Some(low + (high - low) * (rank - rank.floor()))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{MOST_SAMPLES, SlidingExtremes, SlidingMoments};
    use super::*;
    use crate::robust::median;

    /// Few distinct values, so that many are equal, and some unusable ones.
    fn samples() -> impl Strategy<Value = Vec<f64>> {
        let sample = prop_oneof![
            8 => (-20i32..20).prop_map(f64::from),
            4 => -1e6..1e6f64,
            1 => Just(f64::NAN),
            1 => Just(f64::INFINITY),
        ];
        prop::collection::vec(sample, 1..300)
    }

    fn usable(window: &[f64]) -> Vec<f64> {
        let mut usable: Vec<f64> = window.iter().copied().filter(|x| is_usable(*x)).collect();
        usable.sort_by(f64::total_cmp);
        usable
    }

    #[test]
    fn no_window_and_an_endless_one_are_refused() {
        assert!(SlidingMoments::new(0).is_err() && SlidingExtremes::new(0).is_err());
        assert!(SlidingQuantiles::new(0).is_err());
        assert!(SlidingQuantiles::new(MOST_SAMPLES + 1).is_err());
    }

    #[test]
    fn what_left_the_window_leaves_no_rounding_behind() {
        let mut moments = SlidingMoments::new(10).unwrap();
        (0..1000).for_each(|k| moments.push(1e15 + f64::from(k)));
        (0..20).for_each(|k| moments.push(f64::from(k % 2)));
        assert_eq!(moments.mean(), Some(0.5));
        assert!((moments.variance().unwrap() - 2.5 / 9.0).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn each_window_has_the_statistics_of_its_samples(samples in samples(), length in 1..40usize) {
            let mut moments = SlidingMoments::new(length).unwrap();
            let mut extremes = SlidingExtremes::new(length).unwrap();
            let mut quantiles = SlidingQuantiles::new(length).unwrap();
            for (k, &sample) in samples.iter().enumerate() {
                moments.push(sample);
                extremes.push(sample);
                quantiles.push(sample);
                let window = usable(&samples[(k + 1).saturating_sub(length)..=k]);
                let count = window.len() as f64;
                prop_assert_eq!((moments.count(), quantiles.count()), (window.len(), window.len()));
                prop_assert_eq!(extremes.least(), window.first().copied());
                prop_assert_eq!(extremes.greatest(), window.last().copied());
                prop_assert_eq!(quantiles.median(), median(&window));
                prop_assert_eq!(quantiles.quantile(1.0), window.last().copied());
                prop_assert_eq!(moments.mean().is_some(), !window.is_empty());
                if let (Some(mean), Some(rms)) = (moments.mean(), moments.rms()) {
                    let exact = window.iter().sum::<f64>() / count;
                    prop_assert!((mean - exact).abs() < 1e-9);
                    let square = window.iter().map(|x| x * x).sum::<f64>() / count;
                    prop_assert!((rms - square.sqrt()).abs() < 1e-8);
                    let deviations = window.iter().map(|x| (x - exact).powi(2)).sum::<f64>();
                    let variance = moments.variance().unwrap_or(0.0);
                    prop_assert!((variance * (count - 1.0) - deviations).abs() <= 1e-12 * deviations);
                }
            }
        }
    }
}
