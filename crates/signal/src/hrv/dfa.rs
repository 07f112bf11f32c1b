use std::ops::RangeInclusive;

use super::measure::Measure;
use super::series::present;
use crate::moments::mean;

/// Scales of the short-term exponent [beats].
pub const ALPHA1_BEATS: RangeInclusive<usize> = 4..=16;
/// Scales of the long-term exponent [beats].
pub const ALPHA2_BEATS: RangeInclusive<usize> = 16..=64;

/// Variances below this are zero [ms²], as in NeuroKit2.
const LEAST_VARIANCE: f64 = 1e-8;
/// The longest scale [beats].
const LONGEST_BEATS: usize = 4096;

/// Exponents of detrended fluctuation analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetrendedFluctuation {
    /// The exponent from 4 to 16 beats: 0.5 for noise, 1 for a healthy heart at rest, 1.5 for a random walk.
    pub alpha1: f64,
    /// The exponent from 16 to 64 beats; NaN with fewer than 65.
    pub alpha2: f64,
}

/// Detrended fluctuation analysis of intervals [ms]: [`dfa_alpha`] over both ranges of scales.
///
/// Window: 5 minutes for α1, more for α2. `None` with fewer than 17 intervals, or without fluctuation.
pub fn detrended_fluctuation(intervals_ms: &[f64]) -> Option<DetrendedFluctuation> {
    Some(DetrendedFluctuation {
        alpha1: dfa_alpha(intervals_ms, &ALPHA1_BEATS)?,
        alpha2: dfa_alpha(intervals_ms, &ALPHA2_BEATS).unwrap_or(f64::NAN),
    })
}

/// The scaling exponent of fluctuation: the slope of log F(s) over log s, each scale [beats] once.
///
/// F(s)² is the mean variance about a line of the cumulated deviations, in windows of s beats with 50 %
/// overlap. Peng et al. (1995), doi:10.1063/1.166141; as in NeuroKit2's `fractal_dfa` with the same scales (its
/// default for α1 is 4 to 11, for α2 12 to a tenth of the beats). Missing intervals are removed. `None` when
/// the longest scale is not shorter than the series, scales are fewer than two or below 3, or a scale has no
/// fluctuation.
pub fn dfa_alpha(intervals_ms: &[f64], scales_beats: &RangeInclusive<usize>) -> Option<f64> {
    let nn = present(intervals_ms);
    let (shortest, longest) = (*scales_beats.start(), *scales_beats.end());
    if shortest < 3 || longest <= shortest || longest >= nn.len() || longest > LONGEST_BEATS {
        return None;
    }
    let mean_nn = mean(&nn);
    let mut sum = 0.0;
    let summed = |each: &f64| {
        sum += each - mean_nn;
        sum
    };
    let profile: Vec<f64> = nn.iter().map(summed).collect();
    let point = |scale: usize| Some(((scale as f64).ln(), fluctuation(&profile, scale)?.ln()));
    let points = scales_beats.clone().map(point).collect::<Option<Vec<_>>>()?;
    let slope = slope(&points);
    slope.is_finite().then_some(slope)
}

/// F(s) over the windows of `scale` beats that deviate from a straight line; `None` if none does.
fn fluctuation(profile: &[f64], scale: usize) -> Option<f64> {
    let starts = (0..profile.len() - scale).step_by(scale / 2);
    let variances = starts.map(|start| variance_about_line(&profile[start..start + scale]));
    let (mut sum, mut count) = (0.0, 0.0);
    for variance in variances.filter(|&variance| variance > LEAST_VARIANCE) {
        sum += variance;
        count += 1.0;
    }
    (count > 0.0).then(|| f64::sqrt(sum / count))
}

fn variance_about_line(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (centre, mean) = ((n - 1.0) / 2.0, mean(values));
    let places = || (0..values.len()).map(|k| k as f64 - centre);
    let products: f64 = places().zip(values).map(|(x, y)| x * (y - mean)).sum();
    let slope = products / (n * (n * n - 1.0) / 12.0);
    let squares = places().zip(values).map(|(x, y)| (y - mean - slope * x).powi(2));
    squares.sum::<f64>() / n
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let centre = points.iter().map(|point| point.0).sum::<f64>() / n;
    let squares: f64 = points.iter().map(|(x, _)| (x - centre).powi(2)).sum();
    points.iter().map(|(x, y)| (x - centre) * y).sum::<f64>() / squares
}

impl DetrendedFluctuation {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([("HRV_DFA_alpha1", "1", self.alpha1), ("HRV_DFA_alpha2", "1", self.alpha2)])
    }
}
