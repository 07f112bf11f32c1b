use std::ops::RangeInclusive;

/// The plausible intervals of a heart [ms]: 200 to 30 beats a minute.
pub const PLAUSIBLE_MS: RangeInclusive<f64> = 300.0..=2000.0;

/// Replaces intervals [ms] outside the range by NaN.
///
/// A missing interval keeps its place, so that no difference is taken across it.
///
/// ```
/// use teampulse_signal::intervals::{PLAUSIBLE_MS, gated_ms};
/// assert!(gated_ms(&[800.0, 150.0, 790.0], &PLAUSIBLE_MS)[1].is_nan());
/// ```
pub fn gated_ms(intervals_ms: &[f64], plausible_ms: &RangeInclusive<f64>) -> Vec<f64> {
    let gated = |&each: &f64| if plausible_ms.contains(&each) { each } else { f64::NAN };
    intervals_ms.iter().map(gated).collect()
}
