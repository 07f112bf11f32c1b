//! The trend of a gauge, which may be coarsely quantised.

use crate::slope::{RegressionLine, theil_sen};

/// A gauge is coarse if fewer than one in this many readings differs from the previous one.
const READINGS_PER_CHANGE: usize = 3;

/// Computes the trend of a gauge whose smallest step so far is `step` (0 for continuous readings).
///
/// Fine readings get a [Theil–Sen line](theil_sen). With coarse steps the median slope would be zero, so the line is
/// fitted to the moments at which the reading changes, where the true value lies midway; with fewer than two such
/// moments, it is drawn through both ends. The uncertainty is widened by [`quantisation_sigma`]. Expects ascending `x`.
/// `None` as for [`theil_sen`].
pub fn trend(x: &[f64], y: &[f64], step: f64) -> Option<RegressionLine> {
    let (x, y) = finite(x, y);
    let span = x.last()? - x.first()?;
    let (change_x, change_y) = changes(&x, &y);
    let line = match change_x.len() {
        count if count * READINGS_PER_CHANGE >= x.len() => theil_sen(&x, &y),
        0 | 1 => theil_sen(&ends(&x), &ends(&y)),
        _ => theil_sen(&change_x, &change_y),
    }?;
    Some(RegressionLine { slope: line.slope.widened(quantisation_sigma(step, span)), ..line })
}

/// The smallest non-zero step between successive finite values: a bound on the resolution. `None` while all
/// are equal.
pub fn smallest_step(values: &[f64]) -> Option<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|each| each.is_finite()).collect();
    let steps = finite.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.filter(|&step| step > 0.0 && step.is_finite()).min_by(f64::total_cmp)
}

/// The standard uncertainty of a slope over `span`, from values quantised by `step`.
///
/// Each end has a uniform error of ± half a step, and their difference a standard error of step · √(1/6).
pub fn quantisation_sigma(step: f64, span: f64) -> f64 {
    step / 6f64.sqrt() / span
}

fn finite(x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let points = x.iter().copied().zip(y.iter().copied());
    points.filter(|(x, y)| x.is_finite() && y.is_finite()).unzip()
}

/// The changes of the reading, each midway between two readings in both coordinates.
fn changes(x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let pairs = x.windows(2).zip(y.windows(2));
    let changed = pairs.filter(|(_, y)| y[0].total_cmp(&y[1]).is_ne());
    changed.map(|(x, y)| (x[0].midpoint(x[1]), y[0].midpoint(y[1]))).unzip()
}

fn ends(values: &[f64]) -> Vec<f64> {
    values.first().into_iter().chain(values.last()).copied().collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn seconds(count: u32) -> Vec<f64> {
        (0..count).map(f64::from).collect()
    }

    #[test]
    fn the_smallest_step_is_the_resolution() {
        assert_eq!(smallest_step(&[0.5, 0.5, 0.25, f64::NAN, 0.375]), Some(0.125));
        assert_eq!(smallest_step(&[0.5, 0.5]), None);
    }

    #[test]
    fn a_gauge_in_steps_is_off_by_less_than_two_and_a_half_sigma() {
        let x = seconds(60);
        for hundredths in 0..400 {
            let slope = f64::from(hundredths) / 6000.0;
            let y: Vec<f64> = x.iter().map(|x| (slope * x).floor()).collect();
            let found = trend(&x, &y, 1.0).unwrap().slope;
            assert!((found.value - slope).abs() < 2.5 * found.sigma, "{slope} {found:?}");
        }
    }

    #[test]
    fn three_steps_give_the_slope_closely() {
        let x = seconds(60);
        let y: Vec<f64> = x.iter().map(|x| (-0.06 * x).round()).collect();
        assert!((trend(&x, &y, 1.0).unwrap().slope.value + 0.06).abs() < 0.005);
    }

    #[test]
    fn a_fine_gauge_has_its_theil_sen_line() {
        let x = seconds(30);
        let y: Vec<f64> = x.iter().map(|x| 5.0 - 0.125 * x).collect();
        assert_eq!(trend(&x, &y, 0.0), theil_sen(&x, &y));
    }

    #[test]
    fn a_reading_that_never_changes_is_level_within_its_resolution() {
        let line = trend(&seconds(30), &[0.5; 30], 0.01).unwrap();
        assert_eq!((line.slope.value, line.intercept), (0.0, 0.5));
        assert_eq!(line.slope.sigma, quantisation_sigma(0.01, 29.0));
    }

    proptest! {
        #[test]
        fn no_numbers_give_nonsense(
            mut points in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 0..60),
            step in prop::num::f64::ANY,
        ) {
            points.sort_by(|one, other| one.0.total_cmp(&other.0));
            let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            if let Some(line) = trend(&x, &y, step) {
                prop_assert!(line.slope.value.is_finite() && line.intercept.is_finite());
            }
        }
    }
}
