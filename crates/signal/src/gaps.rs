//! Missing values of a signal.

use crate::error::SignalError;

/// Values beyond this are treated as missing, like non-finite ones, so that squares and sums cannot overflow.
pub const LARGEST: f64 = 1e100;

/// Whether a value is a number that can be computed with: finite, and at most [`LARGEST`].
pub fn is_usable(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// Interpolates the gaps of a signal linearly; before the first and after the last usable value, that value is
/// repeated.
///
/// Returns an error when no value is [usable](is_usable).
///
/// ```
/// use teampulse_signal::gaps::bridged;
/// let gap = f64::NAN;
/// assert_eq!(bridged(&[gap, 1.0, gap, gap, 4.0])?, [1.0, 1.0, 2.0, 3.0, 4.0]);
/// # Ok::<(), teampulse_signal::error::SignalError>(())
/// ```
pub fn bridged(signal: &[f64]) -> Result<Vec<f64>, SignalError> {
    let mut bridged = signal.to_vec();
    bridge(&mut bridged).map(|()| bridged)
}

/// [`bridged`] in place.
pub fn bridge(signal: &mut [f64]) -> Result<(), SignalError> {
    let first = signal.iter().position(|&value| is_usable(value));
    let first = first.ok_or(SignalError::NothingFinite)?;
    let value = signal[first];
    signal[..first].fill(value);
    let mut last = first;
    for index in first..signal.len() {
        if is_usable(signal[index]) {
            draw_line(&mut signal[last..=index]);
            last = index;
        }
    }
    let value = signal[last];
    signal[last..].fill(value);
    Ok(())
}

/// Interpolates between the first and the last value.
fn draw_line(signal: &mut [f64]) {
    let [begin, between @ .., end] = signal else { return };
    let steps = (between.len() + 1) as f64;
    for (index, value) in between.iter_mut().enumerate() {
        *value = *begin + (*end - *begin) * ((index + 1) as f64 / steps);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn nothing_cannot_be_bridged() {
        assert_eq!(bridged(&[]), Err(SignalError::NothingFinite));
        assert_eq!(bridged(&[f64::NAN, f64::INFINITY]), Err(SignalError::NothingFinite));
    }

    proptest! {
        #[test]
        fn usable_values_stay_and_all_become_usable(
            signal in prop::collection::vec(prop::num::f64::ANY, 0..50),
        ) {
            if let Ok(bridged) = bridged(&signal) {
                for (new, old) in bridged.iter().zip(&signal) {
                    prop_assert!(is_usable(*new) && (new == old || !is_usable(*old)));
                }
            }
        }
    }
}
