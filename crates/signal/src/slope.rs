//! Regression lines.

use crate::estimate::Estimate;
use crate::robust::median_in_place;

/// The most points used; if there are more, an even selection is taken.
pub const MOST_POINTS: usize = 200;

/// A straight line: a slope with its uncertainty, through a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegressionLine {
    /// The change per unit of x.
    pub slope: Estimate,
    /// The value at x = 0.
    pub intercept: f64,
}

impl RegressionLine {
    /// The line's value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope.value * x
    }
}

/// Fits the Theil–Sen line: the median of the slopes between all pairs of points.
///
/// It tolerates up to 29 % outliers. The uncertainty is half the width of the 68 % interval from Kendall's rank
/// statistic, which assumes independent errors; the errors of a coarsely quantised gauge are not independent, see
/// [`trend`](crate::trend::trend). Sen (1968), doi:10.1080/01621459.1968.10480934. Points that are not finite are left
/// out; if there are more than [`MOST_POINTS`], an even selection is taken. `None` when fewer than two points differ in
/// x.
pub fn theil_sen(x: &[f64], y: &[f64]) -> Option<RegressionLine> {
    let points = evenly(&finite_points(x, y));
    let mut slopes = pair_slopes(&points);
    let (sigma, middle) = rank_sigma(&mut slopes, points.len())?;
    let value = median_in_place(middle)?;
    let slope = Estimate { value, sigma };
    let mut heights: Vec<f64> = points.iter().map(|(x, y)| y - value * x).collect();
    let intercept = median_in_place(&mut heights)?;
    intercept.is_finite().then_some(RegressionLine { slope, intercept })
}

/// Fits the least-squares line, which minimises the sum of squared vertical distances.
///
/// Uses all points, including those of long noisy series, which [`theil_sen`] would thin out; a single
/// outlier can change it. The uncertainty is the standard error of the slope, √(Σe² / (n − 2) / Σ(x −
/// x̄)²), which assumes independent errors (infinite with two points). Points that are not finite are left
/// out. `None` when fewer than two points differ in x, or when the magnitudes of the numbers are too
/// different.
///
/// ```
/// use teampulse_signal::slope::least_squares;
/// let line = least_squares(&[0.0, 1.0, 2.0], &[1.0, 3.0, 5.0]).expect("there are three points");
/// assert_eq!((line.slope.value, line.slope.sigma, line.at(3.0)), (2.0, 0.0, 7.0));
/// ```
pub fn least_squares(x: &[f64], y: &[f64]) -> Option<RegressionLine> {
    let points = finite_points(x, y);
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(|point| point.0), mean(|point| point.1));
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|(x, y)| of(x - mean_x, y - mean_y)).sum()
    };
    let spread = sum(&|x, _| x * x);
    let value = sum(&|x, y| x * y) / spread;
    let errors = sum(&|x, y| (y - value * x).powi(2));
    let sigma = (errors / (count - 2.0) / spread).sqrt();
    let sigma = if points.len() > 2 { sigma } else { f64::INFINITY };
    let intercept = mean_y - value * mean_x;
    let is_line = value.is_finite() && intercept.is_finite() && !sigma.is_nan();
    is_line.then_some(RegressionLine { slope: Estimate { value, sigma }, intercept })
}

fn finite_points(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let points = x.iter().copied().zip(y.iter().copied());
    points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

fn evenly(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    (0..MOST_POINTS).map(|k| points[k * (points.len() - 1) / (MOST_POINTS - 1)]).collect()
}

fn pair_slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let mut slopes = Vec::with_capacity(points.len() * points.len() / 2);
    for (k, (x, y)) in points.iter().enumerate() {
        let later = points[k + 1..].iter();
        slopes.extend(later.map(|(later_x, later_y)| (later_y - y) / (later_x - x)));
    }
    // Two points with the same x have no finite slope.
    slopes.retain(|slope| slope.is_finite());
    slopes
}

/// Half the distance between the slopes at ± one standard deviation of Kendall's statistic, and the slopes
/// ranked between these two. `None` without slopes.
fn rank_sigma(slopes: &mut [f64], n_points: usize) -> Option<(f64, &mut [f64])> {
    let n = n_points as f64;
    let half_width = (n * (n - 1.0) * (2.0 * n + 5.0) / 18.0).sqrt() / 2.0;
    let last = slopes.len().checked_sub(1)? as f64;
    let low_rank = (last / 2.0 - half_width).clamp(0.0, last).floor() as usize;
    let high_rank = slopes.len() - 1 - low_rank;
    let high = *slopes.select_nth_unstable_by(high_rank, f64::total_cmp).1;
    let slopes = &mut slopes[..=high_rank];
    let low = *slopes.select_nth_unstable_by(low_rank, f64::total_cmp).1;
    Some(((high - low) / 2.0, &mut slopes[low_rank..]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn seconds(count: u32) -> Vec<f64> {
        (0..count).map(f64::from).collect()
    }

    /// Uniform in −1..1 from a linear congruential generator (Numerical Recipes' constants).
    fn noise(count: usize, seed: u32) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1u32 << 23) - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn an_exact_line_is_found_with_certainty() {
        let x = seconds(50);
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.25 * x).collect();
        let line = theil_sen(&x, &y).unwrap();
        assert_eq!(
            line,
            RegressionLine { slope: Estimate { value: -0.25, sigma: 0.0 }, intercept: 3.0 }
        );
        assert_eq!(line.at(4.0), 2.0);
    }

    #[test]
    fn a_quarter_of_wild_points_does_not_turn_the_line() {
        let x = seconds(40);
        let wild = |k: usize, y: f64| if k.is_multiple_of(4) { 1e9 } else { y };
        let y: Vec<f64> = x.iter().enumerate().map(|(k, x)| wild(k, 2.0 * x)).collect();
        assert!((theil_sen(&x, &y).unwrap().slope.value - 2.0).abs() < 1e-9);
    }

    #[test]
    fn the_true_slope_lies_within_one_sigma_about_two_times_in_three() {
        let x = seconds(60);
        let within = (0..300).filter(|&seed| {
            let y: Vec<f64> = x.iter().zip(noise(60, seed)).map(|(x, e)| 0.1 * x + e).collect();
            let slope = theil_sen(&x, &y).unwrap().slope;
            (slope.value - 0.1).abs() < slope.sigma
        });
        let share = within.count() as f64 / 300.0;
        assert!((0.6..0.78).contains(&share), "{share}");
    }

    #[test]
    fn one_point_and_one_moment_have_no_slope() {
        assert_eq!(theil_sen(&[1.0], &[1.0]), None);
        assert_eq!(theil_sen(&[1.0, 1.0], &[1.0, 2.0]), None);
    }

    #[test]
    fn the_line_of_least_squares_has_the_slope_of_numpy() {
        // numpy.polyfit(range(5), [1, 3, 2, 5, 4], 1); scipy.stats.linregress for the standard error.
        let line = least_squares(&seconds(5), &[1.0, 3.0, 2.0, 5.0, 4.0]).unwrap();
        assert!((line.slope.value - 0.8).abs() < 1e-15 && (line.intercept - 1.4).abs() < 1e-15);
        assert!((line.slope.sigma - 0.346_410_161_513_775_4).abs() < 1e-15);
        assert_eq!(least_squares(&[1.0, 1.0], &[1.0, 2.0]), None);
        assert_eq!(least_squares(&[1.0, 2.0], &[1.0, 2.0]).unwrap().slope.sigma, f64::INFINITY);
    }

    #[test]
    fn many_points_give_the_slope_of_few() {
        let x = seconds(10_000);
        let y: Vec<f64> = x.iter().map(|x| x * 0.5).collect();
        assert_eq!(theil_sen(&x, &y).unwrap().slope.value, 0.5);
    }

    proptest! {
        #[test]
        fn no_numbers_give_nonsense(
            points in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 0..60),
        ) {
            let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            if let Some(line) = theil_sen(&x, &y) {
                prop_assert!(line.slope.value.is_finite() && line.intercept.is_finite());
                prop_assert!(line.slope.sigma >= 0.0);
            }
            if let Some(line) = least_squares(&x, &y) {
                prop_assert!(line.slope.value.is_finite() && line.intercept.is_finite());
                prop_assert!(line.slope.sigma >= 0.0);
            }
        }
    }
}
