/// Mean of at least one value.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Sum of squared deviations from the mean.
pub(crate) fn squares_about_mean(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|each| (each - mean).powi(2)).sum()
}

/// Standard deviation with n − 1 in the denominator; NaN with fewer than two values.
pub(crate) fn sample_sd(values: &[f64]) -> f64 {
    (squares_about_mean(values) / (values.len() as f64 - 1.0)).sqrt()
}
