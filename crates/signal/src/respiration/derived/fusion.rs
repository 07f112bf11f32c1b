//! The rhythm common to several modulations.

use super::grid::Grid;
use super::modulation::{Beat, Modulation};
use crate::estimate::Estimate;

/// The length of the segments with one rate each [s].
pub(super) const STRETCH_SECS: f64 = 30.0;
/// The length of the segments [ns].
pub(super) const STRETCH_NS: i64 = 30_000_000_000;
/// The slowest and the fastest breathing, and the grid between them [Hz].
const LOW_HZ: f64 = 4.0 / 60.0;
const HIGH_HZ: f64 = 45.0 / 60.0;
const STEP_HZ: f64 = 0.1 / 60.0;
/// The highest breathing rate that beats can resolve, as a share of their rate; the theoretical limit is half.
const HIGHEST_SHARE: f64 = 0.47;
/// The width of the peak of steady breathing with a Hann window.
const PEAK_HZ: f64 = 1.5 / STRETCH_SECS;
/// The floor of each modulation at every frequency, as a multiple of the mean share: a modulation may lack the rhythm.
const FLOOR: f64 = 0.1;
/// The smallest share of the product around its peak for a segment to count.
const LEAST_CLARITY: f64 = 0.8;
/// The largest uncertainty of a segment that counts [1/min].
const LARGEST_SIGMA: f64 = 2.0;
/// The slowest breathing above half the heart rate that counts as implausible [1/min]: at rest, with a heart that slow,
/// nobody breathes faster.
const LEAST_FOLDED_PER_MIN: f64 = 34.0;
/// The fewest beats or intervals in a segment.
const FEWEST_VALUES: usize = 12;

/// The result of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) rate_per_min: Estimate,
    /// The share of the product around its peak [0..1].
    pub(super) clarity: f64,
}

/// The result of the segment of beats that begins at `begin_ns` [ns].
pub(super) fn rate_of_stretch(beats: &[Beat], begin_ns: i64) -> Option<Stretch> {
    let intervals = Modulation::of_intervals(beats, begin_ns);
    let beat_secs = intervals.median()?;
    let high_hz = (HIGHEST_SHARE / beat_secs).min(HIGH_HZ);
    let heights = (0..2).map(|which| Modulation::of_heights(beats, begin_ns, which));
    let all = std::iter::once(intervals).chain(heights);
    let all: Vec<Modulation> = all.filter(|each| each.count() >= FEWEST_VALUES).collect();
    let count = ((high_hz - LOW_HZ) / STEP_HZ).max(0.0) as usize;
    if all.len() < 2 || count < 2 {
        return None;
    }
    let grid = Grid { low_hz: LOW_HZ, step_hz: STEP_HZ, count };
    let common = product(all.iter().map(|each| each.shares(grid)), all.len(), count);
    let peak = peak_of(&common, grid)?;
    // Sampled once per beat, breaths this fast look the same.
    let folded_per_min = 60.0 / beat_secs - peak.rate_per_min.value;
    let is_folded = folded_per_min < LEAST_FOLDED_PER_MIN;
    let gives =
        !is_folded && peak.clarity >= LEAST_CLARITY && peak.rate_per_min.sigma <= LARGEST_SIGMA;
    gives.then_some(peak)
}

/// The rate at the maximum of the product, and the spread around it.
fn peak_of(common: &[f64], grid: Grid) -> Option<Stretch> {
    let places = 0..grid.count;
    let peak = places.clone().max_by(|&a, &b| common[a].total_cmp(&common[b]))?;
    let away_hz = |k: usize| grid.hz(k) - grid.hz(peak);
    let near = places.clone().filter(|&k| away_hz(k).abs() <= PEAK_HZ);
    let clarity = near.map(|k| common[k]).sum::<f64>() / common.iter().sum::<f64>();
    let squares: f64 = common.iter().map(|each| each * each).sum();
    let spread: f64 = places.map(|k| (common[k] * away_hz(k)).powi(2)).sum();
    let sigma = 60.0 * (spread / squares).sqrt();
    Some(Stretch { rate_per_min: Estimate { value: 60.0 * grid.hz(peak), sigma }, clarity })
}

/// The product of the shares with their floors; for more than two modulations, normalised to the sharpness of two.
fn product(shares: impl Iterator<Item = Vec<f64>>, modulations: usize, count: usize) -> Vec<f64> {
    let mut product = vec![1.0; count];
    for shares in shares {
        let factors = shares.into_iter().map(|share| share * count as f64 + FLOOR);
        product.iter_mut().zip(factors).for_each(|(product, factor)| *product *= factor);
    }
    let power = 2.0 / modulations as f64;
    product.into_iter().map(|each: f64| each.powf(power)).collect()
}
