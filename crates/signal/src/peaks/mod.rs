//! Peaks of a signal.
//!
//! ```
//! use teampulse_signal::peaks::{Rules, find_peaks};
//!
//! let signal = [0.0, 3.0, 1.0, 1.5, 0.5, 2.0, 2.0, 2.0, 0.0];
//! let peaks = find_peaks(&signal, &Rules { prominence: 1.0..=f64::INFINITY, ..Rules::default() });
//! let indices: Vec<usize> = peaks.iter().map(|peak| peak.index).collect();
//! assert_eq!(indices, [1, 6]);
//! assert_eq!(peaks[1].prominence, 1.5);
//! ```

mod maxima;
mod distance;
mod prominence;
mod width;

use std::ops::RangeInclusive;

/// Which local maxima count as peaks; all by default.
///
/// Bounds are inclusive, as SciPy's; a NaN fails them.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// The value at the peak.
    pub height: RangeInclusive<f64>,
    /// The smallest distance between peaks [samples]; of two closer ones the lower is dropped.
    pub distance: usize,
    /// The height of a peak above the higher of the two valleys that separate it from higher ground.
    pub prominence: RangeInclusive<f64>,
    /// The width [samples] at [`relative_height`](Rules::relative_height).
    pub width: RangeInclusive<f64>,
    /// The share of the prominence below the peak at which the width is measured [0..1], usually half.
    pub relative_height: f64,
}

/// A peak, in the terms of SciPy's `find_peaks`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The index of the peak; the middle of a plateau, rounded down.
    pub index: usize,
    /// The value at the peak.
    pub height: f64,
    /// The height above the higher of the two bases.
    pub prominence: f64,
    /// The index of the minimum between the peak and higher ground to the left, or the start.
    pub left_base: usize,
    /// The index of the minimum between the peak and higher ground to the right, or the end.
    pub right_base: usize,
    /// The width at the relative height [samples].
    pub width: f64,
    /// The left crossing of that height, fractional.
    pub left_crossing: f64,
    /// The right crossing of that height, fractional.
    pub right_crossing: f64,
}

impl Default for Rules {
    fn default() -> Rules {
        let any = f64::NEG_INFINITY..=f64::INFINITY;
        let (height, prominence) = (any.clone(), any.clone());
        Rules { height, distance: 1, prominence, width: any, relative_height: 0.5 }
    }
}

/// Finds the local maxima of `signal` that meet the `rules`, in order.
///
/// Works like `scipy.signal.find_peaks`: height is tested first, then distance, prominence and width; of two equally
/// high peaks that are too close, the later is kept. A maximum exceeds both neighbours; the first and the last sample
/// are never one, nor is a neighbour of a NaN, which acts like higher ground. Not causal: a prominence depends on the
/// whole signal.
pub fn find_peaks(signal: &[f64], rules: &Rules) -> Vec<Peak> {
    let mut indices = maxima::local_maxima(signal);
    indices.retain(|&index| rules.height.contains(&signal[index]));
    distance::keep_apart(signal, &mut indices, rules.distance);
    let mut peaks = prominence::measured(signal, &indices);
    peaks.retain(|peak| rules.prominence.contains(&peak.prominence));
    for peak in &mut peaks {
        width::measure(signal, peak, rules.relative_height);
    }
    peaks.retain(|peak| rules.width.contains(&peak.width));
    peaks
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn indices(signal: &[f64], rules: &Rules) -> Vec<usize> {
        find_peaks(signal, rules).iter().map(|peak| peak.index).collect()
    }

    #[test]
    fn ends_flats_and_slopes_are_no_peaks() {
        for signal in [&[][..], &[1.0], &[1.0; 9], &[0.0, 1.0, 2.0], &[0.0, 2.0, 2.0]] {
            assert_eq!(indices(signal, &Rules::default()), []);
        }
        assert_eq!(indices(&[0.0, 2.0, 2.0, 1.0], &Rules::default()), [1]);
    }

    #[test]
    fn a_gap_parts_the_signal() {
        let signal = [0.0, 5.0, 1.0, f64::NAN, 0.0, 2.0, -1.0];
        let peaks = find_peaks(&signal, &Rules::default());
        assert_eq!(peaks.iter().map(|peak| peak.index).collect::<Vec<_>>(), [1, 5]);
        assert_eq!((peaks[0].prominence, peaks[1].prominence), (4.0, 2.0));
    }

    #[test]
    fn of_two_that_are_close_the_higher_one_stays() {
        let rules = Rules { distance: 3, ..Rules::default() };
        assert_eq!(indices(&[0.0, 3.0, 0.0, 2.0, 0.0], &rules), [1]);
        assert_eq!(indices(&[0.0, 3.0, 0.0, 0.0, 2.0, 0.0], &rules), [1, 4]);
    }

    /// The nearest of the lowest samples on one side of a peak, up to higher ground.
    fn base(signal: &[f64], peak: usize, side: &mut dyn Iterator<Item = usize>) -> usize {
        let lower = side.take_while(|&k| signal[k] <= signal[peak]);
        lower.fold(peak, |lowest, k| if signal[k] < signal[lowest] { k } else { lowest })
    }

    proptest! {
        #[test]
        fn bases_and_prominences_keep_their_definition(
            signal in prop::collection::vec((0..9i32).prop_map(f64::from), 0..80),
        ) {
            for peak in find_peaks(&signal, &Rules::default()) {
                let left = base(&signal, peak.index, &mut (0..peak.index).rev());
                let right = base(&signal, peak.index, &mut (peak.index..signal.len()));
                prop_assert_eq!([peak.left_base, peak.right_base], [left, right]);
                prop_assert_eq!(peak.prominence, peak.height - signal[left].max(signal[right]));
            }
        }

        #[test]
        fn any_signal_is_survived(
            signal in prop::collection::vec(prop::num::f64::ANY, 0..60),
            distance in any::<usize>(),
            relative_height in prop::num::f64::ANY,
        ) {
            let rules = Rules { distance, relative_height, ..Rules::default() };
            prop_assert!(find_peaks(&signal, &rules).len() <= signal.len());
        }
    }
}
