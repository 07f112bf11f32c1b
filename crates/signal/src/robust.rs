//! Robust statistics.

use crate::estimate::Estimate;

/// The ratio of standard deviation to median absolute deviation of a normal distribution, 1/Φ⁻¹(3/4).
pub const SIGMA_FROM_MAD: f64 = 1.482_602_218_505_602;

/// The standard error of a median relative to that of a mean, for normal values: √(π/2).
const MEDIAN_OVER_MEAN: f64 = 1.253_314_137_315_500_3;

/// Median of the finite values, the mean of the middle two for an even count.
///
/// `None` without a finite value.
///
/// ```
/// use teampulse_signal::robust::median;
/// assert_eq!(median(&[3.0, f64::NAN, 1.0, 2.0]), Some(2.0));
/// assert_eq!(median(&[]), None);
/// ```
pub fn median(values: &[f64]) -> Option<f64> {
    let mut finite = finite(values);
    median_in_place(&mut finite)
}

/// Median absolute deviation from the median, of the finite values.
///
/// Unscaled: multiplied by [`SIGMA_FROM_MAD`], it estimates the standard deviation of normal values.
/// Hampel (1974), doi:10.1080/01621459.1974.10482962. `None` without a finite value.
pub fn mad(values: &[f64]) -> Option<f64> {
    let centre = median(values)?;
    let mut deviations: Vec<f64> =
        finite(values).iter().map(|each| (each - centre).abs()).collect();
    median_in_place(&mut deviations)
}

/// Median of the finite values with its standard uncertainty, √(π/2) · 1.4826 · MAD / √n.
///
/// Holds for independent, nearly normal values. `None` without a finite value.
pub fn median_estimate(values: &[f64]) -> Option<Estimate> {
    let value = median(values)?;
    let count = values.iter().filter(|each| each.is_finite()).count();
    let sigma = MEDIAN_OVER_MEAN * SIGMA_FROM_MAD * mad(values)? / (count as f64).sqrt();
    Some(Estimate { value, sigma })
}

/// The median of values without NaN; reorders them.
pub(crate) fn median_in_place(values: &mut [f64]) -> Option<f64> {
    let upper_rank = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let odd = values.len() % 2 == 1;
    let (below, upper, _) = values.select_nth_unstable_by(upper_rank, f64::total_cmp);
    let upper = *upper;
    if odd {
        return Some(upper);
    }
    let lower = below.iter().copied().max_by(f64::total_cmp)?;
    Some(lower.midpoint(upper))
}

/// The [quantile](quantile_of_sorted) of values without NaN; reorders them. `None` without values.
pub(crate) fn quantile_in_place(values: &mut [f64], share: f64) -> Option<f64> {
    let place = share.clamp(0.0, 1.0) * values.len().checked_sub(1)? as f64;
    let (_, low, above) = values.select_nth_unstable_by(place.floor() as usize, f64::total_cmp);
    let low = *low;
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    Some(low + (high - low) * (place - place.floor()))
}

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|each| each.is_finite()).collect()
}

/// The quantile of sorted values, interpolated linearly, as `numpy.quantile`; NaN without values. The share
/// is between 0 and 1.
pub fn quantile_of_sorted(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}

/// Linear interpolation between points sorted by their first number.
pub(crate) fn interpolated(points: &[(f64, f64)], at: f64) -> f64 {
    let line = points.windows(2).find(|pair| at <= pair[1].0);
    let Some(&[(left, low), (right, high)]) = line.and_then(|pair| pair.first_chunk::<2>()) else {
        return points.last().map_or(0.0, |last| last.1);
    };
    low + (high - low) * ((at - left) / (right - left)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_even_count_has_the_mean_of_the_middle_two() {
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
    }

    #[test]
    fn one_wild_value_in_five_moves_neither_median_nor_mad_far() {
        assert_eq!(median(&[1.0, 2.0, 3.0, 4.0, 1e300]), Some(3.0));
        assert_eq!(mad(&[1.0, 2.0, 3.0, 4.0, 1e300]), Some(1.0));
    }

    #[test]
    fn equal_values_are_certain() {
        assert_eq!(median_estimate(&[7.0; 9]), Some(Estimate { value: 7.0, sigma: 0.0 }));
    }

    #[test]
    fn four_times_the_values_halve_the_uncertainty() {
        let few: Vec<f64> = (0..100).map(f64::from).collect();
        let many: Vec<f64> = few.iter().flat_map(|&each| [each; 4]).collect();
        let ratio = median_estimate(&few).unwrap().sigma / median_estimate(&many).unwrap().sigma;
        assert!((ratio - 2.0).abs() < 0.01, "{ratio}");
    }

    proptest! {
        #[test]
        fn a_median_lies_between_the_least_and_the_greatest(
            values in prop::collection::vec(-1e300..1e300, 1..50),
        ) {
            let median = median(&values).unwrap();
            prop_assert!(values.iter().any(|&each| each <= median));
            prop_assert!(values.iter().any(|&each| each >= median));
        }

        #[test]
        fn the_order_of_values_does_not_matter(
            values in prop::collection::vec(prop::num::f64::ANY, 0..50),
        ) {
            let reversed: Vec<f64> = values.iter().rev().copied().collect();
            prop_assert_eq!(median(&values), median(&reversed));
        }

        #[test]
        fn a_quantile_needs_no_order(
            mut values in prop::collection::vec(-1e6..1e6, 1..50),
            share in 0.0..=1.0,
        ) {
            let unordered = quantile_in_place(&mut values, share);
            values.sort_by(f64::total_cmp);
            prop_assert_eq!(unordered, Some(quantile_of_sorted(&values, share)));
        }
    }
}
