use super::entropy::sample_entropy;
use super::series::present;
use crate::moments::mean;

/// The minimum number of beats at the coarsest scale of [`multiscale_index`].
const LEAST_BEATS: usize = 12;

/// Sample entropy of means of 1, 2, … up to `most_scale` successive intervals [ms].
///
/// `tolerance_ms` is the same at all scales. Costa et al. (2002), doi:10.1103/PhysRevLett.89.068102; as in
/// NeuroKit2's `entropy_multiscale`. NaN at scales without matching triples. Limits: needs some hundred
/// beats at the coarsest scale; five minutes are enough for the first three.
pub fn multiscale_entropy(intervals_ms: &[f64], tolerance_ms: f64, most_scale: usize) -> Vec<f64> {
    let nn = present(intervals_ms);
    let coarse = |scale: usize| nn.chunks_exact(scale).map(mean).collect::<Vec<f64>>();
    let entropy = |scale| sample_entropy(&coarse(scale), tolerance_ms).unwrap_or(f64::NAN);
    (1..=most_scale.min(nn.len())).map(entropy).collect()
}

/// NeuroKit2's multiscale entropy index: the area under [`multiscale_entropy`], divided by the number of
/// scales, up to a twelfth of the number of beats.
///
/// Scales with undefined entropy are left out. `None` if no scale has one.
pub fn multiscale_index(intervals_ms: &[f64], tolerance_ms: f64) -> Option<f64> {
    let most_scale = (present(intervals_ms).len() / LEAST_BEATS).saturating_sub(1);
    let scales = present(&multiscale_entropy(intervals_ms, tolerance_ms, most_scale));
    let (first, last) = (scales.first()?, scales.last()?);
    Some((scales.iter().sum::<f64>() - f64::midpoint(*first, *last)) / scales.len() as f64)
}
