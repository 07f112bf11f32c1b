use super::error::{StatisticsError, checked, differences, finite_or};
use crate::moments::{mean, sample_sd};

/// Cohen's `d_z` of paired values: mean of `first` − `second` over the standard deviation of the differences,
/// without unit.
///
/// Lakens (2013), doi:10.3389/fpsyg.2013.00863. Limits: it grows with the correlation of the conditions;
/// report `d_av` as well ([`cohen_d_average`]).
pub fn cohen_dz(first: &[f64], second: &[f64]) -> Result<f64, StatisticsError> {
    let differences = differences(first, second, 2)?;
    ratio(mean(&differences), sample_sd(&differences))
}

/// Hedges' `g_z`: [`cohen_dz`] times [`hedges_correction`] of n − 1, without unit.
///
/// Hedges (1981), doi:10.3102/10769986006002107.
pub fn hedges_gz(first: &[f64], second: &[f64]) -> Result<f64, StatisticsError> {
    Ok(cohen_dz(first, second)? * hedges_correction(first.len() as f64 - 1.0))
}

/// Cohen's `d_av`: mean of `first` − `second` over the root of their mean variance, without unit.
///
/// Cumming (2012), doi:10.4324/9780203807002; as `pingouin.compute_effsize(paired=True)`. Lakens
/// (2013), doi:10.3389/fpsyg.2013.00863, divides by the mean of both standard deviations, which is a
/// little less.
pub fn cohen_d_average(first: &[f64], second: &[f64]) -> Result<f64, StatisticsError> {
    checked(&[first, second], 2, 2)?;
    let variance = f64::midpoint(sample_sd(first).powi(2), sample_sd(second).powi(2));
    ratio(mean(first) - mean(second), variance.sqrt())
}

/// Hedges' correction of the bias of d in small groups, J = 1 − 3/(4·df − 1).
///
/// The usual approximation of Hedges (1981), doi:10.3102/10769986006002107.
pub fn hedges_correction(df: f64) -> f64 {
    1.0 - 3.0 / (4.0 * df - 1.0)
}

fn ratio(difference: f64, spread: f64) -> Result<f64, StatisticsError> {
    finite_or(&[difference, spread], StatisticsError::OutOfRange)?;
    let ratio = difference / spread;
    finite_or(&[ratio], StatisticsError::NoSpread)?;
    Ok(ratio)
}
