use super::distributions::{Alternative, normal_quantile, t_p};
use super::error::{StatisticsError, checked, checked_level, finite_or};
use super::mean_interval::Interval;
use super::ranks::average_ranks;
use crate::moments::mean;

/// A correlation with its p-value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// The coefficient [−1..1].
    pub r: f64,
    /// The two-sided p-value [0..1].
    pub p: f64,
    /// The number of pairs.
    pub n: usize,
}

impl Correlation {
    /// The confidence interval by Fisher's transform, tanh(artanh r ± z/√(n − 3)).
    ///
    /// Fisher (1921), Metron 1, 3–32; as SciPy's for Pearson's r. From −1 to 1 with fewer than four pairs. Limits: only
    /// approximate for ranks.
    pub fn interval(&self, level: f64) -> Result<Interval, StatisticsError> {
        let z = normal_quantile(f64::midpoint(1.0, checked_level(level)?));
        if self.n < 4 {
            return Ok(Interval { low: -1.0, high: 1.0 });
        }
        let half = z / (self.n as f64 - 3.0).sqrt();
        let centre = self.r.atanh();
        Ok(Interval { low: (centre - half).tanh(), high: (centre + half).tanh() })
    }
}

/// Pearson's correlation of paired values, with its p from t = r·√((n − 2)/(1 − r²)).
///
/// Pearson (1895), doi:10.1098/rspl.1895.0041; as `scipy.stats.pearsonr`. Limits: needs at least three
/// pairs, a linear relation and nearly normal values.
pub fn pearson(first: &[f64], second: &[f64]) -> Result<Correlation, StatisticsError> {
    checked(&[first, second], 2, 3)?;
    let (about_first, about_second) = (unit(first)?, unit(second)?);
    let products = about_first.iter().zip(&about_second).map(|(a, b)| a * b);
    let (r, df) = (products.sum::<f64>().clamp(-1.0, 1.0), first.len() as f64 - 2.0);
    let t = r * (df / ((1.0 - r) * (1.0 + r))).sqrt();
    let p = if t.is_finite() { t_p(t, df, Alternative::TwoSided) } else { 0.0 };
    Ok(Correlation { r, p, n: first.len() })
}

/// Spearman's correlation of ranks: [`pearson`] of the average ranks, with p computed in the same way.
///
/// Spearman (1904), doi:10.2307/1412159; as `scipy.stats.spearmanr`. Limits: below about ten pairs, p is
/// approximate.
pub fn spearman(first: &[f64], second: &[f64]) -> Result<Correlation, StatisticsError> {
    checked(&[first, second], 2, 3)?;
    pearson(&average_ranks(first), &average_ranks(second))
}

/// The deviations from the mean, normalised to length one.
fn unit(values: &[f64]) -> Result<Vec<f64>, StatisticsError> {
    let mean = mean(values);
    let about: Vec<f64> = values.iter().map(|each| each - mean).collect();
    let largest = about.iter().fold(0.0, |most: f64, each| most.max(each.abs()));
    finite_or(&[mean, largest], StatisticsError::OutOfRange)?;
    // The values are scaled first, because squares of tiny or huge numbers vanish or overflow.
    let length = largest * about.iter().map(|each| (each / largest).powi(2)).sum::<f64>().sqrt();
    // The rounding error of equal values is not a spread.
    if largest <= mean.abs() * 1e-13 || length == 0.0 {
        return Err(StatisticsError::NoSpread);
    }
    Ok(about.iter().map(|each| each / length).collect())
}
