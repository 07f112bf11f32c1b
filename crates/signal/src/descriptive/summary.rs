//! Summary statistics of a series.

use crate::gaps::is_usable;
use crate::robust::{mad, median};
use crate::slope::least_squares;

/// Summary statistics of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// The number of values.
    pub n: usize,
    /// The mean [unit].
    pub mean: f64,
    /// The standard deviation, over n − 1 [unit]; `None` for a single value.
    pub sd: Option<f64>,
    /// The median [unit].
    pub median: f64,
    /// Median absolute deviation from the median, not scaled [unit].
    pub mad: f64,
    /// The minimum [unit].
    pub least: f64,
    /// The maximum [unit].
    pub greatest: f64,
    /// Slope of the least-squares line [unit/s]; `None` when fewer than two values differ in time.
    pub slope_per_sec: Option<f64>,
}

/// Describes the [usable](is_usable) values of a series, with their times [s].
///
/// Equals numpy's mean, std(ddof=1), median, min, max and polyfit, and SciPy's `median_abs_deviation`. The
/// longer of the two series is cut to the shorter. `None` without a usable value.
pub fn describe(secs: &[f64], values: &[f64]) -> Option<Summary> {
    let points = secs.iter().zip(values).filter(|(_, value)| is_usable(**value));
    let (secs, values): (Vec<f64>, Vec<f64>) = points.unzip();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Some(Summary {
        n: values.len(),
        mean,
        sd: (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt()),
        median: median(&values)?,
        mad: mad(&values)?,
        least: values.iter().copied().min_by(f64::total_cmp)?,
        greatest: values.iter().copied().max_by(f64::total_cmp)?,
        slope_per_sec: least_squares(&secs, &values).map(|line| line.slope.value),
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_summary_is_that_of_numpy() {
        // x = [3, 1, 4, 1, 5, 9, 2, 6] at 0, 0.5, 1 … s: numpy.mean, std(ddof=1), median,
        // scipy.stats.median_abs_deviation, polyfit(t, x, 1).
        let values = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0];
        let secs: Vec<f64> = (0..8).map(|k| f64::from(k) / 2.0).collect();
        let summary = describe(&secs, &values).unwrap();
        assert_eq!((summary.mean, summary.median, summary.mad), (3.875, 3.5, 2.0));
        assert!((summary.sd.unwrap() - 2.748_376_143_938_713).abs() < 1e-14);
        assert!((summary.slope_per_sec.unwrap() - 1.071_428_571_428_571_4).abs() < 1e-14);
        assert_eq!((summary.least, summary.greatest), (1.0, 9.0));
    }

    #[test]
    fn one_value_has_neither_spread_nor_slope() {
        let summary = describe(&[1.0], &[7.0]).unwrap();
        assert_eq!((summary.n, summary.sd, summary.slope_per_sec), (1, None, None));
    }

    proptest! {
        #[test]
        fn no_numbers_give_nonsense(
            points in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 0..60),
        ) {
            let (secs, values): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            if let Some(summary) = describe(&secs, &values) {
                prop_assert!(summary.least <= summary.median && summary.median <= summary.greatest);
                prop_assert!(summary.mean.is_finite() && summary.mad >= 0.0);
                prop_assert!(summary.sd.is_none_or(f64::is_finite));
                prop_assert!(summary.slope_per_sec.is_none_or(f64::is_finite));
            }
        }
    }
}
