//! The values of a window between bounds.

use std::collections::VecDeque;

/// The values of a sliding window that are at least `from` and below `until`, in order of time, and the number of
/// values below them. Values leave at the front and enter at the back.
#[derive(Clone, Debug)]
pub(super) struct Band {
    pub(super) from: f64,
    pub(super) until: f64,
    pub(super) below: usize,
    pub(super) inside: VecDeque<f64>,
}

impl Band {
    pub(super) fn new(from: f64, until: f64) -> Band {
        Band { from, until, below: 0, inside: VecDeque::new() }
    }

    /// Appends values; NaN is ignored.
    pub(super) fn push(&mut self, values: impl Iterator<Item = f64> + Clone) {
        self.below += self.count_below(values.clone());
        let (from, until, inside) = (self.from, self.until, &mut self.inside);
        values
            .filter(|value| from <= *value && *value < until)
            .for_each(|value| inside.push_back(value));
    }

    /// Removes the first values, which are passed in.
    pub(super) fn pop(&mut self, values: impl Iterator<Item = f64> + Clone) {
        self.below -= self.count_below(values.clone());
        self.inside.drain(..self.count_inside(values));
    }

    fn holds(&self, value: f64) -> bool {
        self.from <= value && value < self.until
    }

    fn count_below(&self, values: impl Iterator<Item = f64>) -> usize {
        values.filter(|value| *value < self.from).count()
    }

    fn count_inside(&self, values: impl Iterator<Item = f64>) -> usize {
        values.filter(|value| self.holds(*value)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_leave_in_the_order_in_which_they_stand() {
        let mut band = Band::new(0.0, 2.0);
        band.push([1.5, -1.0, f64::NAN, 0.0, 2.0, 1.0].into_iter());
        assert_eq!((band.below, &band.inside), (1, &[1.5, 0.0, 1.0].into()));
        band.pop([1.5, -1.0, f64::NAN, 0.0].into_iter());
        assert_eq!((band.below, &band.inside), (0, &[1.0].into()));
    }
}
