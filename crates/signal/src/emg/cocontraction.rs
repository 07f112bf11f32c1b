//! Co-contraction of antagonists.

/// Co-contraction of two antagonists from their envelopes, each as a share of its maximal voluntary
/// contraction: (lower / higher) · (lower + higher) [0..2].
///
/// Rudolph et al. (2000, 2001), doi:10.1007/s001670000166: large where both are strongly and equally
/// active, small where one or both are weak. 0 when both are silent. A window's index is the mean over its
/// samples. `None` for shares that are negative or not finite.
///
/// ```
/// use teampulse_signal::emg::cocontraction;
/// assert_eq!(cocontraction(0.5, 0.5), Some(1.0));
/// assert_eq!(cocontraction(0.1, 0.5), Some(0.12));
/// assert_eq!(cocontraction(0.0, 0.5), Some(0.0));
/// ```
pub fn cocontraction(one: f64, other: f64) -> Option<f64> {
    let (lower, higher) = (one.min(other), one.max(other));
    if !(lower >= 0.0 && higher.is_finite()) || one.is_nan() || other.is_nan() {
        return None;
    }
    Some(if higher > 0.0 { lower / higher * (lower + higher) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_order_of_muscles_does_not_matter(one in prop::num::f64::ANY, other in prop::num::f64::ANY) {
            prop_assert_eq!(cocontraction(one, other), cocontraction(other, one));
        }

        #[test]
        fn it_lies_between_nothing_and_twice_the_lower(one in 0.0..2.0f64, other in 0.0..2.0f64) {
            let index = cocontraction(one, other).unwrap();
            prop_assert!((0.0..=2.0 * one.min(other) + 1e-12).contains(&index));
        }
    }
}
