//! How breathing modulates heartbeats: their heights, and the intervals between them.

use std::f64::consts::PI;

use super::fusion::STRETCH_SECS;
use super::grid::Grid;
use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, mad, median};

/// The plausible intervals between neighbouring beats [s]; others span missed beats or come from false ones.
const INTERVALS_SECS: (f64, f64) = (0.27, 2.2);
/// The largest deviation from the median, in 1.4826 · MAD.
const OUTLIER_SIGMAS: f64 = 4.0;
/// A spread below this share of the median is a rounding error.
const LEAST_SPREAD: f64 = 1e-9;

/// A heartbeat or a pulse with the quantities that breathing modulates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beat {
    /// The time of the beat [ns].
    pub(crate) at_ns: i64,
    /// The height of the beat by different definitions [any unit]; NaN where unknown.
    pub(crate) heights: [f64; 2],
}

/// The intervals between ascending beats [s], each at its midpoint since `begin_ns` [s].
pub(super) fn intervals(beats: &[Beat], begin_ns: i64) -> impl Iterator<Item = (f64, f64)> {
    let interval = move |pair: &[Beat]| {
        let [begin, end] = [0, 1].map(|which| secs_since(begin_ns, pair[which].at_ns));
        (begin.midpoint(end), end - begin)
    };
    let limits = INTERVALS_SECS.0..INTERVALS_SECS.1;
    beats.windows(2).map(interval).filter(move |(_, secs)| limits.contains(secs))
}

fn secs_since(begin_ns: i64, at_ns: i64) -> f64 {
    at_ns.saturating_sub(begin_ns) as f64 / 1e9
}

/// Values at ascending times within a segment [s since its start].
pub(super) struct Modulation {
    times_secs: Vec<f64>,
    values: Vec<f64>,
}

impl Modulation {
    /// The intervals between the beats of a segment.
    pub(super) fn of_intervals(beats: &[Beat], begin_ns: i64) -> Modulation {
        Modulation::without_outliers(intervals(beats, begin_ns).collect())
    }

    /// The usable heights of the beats of a segment.
    pub(super) fn of_heights(beats: &[Beat], begin_ns: i64, which: usize) -> Modulation {
        let points =
            beats.iter().map(|beat| (secs_since(begin_ns, beat.at_ns), beat.heights[which]));
        Modulation::without_outliers(points.filter(|(_, height)| is_usable(*height)).collect())
    }

    fn without_outliers(mut points: Vec<(f64, f64)>) -> Modulation {
        let values: Vec<f64> = points.iter().map(|point| point.1).collect();
        let centre = median(&values).unwrap_or(0.0);
        let reach = OUTLIER_SIGMAS * SIGMA_FROM_MAD * mad(&values).unwrap_or(0.0);
        points.retain(|(_, value)| (value - centre).abs() <= reach);
        let (times_secs, values) = points.into_iter().unzip();
        Modulation { times_secs, values }
    }

    pub(super) fn count(&self) -> usize {
        self.values.len()
    }

    pub(super) fn median(&self) -> Option<f64> {
        median(&self.values)
    }

    /// The normalised product of power and frequency; uniform for constant values.
    pub(super) fn shares(&self, grid: Grid) -> Vec<f64> {
        let weights = self.weights();
        let values = self.without_line(&weights);
        let points = self.times_secs.iter().zip(weights.iter().zip(&values));
        let points = points.map(|(time, (weight, value))| (*time, weight * value));
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

    /// The Hann window over the segment, at the times of the values.
    fn weights(&self) -> Vec<f64> {
        let weight = |time: &f64| (PI * time / STRETCH_SECS).sin().powi(2);
        self.times_secs.iter().map(weight).collect()
    }

    /// The values minus their weighted least-squares line.
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
