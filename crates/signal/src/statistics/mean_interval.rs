use super::distributions::t_quantile;
use super::error::{StatisticsError, checked, checked_level, finite_or};
use crate::moments::{mean, sample_sd};

/// An interval that contains the true value with a stated confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end of the interval.
    pub low: f64,
    /// The upper end of the interval.
    pub high: f64,
}

/// Computes the confidence interval of a mean, x̄ ± t(1 − α/2, n − 1) · s/√n, in the unit of the values.
///
/// `level` is the confidence (0.95). For paired values pass the differences. Student (1908),
/// doi:10.2307/2331554; as `scipy.stats.ttest_1samp(...).confidence_interval`. Limits: needs at least two
/// independent, nearly normal values; otherwise see [`bootstrap`](super::bootstrap).
pub fn mean_interval(values: &[f64], level: f64) -> Result<Interval, StatisticsError> {
    let level = checked_level(level)?;
    checked(&[values], 1, 2)?;
    let n = values.len() as f64;
    let half = t_quantile(f64::midpoint(1.0, level), n - 1.0) * sample_sd(values) / n.sqrt();
    let interval = Interval { low: mean(values) - half, high: mean(values) + half };
    finite_or(&[interval.low, interval.high], StatisticsError::OutOfRange)?;
    Ok(interval)
}
