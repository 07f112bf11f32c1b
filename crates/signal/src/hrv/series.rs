/// The finite intervals.
pub(super) fn present(intervals_ms: &[f64]) -> Vec<f64> {
    intervals_ms.iter().copied().filter(|each| each.is_finite()).collect()
}

/// Successive intervals, both finite.
pub(super) fn pairs(intervals_ms: &[f64]) -> Vec<(f64, f64)> {
    let pairs = intervals_ms.windows(2).map(|pair| (pair[0], pair[1]));
    pairs.filter(|(first, second)| first.is_finite() && second.is_finite()).collect()
}

/// Differences between successive intervals.
pub(super) fn differences(intervals_ms: &[f64]) -> Vec<f64> {
    pairs(intervals_ms).iter().map(|(first, second)| second - first).collect()
}
