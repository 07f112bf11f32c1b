//! The cross-correlation of two streams' onsets.

use super::onset::Onset;

/// The grid on which lags are compared [s].
const GRID_SECS: f64 = 0.001;
/// The assumed uncertainty of the lag between two onsets is limited to this range [s].
const KNOWN_SECS: (f64, f64) = (0.01, 0.1);
/// The largest distance between lags of one peak [s].
const PEAK_SECS: f64 = 0.05;

/// The lags at which two streams agree best.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peaks {
    /// The best lag [s], interpolated between grid points.
    pub lag_secs: f64,
    /// The correlation at the best lag [0..1].
    pub correlation: f64,
    /// The second best lag [s] and its correlation; `None` if no other onsets agree.
    pub next: Option<(f64, f64)>,
}

/// Finds the best lags within `max_lag_secs` either way; `None` if no two onsets are that close.
///
/// Each onset is a pulse as wide as its uncertainty. As the signals are zero between pulses, the pairs of
/// pulses are summed instead of the whole signals.
pub(super) fn correlate(a: &[Onset], b: &[Onset], max_lag_secs: f64) -> Option<Peaks> {
    let grid = sum_of_pairs(a, b, max_lag_secs);
    let norm = ((a.len() * b.len()) as f64).sqrt();
    let place = highest(&grid, |_| true)?;
    let apart = |other: usize| other.abs_diff(place) as f64 * GRID_SECS > peak_width(a, b);
    let lag_of = |place: f64| place * GRID_SECS - reach(max_lag_secs) as f64 * GRID_SECS;
    let next = highest(&grid, apart);
    Some(Peaks {
        lag_secs: lag_of(vertex(&grid, place)),
        correlation: (grid[place] / norm).min(1.0),
        next: next.map(|next| (lag_of(next as f64), (grid[next] / norm).min(1.0))),
    })
}

/// The pairs of onsets that match at a lag; each onset is in at most one pair.
pub(super) fn pairs(a: &[Onset], b: &[Onset], lag_secs: f64) -> Vec<(Onset, Onset)> {
    let mut pairs = Vec::new();
    let mut rest = b;
    for one in a {
        let distance = |other: &Onset| (other.at_secs - one.at_secs - lag_secs).abs();
        let passed = rest.iter().take_while(|other| other.at_secs < one.at_secs + lag_secs).count();
        let near = [passed.checked_sub(1), Some(passed)].into_iter().flatten();
        let near = near.filter(|place| *place < rest.len());
        let nearest = near.min_by(|x, y| distance(&rest[*x]).total_cmp(&distance(&rest[*y])));
        let Some(place) = nearest else { continue };
        let other = rest[place];
        if distance(&other) <= known(one, &other) {
            pairs.push((*one, other));
            rest = &rest[place + 1..];
        }
    }
    pairs
}

/// The unnormalised correlation at each grid point, from the most negative lag on.
fn sum_of_pairs(a: &[Onset], b: &[Onset], max_lag_secs: f64) -> Vec<f64> {
    let reach = reach(max_lag_secs);
    let mut grid = vec![0.0; 2 * reach + 1];
    let mut begin = 0;
    for one in a {
        let from_secs = one.at_secs - max_lag_secs;
        begin += b[begin..].iter().take_while(|other| other.at_secs < from_secs).count();
        let near =
            b[begin..].iter().take_while(|other| other.at_secs <= one.at_secs + max_lag_secs);
        for other in near {
            let center = (other.at_secs - one.at_secs) / GRID_SECS + reach as f64;
            let width = known(one, other) / GRID_SECS;
            let first = (center - width).max(0.0).ceil() as usize;
            let last = ((center + width) as usize).min(2 * reach);
            for (place, sum) in grid.iter_mut().enumerate().take(last + 1).skip(first) {
                *sum += (1.0 - (place as f64 - center).abs() / width).max(0.0);
            }
        }
    }
    grid
}

/// The uncertainty of the lag between two onsets [s].
fn known(a: &Onset, b: &Onset) -> f64 {
    (2.0 * (a.half_span_secs + b.half_span_secs)).clamp(KNOWN_SECS.0, KNOWN_SECS.1)
}

/// The width of a peak [s].
fn peak_width(a: &[Onset], b: &[Onset]) -> f64 {
    let widest = |onsets: &[Onset]| onsets.iter().fold(0.0, |most, it| it.half_span_secs.max(most));
    (2.0 * (widest(a) + widest(b))).clamp(PEAK_SECS, 4.0 * KNOWN_SECS.1)
}

/// The number of grid points from zero to the longest lag.
fn reach(max_lag_secs: f64) -> usize {
    (max_lag_secs / GRID_SECS).ceil() as usize
}

/// The index of the highest positive point among those selected.
fn highest(grid: &[f64], among: impl Fn(usize) -> bool) -> Option<usize> {
    let places = (0..grid.len()).filter(|place| among(*place) && grid[*place] > 0.0);
    places.max_by(|a, b| grid[*a].total_cmp(&grid[*b]))
}

/// The vertex of the parabola through a point and its neighbours.
fn vertex(grid: &[f64], place: usize) -> f64 {
    let around = place.checked_sub(1).and_then(|before| grid.get(before..=place + 1));
    let Some([before, at, after]) = around else { return place as f64 };
    let curve = before - 2.0 * at + after;
    let shift = if curve < 0.0 { (before - after) / (2.0 * curve) } else { 0.0 };
    place as f64 + shift.clamp(-0.5, 0.5)
}
