use std::ops::RangeInclusive;

/// Intervals that a heart has [ms]: from 200 beats a minute to 30.
pub const PLAUSIBLE_MS: RangeInclusive<f64> = 300.0..=2000.0;

/// The intervals [ms], with NaN in the place of each outside the range.
///
/// A missing interval keeps its place: differences across it are none.
///
/// ```
/// use teampulse_signal::intervals::{PLAUSIBLE_MS, gated_ms};
/// assert!(gated_ms(&[800.0, 150.0, 790.0], &PLAUSIBLE_MS)[1].is_nan());
/// ```
pub fn gated_ms(intervals_ms: &[f64], plausible_ms: &RangeInclusive<f64>) -> Vec<f64> {
    let gated = |&each: &f64| if plausible_ms.contains(&each) { each } else { f64::NAN };
    intervals_ms.iter().map(gated).collect()
}
