//! Zero-phase filtering of a whole recording.

use super::{Cascade, Design};
use crate::error::SignalError;
use crate::gaps::bridge;

/// Filters a signal forwards and then backwards: without delay, and with the gain squared.
///
/// SciPy's `sosfiltfilt` with its defaults: the signal is extended at both ends by its odd reflection, of
/// three times the filter's length, and both passes start settled. See Gustafsson (1996),
/// doi:10.1109/78.492552. Values that are not usable are [bridged](crate::gaps::bridged) first. Returns an
/// error when none is usable, or the signal is not longer than the padding. Not causal.
pub fn zero_phase(design: &Design, signal: &[f64]) -> Result<Vec<f64>, SignalError> {
    let mut filtered = signal.to_vec();
    apply_zero_phase(design, &mut filtered).map(|()| filtered)
}

/// [`zero_phase`] in place; after an error the signal is unchanged, or bridged.
pub(crate) fn apply_zero_phase(design: &Design, signal: &mut [f64]) -> Result<(), SignalError> {
    let padding = padding(design);
    if signal.len() <= padding {
        return Err(SignalError::TooShort { count: signal.len(), least: padding + 1 });
    }
    bridge(signal)?;
    let last = signal.len() - 1;
    let mut before: Vec<f64> =
        (1..=padding).rev().map(|back| 2.0 * signal[0] - signal[back]).collect();
    let mut after: Vec<f64> =
        (1..=padding).map(|back| 2.0 * signal[last] - signal[last - back]).collect();
    let mut forwards = Cascade::settled(design);
    forwards.filter(&mut before);
    forwards.filter(signal);
    forwards.filter(&mut after);
    let mut backwards = Cascade::settled(design);
    backwards.filter_backwards(&mut after);
    backwards.filter_backwards(signal);
    Ok(())
}

/// The number of samples added at each end.
pub fn padding(design: &Design) -> usize {
    let sections = design.sections();
    let without_b2 = sections.iter().filter(|section| section.b[2] == 0.0).count();
    let without_a2 = sections.iter().filter(|section| section.a[1] == 0.0).count();
    3 * (2 * sections.len() + 1 - without_b2.min(without_a2))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::filter::butterworth::low_pass;

    #[test]
    fn a_line_is_not_delayed() {
        let line: Vec<f64> = (0..200).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        let filtered = zero_phase(&low_pass(2, 10.0, 100.0).unwrap(), &line).unwrap();
        // The odd reflection continues the line; far from the ends the start-up transient has decayed.
        assert!((50..150).all(|k| (filtered[k] - line[k]).abs() < 1e-9));
    }

    #[test]
    fn a_signal_that_is_too_short_is_refused() {
        let design = low_pass(2, 10.0, 100.0).unwrap();
        assert_eq!(
            zero_phase(&design, &[0.0; 9]),
            Err(SignalError::TooShort { count: 9, least: 10 })
        );
        assert_eq!(zero_phase(&design, &[f64::NAN; 10]), Err(SignalError::NothingFinite));
    }

    proptest! {
        #[test]
        fn any_signal_gives_finite_numbers_or_an_error(
            signal in prop::collection::vec(prop::num::f64::ANY, 0..60),
        ) {
            let design = low_pass(3, 10.0, 100.0).unwrap();
            if let Ok(filtered) = zero_phase(&design, &signal) {
                prop_assert_eq!(filtered.len(), signal.len());
                prop_assert!(filtered.iter().all(|each| each.is_finite()));
            }
        }
    }
}
