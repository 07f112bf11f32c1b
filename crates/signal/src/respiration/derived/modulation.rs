//! What breathing modulates, once a beat.

use std::f64::consts::PI;
use std::ops::Range;

use super::grid::Grid;
use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, mad, median};

/// Intervals between neighbouring beats [s]; others span missed beats or part false ones.
const INTERVALS_SECS: (f64, f64) = (0.27, 2.2);
/// Values farther from the median are no modulation [1.4826 · MAD].
const OUTLIER_SIGMAS: f64 = 4.0;
/// A smaller spread is that of rounding [share of the median].
const LEAST_SPREAD: f64 = 1e-9;

/// Values at ascending times [s].
pub(super) struct Modulation {
    times_secs: Vec<f64>,
    values: Vec<f64>,
}

/// The intervals between the beats of a window [s], each at its middle.
pub(super) fn intervals(times_secs: &[f64], window: &Range<f64>) -> Modulation {
    let beats = Modulation::at(times_secs, times_secs, window);
    let neighbours = beats.times_secs.windows(2).map(|pair| (pair[0], pair[1] - pair[0]));
    let is_interval =
        |&(_, secs): &(f64, f64)| (INTERVALS_SECS.0..INTERVALS_SECS.1).contains(&secs);
    let points = neighbours.filter(is_interval).map(|(begin, secs)| (begin + secs / 2.0, secs));
    let (times_secs, values) = points.unzip();
    Modulation { times_secs, values }
}

impl Modulation {
    /// The usable values at those times of a window that ascend.
    pub(super) fn at(times_secs: &[f64], values: &[f64], window: &Range<f64>) -> Modulation {
        let mut last = f64::NEG_INFINITY;
        let points = times_secs.iter().copied().zip(values.iter().copied());
        let in_order = |&(time, value): &(f64, f64)| {
            let fits = window.contains(&time) && time > last && is_usable(value);
            last = if fits { time } else { last };
            fits
        };
        let (times_secs, values) = points.filter(in_order).unzip();
        Modulation { times_secs, values }
    }

    pub(super) fn count(&self) -> usize {
        self.values.len()
    }

    /// How much time intervals cover [s].
    pub(super) fn covered_secs(&self) -> f64 {
        self.values.iter().sum()
    }

    pub(super) fn median(&self) -> Option<f64> {
        median(&self.values)
    }

    /// The part within a stretch, without its outliers.
    pub(super) fn within(&self, stretch: &Range<f64>) -> Modulation {
        let place = |secs: f64| self.times_secs.partition_point(|&time| time < secs);
        let (begin, end) = (place(stretch.start), place(stretch.end));
        let (times, values) = (&self.times_secs[begin..end], &self.values[begin..end]);
        let centre = median(values).unwrap_or(0.0);
        let reach = OUTLIER_SIGMAS * SIGMA_FROM_MAD * mad(values).unwrap_or(0.0);
        let points = times.iter().copied().zip(values.iter().copied());
        let (times_secs, values) =
            points.filter(|(_, value)| (value - centre).abs() <= reach).unzip();
        Modulation { times_secs, values }
    }

    /// The share of each frequency in the power times frequency within a stretch; an even share of
    /// each for values that don't vary.
    pub(super) fn shares(&self, stretch: &Range<f64>, grid: Grid) -> Vec<f64> {
        let weights = self.weights(stretch);
        let values = self.without_line(&weights);
        let points = self.times_secs.iter().zip(weights.iter().zip(&values));
        let points = points.map(|(time, (weight, value))| (time - stretch.start, weight * value));
        let mut shares = grid.powers(points);
        for (place, power) in shares.iter_mut().enumerate() {
            *power *= grid.hz(place);
        }
        let total: f64 = shares.iter().sum();
        if !(total > 0.0 && total.is_finite()) || self.is_flat(&values) {
            return vec![1.0 / shares.len() as f64; shares.len()];
        }
        shares.into_iter().map(|power| power / total).collect()
    }

    /// Hann's window over the stretch, at the times of the values.
    fn weights(&self, stretch: &Range<f64>) -> Vec<f64> {
        let length = stretch.end - stretch.start;
        let share = self.times_secs.iter().map(|time| (time - stretch.start) / length);
        share.map(|share| (PI * share).sin().powi(2)).collect()
    }

    /// The values above their weighted line of least squares.
    fn without_line(&self, weights: &[f64]) -> Vec<f64> {
        let sum =
            |of: &dyn Fn(usize) -> f64| (0..weights.len()).map(|k| weights[k] * of(k)).sum::<f64>();
        let all = sum(&|_| 1.0);
        let (time, value) = (sum(&|k| self.times_secs[k]) / all, sum(&|k| self.values[k]) / all);
        let squares = sum(&|k| (self.times_secs[k] - time).powi(2));
        let products = sum(&|k| (self.times_secs[k] - time) * (self.values[k] - value));
        let slope = if squares > 0.0 { products / squares } else { 0.0 };
        let above = |(at, each): (&f64, &f64)| each - value - slope * (at - time);
        self.times_secs.iter().zip(&self.values).map(above).collect()
    }

    fn is_flat(&self, above_line: &[f64]) -> bool {
        let largest =
            |values: &[f64]| values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        largest(above_line) <= LEAST_SPREAD * largest(&self.values)
    }
}
