use super::entropy::sample_entropy;
use super::series::present;
use crate::moments::mean;

/// Beats at the coarsest scale at least, in [`multiscale_index`].
const LEAST_BEATS: usize = 12;

/// Sample entropy of means of 1, 2, … up to `most_scale` successive intervals [ms].
///
/// Alike means the same `tolerance_ms` at all scales. Costa et al. (2002),
/// doi:10.1103/PhysRevLett.89.068102; as NeuroKit2's `entropy_multiscale`. NaN at scales without alike
/// triples. Limits: needs some hundred beats at the coarsest scale; five minutes are enough for the
/// first three.
pub fn multiscale_entropy(intervals_ms: &[f64], tolerance_ms: f64, most_scale: usize) -> Vec<f64> {
    let nn = present(intervals_ms);
    let coarse = |scale: usize| nn.chunks_exact(scale).map(mean).collect::<Vec<f64>>();
    let entropy = |scale| sample_entropy(&coarse(scale), tolerance_ms).unwrap_or(f64::NAN);
    (1..=most_scale.min(nn.len())).map(entropy).collect()
}

/// Area under [`multiscale_entropy`] over its scales, up to a twelfth of the beats, in its number of
/// scales: NeuroKit2's index.
///
/// Scales without an entropy are left out. `None` when there is none.
pub fn multiscale_index(intervals_ms: &[f64], tolerance_ms: f64) -> Option<f64> {
    let most_scale = (present(intervals_ms).len() / LEAST_BEATS).saturating_sub(1);
    let scales = present(&multiscale_entropy(intervals_ms, tolerance_ms, most_scale));
    let (first, last) = (scales.first()?, scales.last()?);
    Some((scales.iter().sum::<f64>() - f64::midpoint(*first, *last)) / scales.len() as f64)
}
