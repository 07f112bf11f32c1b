use super::distributions::chi2_upper;
use super::error::{StatisticsError, checked};
use super::ranks::{average_ranks, tie_sum};

/// The result of Friedman's test.
#[derive(Clone, Debug, PartialEq)]
pub struct Friedman {
    /// The statistic, asymptotically χ² distributed under the null hypothesis.
    pub chi2: f64,
    /// Degrees of freedom: the number of conditions minus one.
    pub df: f64,
    /// The p-value [0..1].
    pub p: f64,
    /// Kendall's W, the agreement of participants on the order of conditions [0..1].
    pub kendall_w: f64,
    /// The mean rank of each condition.
    pub mean_ranks: Vec<f64>,
}

/// Friedman's test of three or more conditions (columns, one row per participant), corrected for ties.
///
/// χ² = (12 Σ R²/(n k (k + 1)) − 3 n (k + 1)) / (1 − Σ(t³ − t)/(n k (k² − 1))), W = χ²/(n (k − 1)).
/// Friedman (1937), doi:10.1080/01621459.1937.10503522; as `scipy.stats.friedmanchisquare`. Limits: the
/// χ² approximation needs more than ten participants or more than six conditions.
pub fn friedman(conditions: &[&[f64]]) -> Result<Friedman, StatisticsError> {
    checked(conditions, 3, 2)?;
    let rows = rows(conditions);
    let (n, k) = (rows.len() as f64, conditions.len() as f64);
    let sums = rank_sums(&rows);
    let ties: f64 = rows.iter().map(|row| tie_sum(row)).sum();
    let untied = 1.0 - ties / (n * k * (k * k - 1.0));
    if untied <= 0.0 {
        return Err(StatisticsError::NoSpread);
    }
    let squares: f64 = sums.iter().map(|sum| sum * sum).sum();
    let chi2 = (12.0 * squares / (n * k * (k + 1.0)) - 3.0 * n * (k + 1.0)) / untied;
    let df = k - 1.0;
    Ok(Friedman {
        chi2,
        df,
        p: chi2_upper(chi2, df),
        kendall_w: chi2 / (n * df),
        mean_ranks: sums.iter().map(|sum| sum / n).collect(),
    })
}

/// Transposes columns to one row per participant.
pub(super) fn rows(columns: &[&[f64]]) -> Vec<Vec<f64>> {
    let count = columns.first().map_or(0, |column| column.len());
    (0..count).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}

/// The sum of each condition's ranks over the participants.
pub(super) fn rank_sums(rows: &[Vec<f64>]) -> Vec<f64> {
    let mut sums = vec![0.0; rows.first().map_or(0, Vec::len)];
    for row in rows {
        sums.iter_mut().zip(average_ranks(row)).for_each(|(sum, rank)| *sum += rank);
    }
    sums
}
