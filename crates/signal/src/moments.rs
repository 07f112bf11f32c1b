//! Mean and variance.

/// The mean; NaN without values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Sum of squared deviations from the mean.
pub(crate) fn squares_about_mean(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|each| (each - mean).powi(2)).sum()
}

/// Variance with n − 1 in the denominator; NaN with fewer than two values.
pub(crate) fn sample_variance(values: &[f64]) -> f64 {
    if values.len() < 2 {
        f64::NAN
    } else {
        squares_about_mean(values) / (values.len() as f64 - 1.0)
    }
}

/// Standard deviation with n − 1 in the denominator; NaN with fewer than two values.
pub(crate) fn sample_sd(values: &[f64]) -> f64 {
    sample_variance(values).sqrt()
}
