use super::distributions::Alternative;
use super::error::StatisticsError;
use super::multiple::{Correction, corrected};
use super::t_test::{TTest, paired_t};
use super::wilcoxon::{SignedRank, Wilcoxon};

/// The comparison of a pair of conditions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair<T> {
    /// The index of the first condition.
    pub first: usize,
    /// The index of the second condition.
    pub second: usize,
    /// The test of first − second.
    pub test: T,
    /// The p-value of the test, corrected for the number of pairs [0..1].
    pub p_corrected: f64,
}

/// Performs Wilcoxon's test of each pair of conditions (columns, one row per participant), in the order of columns.
///
/// Equals `pingouin.pairwise_tests(parametric=False)` with the same correction.
pub fn pairwise_wilcoxon(
    conditions: &[&[f64]],
    test: &Wilcoxon,
    correction: Correction,
) -> Result<Vec<Pair<SignedRank>>, StatisticsError> {
    pairs(conditions, |first, second| test.paired(first, second), |test| test.p, correction)
}

/// Performs the two-sided paired t-test of each pair of conditions (columns, one row per participant).
///
/// Equals `pingouin.pairwise_tests` with the same correction.
pub fn pairwise_t(
    conditions: &[&[f64]],
    correction: Correction,
) -> Result<Vec<Pair<TTest>>, StatisticsError> {
    let test = |first: &[f64], second: &[f64]| paired_t(first, second, Alternative::TwoSided);
    pairs(conditions, test, |test| test.p, correction)
}

fn pairs<T: Copy>(
    conditions: &[&[f64]],
    test: impl Fn(&[f64], &[f64]) -> Result<T, StatisticsError>,
    p: impl Fn(&T) -> f64,
    correction: Correction,
) -> Result<Vec<Pair<T>>, StatisticsError> {
    let later = |first: usize| (first + 1..conditions.len()).map(move |second| (first, second));
    let each = (0..conditions.len()).flat_map(later);
    let tested = each.map(|(first, second)| {
        let test = test(conditions[first], conditions[second])?;
        Ok(Pair { first, second, test, p_corrected: f64::NAN })
    });
    let mut pairs = tested.collect::<Result<Vec<_>, StatisticsError>>()?;
    let p_values: Vec<f64> = pairs.iter().map(|pair| p(&pair.test)).collect();
    let corrected = corrected(&p_values, correction);
    pairs.iter_mut().zip(corrected).for_each(|(pair, p)| pair.p_corrected = p);
    Ok(pairs)
}
