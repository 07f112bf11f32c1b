use super::distributions::normal_quantile;
use super::effect_size::hedges_correction;
use super::error::{StatisticsError, checked, checked_level, finite_or};
use super::mean_interval::Interval;
use crate::moments::{mean, sample_sd, sample_variance, squares_about_mean};
use crate::robust::{SIGMA_FROM_MAD, mad, median};

/// The change of a phase from the baseline for one participant: differences of statistics, not statistics of
/// differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaselineChange {
    /// Mean of the phase minus that of the baseline, in the unit of the values.
    pub mean_difference: f64,
    /// Standard deviation (n − 1) of the phase minus that of the baseline, in the same unit.
    pub sd_difference: f64,
    /// Median of the phase minus that of the baseline, in the same unit.
    pub median_difference: f64,
    /// The difference of means relative to the baseline's mean [%]; `None` if that mean is zero.
    pub percent_change: Option<f64>,
    /// The difference of means in standard deviations of the baseline; `None` if that deviation is zero.
    pub z: Option<f64>,
    /// The difference of medians in 1.4826 median absolute deviations of the baseline; `None` if that deviation is
    /// zero.
    pub robust_z: Option<f64>,
}

/// Computes how the values of a phase differ from those of the baseline, at least two each.
///
/// For one participant and one quantity: a description, not a test. Values are those of windows, or samples
/// of a slow signal. Limits: a percentage is meaningless for quantities without a meaningful zero; the mean
/// of a raw ECG or pulse wave says nothing about the heart, so use rates and amplitudes.
///
/// ```
/// use teampulse_signal::statistics::baseline_change;
/// let change = baseline_change(&[74.0, 78.0, 79.0], &[66.0, 70.0, 74.0])?;
/// assert_eq!((change.mean_difference, change.z), (7.0, Some(1.75)));
/// assert_eq!(change.percent_change, Some(10.0));
/// # Ok::<(), teampulse_signal::statistics::StatisticsError>(())
/// ```
pub fn baseline_change(phase: &[f64], baseline: &[f64]) -> Result<BaselineChange, StatisticsError> {
    checked(&[phase], 1, 2)?;
    checked(&[baseline], 1, 2)?;
    let medians = median(phase).zip(median(baseline));
    let (of_phase, of_baseline) = medians.unwrap_or((f64::NAN, f64::NAN));
    let [mean_difference, sd_difference, median_difference] = [
        mean(phase) - mean(baseline),
        sample_sd(phase) - sample_sd(baseline),
        of_phase - of_baseline,
    ];
    finite_or(&[mean_difference, sd_difference, median_difference], StatisticsError::OutOfRange)?;
    let over = |difference: f64, by: f64| Some(difference / by).filter(|ratio| ratio.is_finite());
    let deviation = SIGMA_FROM_MAD * mad(baseline).unwrap_or(f64::NAN);
    Ok(BaselineChange {
        mean_difference,
        sd_difference,
        median_difference,
        percent_change: over(100.0 * mean_difference, mean(baseline).abs()),
        z: over(mean_difference, sample_sd(baseline)),
        robust_z: over(median_difference, deviation),
    })
}

/// A standardised difference between a phase and the baseline, with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardisedDifference {
    /// The difference of means over the pooled standard deviation (Cohen's d).
    pub d: f64,
    /// The difference, corrected for bias in small samples (Hedges' g).
    pub g: f64,
    /// The effective number of independent values of the phase.
    pub effective_phase: f64,
    /// The effective number of independent values of the baseline.
    pub effective_baseline: f64,
    /// The standard error of g.
    pub standard_error: f64,
    /// The confidence interval of g.
    pub interval: Interval,
}

/// Computes the standardised difference between the windows of a phase and those of the baseline, at least three each.
///
/// Windows follow each other without overlap (30 s), in order of time. Neighbours are correlated, so each
/// series counts as [`effective_count`] values. d = (x̄₁ − x̄₂)/s with the pooled s, as in
/// `pingouin.compute_effsize`; g = J·d with J for the effective degrees of freedom, its variance 1/n₁ +
/// 1/n₂ + g²/2(n₁ + n₂) and a normal interval with confidence `level` (0.95): Hedges & Olkin (1985).
/// Limits: one participant; it does not generalise to others.
pub fn standardised_difference(
    phase: &[f64],
    baseline: &[f64],
    level: f64,
) -> Result<StandardisedDifference, StatisticsError> {
    let level = checked_level(level)?;
    let (first, second) = (effective_count(phase)?, effective_count(baseline)?);
    let (n, m) = (phase.len() as f64 - 1.0, baseline.len() as f64 - 1.0);
    let variance = (n * sample_variance(phase) + m * sample_variance(baseline)) / (n + m);
    let difference = mean(phase) - mean(baseline);
    finite_or(&[difference, variance], StatisticsError::OutOfRange)?;
    let d = difference / variance.sqrt();
    finite_or(&[d], StatisticsError::NoSpread)?;
    let g = d * hedges_correction(first + second - 2.0);
    let standard_error = (1.0 / first + 1.0 / second + g * g / (2.0 * (first + second))).sqrt();
    let half = normal_quantile(f64::midpoint(1.0, level)) * standard_error;
    finite_or(&[g, half], StatisticsError::OutOfRange)?;
    Ok(StandardisedDifference {
        d,
        g,
        effective_phase: first,
        effective_baseline: second,
        standard_error,
        interval: Interval { low: g - half, high: g + half },
    })
}

/// Computes the effective number of independent values of a series in order of time, n·(1 − r)/(1 + r).
///
/// r is the autocorrelation at lag 1, as `statsmodels.tsa.stattools.acf`; where it is negative, the result is
/// n. At least 2. Bayley & Hammersley (1946), doi:10.2307/2983560, for a first-order autoregressive series.
/// Needs at least three values.
pub fn effective_count(series: &[f64]) -> Result<f64, StatisticsError> {
    checked(&[series], 1, 3)?;
    let (n, centre) = (series.len() as f64, mean(series));
    let products = series.windows(2).map(|pair| (pair[0] - centre) * (pair[1] - centre));
    let correlation = products.sum::<f64>() / squares_about_mean(series);
    finite_or(&[correlation], StatisticsError::NoSpread)?;
    let correlation = correlation.clamp(0.0, 1.0);
    Ok((n * (1.0 - correlation) / (1.0 + correlation)).max(2.0))
}
