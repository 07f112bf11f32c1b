use super::distributions::{Alternative, t_p};
use super::error::{StatisticsError, checked, differences, finite_or};
use crate::moments::{mean, sample_sd};

/// The result of a t-test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TTest {
    /// Student's t.
    pub t: f64,
    /// Degrees of freedom.
    pub df: f64,
    /// The p-value [0..1].
    pub p: f64,
    /// The mean difference, in the unit of the values.
    pub mean_difference: f64,
}

/// Paired t-test of `first` − `second`: t = d̄ / (s/√n) of the differences, with n − 1 degrees of freedom.
///
/// Student (1908), doi:10.2307/2331554; as `scipy.stats.ttest_rel`. One value for each participant and
/// condition. Limits: needs two pairs, differences that are nearly normal (see
/// [`shapiro_wilk`](super::shapiro_wilk)) and not all equal.
pub fn paired_t(
    first: &[f64],
    second: &[f64],
    alternative: Alternative,
) -> Result<TTest, StatisticsError> {
    one_sample_t(&differences(first, second, 2)?, alternative)
}

/// t-test of a mean against zero: t = x̄ / (s/√n) with n − 1 degrees of freedom.
///
/// Student (1908), doi:10.2307/2331554; as `scipy.stats.ttest_1samp(values, 0)`.
pub fn one_sample_t(values: &[f64], alternative: Alternative) -> Result<TTest, StatisticsError> {
    checked(&[values], 1, 2)?;
    let (n, mean_difference, sd) = (values.len() as f64, mean(values), sample_sd(values));
    if values.windows(2).all(|pair| pair[0].total_cmp(&pair[1]).is_eq()) {
        return Err(StatisticsError::NoSpread);
    }
    let (t, df) = (mean_difference / (sd / n.sqrt()), n - 1.0);
    let p = t_p(t, df, alternative);
    finite_or(&[t, p, mean_difference], StatisticsError::OutOfRange)?;
    Ok(TTest { t, df, p, mean_difference })
}
