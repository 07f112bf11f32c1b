use super::distributions::{chi2_upper, f_upper};
use super::error::{StatisticsError, checked, finite_or};
use super::friedman::rows;
use crate::moments::mean;

/// The result of a one-way repeated-measures ANOVA.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepeatedMeasures {
    /// The F statistic.
    pub f: f64,
    /// Degrees of freedom of the conditions.
    pub df_conditions: f64,
    /// Degrees of freedom of the error.
    pub df_error: f64,
    /// The p-value, assuming sphericity [0..1].
    pub p: f64,
    /// Greenhouse–Geisser ε: 1 with perfect sphericity, at least 1/(k − 1).
    pub greenhouse_geisser: f64,
    /// The p-value with both degrees of freedom multiplied by ε [0..1].
    pub p_greenhouse_geisser: f64,
    /// The share of the conditions in the variance within participants [0..1].
    pub partial_eta_squared: f64,
    /// The share of the conditions in the total variance [0..1]. Bakeman (2005), doi:10.3758/BF03192707.
    pub generalised_eta_squared: f64,
    /// Mauchly's test of sphericity; `None` for two conditions, and with fewer participants than
    /// conditions.
    pub sphericity: Option<Mauchly>,
}

/// The result of Mauchly's test of sphericity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mauchly {
    /// The W statistic: 1 with perfect sphericity.
    pub w: f64,
    /// The p-value [0..1].
    pub p: f64,
}

/// Analyses the variance of two or more conditions (columns, one row per participant).
///
/// F = (C/(k − 1)) / (E/((k − 1)(n − 1))), with C the sum of squares of the conditions and E the residual
/// sum of squares. Corrections: Greenhouse & Geisser (1959), doi:10.1007/BF02289823; sphericity: Mauchly
/// (1940), doi:10.1214/aoms/1177731915. As `pingouin.rm_anova`. Limits: nearly normal errors; use the
/// corrected p if Mauchly's is small, or preferably always.
pub fn repeated_measures(conditions: &[&[f64]]) -> Result<RepeatedMeasures, StatisticsError> {
    checked(conditions, 2, 2)?;
    let rows = rows(conditions);
    let (n, k) = (rows.len() as f64, conditions.len() as f64);
    let participants: Vec<f64> = rows.iter().map(|row| mean(row)).collect();
    let condition_means: Vec<f64> = conditions.iter().map(|column| mean(column)).collect();
    let grand = mean(&participants);
    let squares = |means: &[f64]| means.iter().map(|each| (each - grand).powi(2)).sum::<f64>();
    let (between, within) = (k * squares(&participants), n * squares(&condition_means));
    let residual = |row: usize, column: usize| {
        rows[row][column] - participants[row] - condition_means[column] + grand
    };
    let each_row = |row| (0..conditions.len()).map(move |column| (row, column));
    let cells = (0..rows.len()).flat_map(each_row);
    let error: f64 = cells.map(|(row, column)| residual(row, column).powi(2)).sum();
    finite_or(&[between, within, error], StatisticsError::OutOfRange)?;
    let (df_conditions, df_error) = (k - 1.0, (k - 1.0) * (n - 1.0));
    let f = (within / df_conditions) / (error / df_error);
    let covariance = contrast_covariance(&rows);
    let epsilon = greenhouse_geisser(&covariance);
    finite_or(&[f, epsilon], StatisticsError::NoSpread)?;
    Ok(RepeatedMeasures {
        f,
        df_conditions,
        df_error,
        p: f_upper(f, df_conditions, df_error),
        greenhouse_geisser: epsilon,
        p_greenhouse_geisser: f_upper(f, df_conditions * epsilon, df_error * epsilon),
        partial_eta_squared: within / (within + error),
        generalised_eta_squared: within / (within + between + error),
        sphericity: mauchly(covariance, n - 1.0),
    })
}

/// Covariance of the k − 1 Helmert contrasts of the conditions, each of unit length.
fn contrast_covariance(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let contrasts = rows.iter().map(|row| {
        let mut sum = 0.0;
        row.iter().enumerate().filter_map(move |(k, value)| {
            let (before, earlier) = (k as f64, sum);
            sum += value;
            (k > 0).then(|| (earlier - before * value) / (before * (before + 1.0)).sqrt())
        })
    });
    let contrasts: Vec<Vec<f64>> = contrasts.map(Iterator::collect).collect();
    let n = contrasts.len() as f64;
    let count = contrasts.first().map_or(0, Vec::len);
    let means: Vec<f64> =
        (0..count).map(|c| contrasts.iter().map(|row| row[c]).sum::<f64>() / n).collect();
    let covariance = |a: usize, b: usize| {
        let product = |row: &Vec<f64>| (row[a] - means[a]) * (row[b] - means[b]);
        contrasts.iter().map(product).sum::<f64>() / (n - 1.0)
    };
    (0..count).map(|a| (0..count).map(|b| covariance(a, b)).collect()).collect()
}

/// ε = tr(M)² / ((k − 1) tr(M²)).
fn greenhouse_geisser(covariance: &[Vec<f64>]) -> f64 {
    let squares: f64 = covariance.iter().flatten().map(|each| each * each).sum();
    (trace(covariance).powi(2) / (covariance.len() as f64 * squares)).min(1.0)
}

fn trace(matrix: &[Vec<f64>]) -> f64 {
    matrix.iter().enumerate().map(|(k, row)| row[k]).sum()
}

/// Mauchly's test with the second-order term of Anderson (2003) as in R and pingouin.
fn mauchly(covariance: Vec<Vec<f64>>, df: f64) -> Option<Mauchly> {
    let d = covariance.len() as f64;
    if d < 2.0 || df < d {
        return None;
    }
    let mean_variance = trace(&covariance) / d;
    let log_w = log_determinant(covariance)? - d * mean_variance.ln();
    let df_chi2 = d * (d + 1.0) / 2.0 - 1.0;
    let scale = 1.0 - (2.0 * d * d + d + 2.0) / (6.0 * d * df);
    let cubic = 2.0 * d.powi(3) + 6.0 * d * d + 3.0 * (d + 1.0) + 2.0;
    let second = (d + 2.0) * (d - 1.0) * (d - 2.0) * cubic / (288.0 * (df * d * scale).powi(2));
    let chi2 = -df * scale * log_w;
    let first = chi2_upper(chi2, df_chi2);
    let p = first + second * (chi2_upper(chi2, df_chi2 + 4.0) - first);
    Some(Mauchly { w: log_w.exp(), p: p.clamp(0.0, 1.0) })
}

/// Logarithm of the determinant of a positive definite matrix, by elimination; `None` for others.
fn log_determinant(mut matrix: Vec<Vec<f64>>) -> Option<f64> {
    let mut log = 0.0;
    for pivot in 0..matrix.len() {
        let (above, below) = matrix.split_at_mut(pivot + 1);
        let row = &above[pivot];
        let size = row[pivot];
        if size <= 0.0 || !size.is_finite() {
            return None;
        }
        log += size.ln();
        for lower in below {
            let factor = lower[pivot] / size;
            lower.iter_mut().zip(row).for_each(|(each, of_pivot)| *each -= factor * of_pivot);
        }
    }
    Some(log)
}
