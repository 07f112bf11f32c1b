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

/// The mean; NaN of none.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation with n − 1 in the denominator; NaN with fewer than two values.
pub(super) fn sample_sd(values: &[f64]) -> f64 {
    sample_variance(values).sqrt()
}

/// Variance with n − 1 in the denominator; NaN with fewer than two values.
pub(super) fn sample_variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|each| (each - mean).powi(2)).sum();
    if values.len() < 2 { f64::NAN } else { squares / (values.len() as f64 - 1.0) }
}
