//! The median and the MAD of a sliding window.

use super::band::Band;
use crate::robust::median_in_place;

/// How far the median and the MAD can move before the whole window is examined again [MAD].
///
/// A wider band holds more values; a narrower one needs full scans more often. For a signal that rises linearly they
/// move by 4 / 30 when a thirtieth of the window is new.
const REACH: f64 = 0.2;

/// The values of a window close to its last median and MAD.
///
/// The result is exact: when the middle has moved out of what is held, all values are examined.
#[derive(Clone, Debug, Default)]
pub(super) struct Middle {
    /// Bands around the median, and one MAD below and above it; empty before the first scan.
    bands: Vec<Band>,
    /// Room for the values that are ordered, kept from one window to the next.
    room: Vec<f64>,
}

impl Middle {
    /// Slides the window: its first values left, and new ones were appended.
    pub(super) fn slide(
        &mut self,
        gone: &(impl Iterator<Item = f64> + Clone),
        new: &(impl Iterator<Item = f64> + Clone),
    ) {
        for band in &mut self.bands {
            band.pop(gone.clone());
            band.push(new.clone());
        }
    }

    /// Forgets the bands; the window has changed entirely.
    pub(super) fn clear(&mut self) {
        self.bands.clear();
    }

    /// The median and the (unscaled) median absolute deviation of the window's values, `count` of which are
    /// not NaN. `None` without values.
    pub(super) fn median_and_mad(
        &mut self,
        count: usize,
        values: &(impl Iterator<Item = f64> + Clone),
    ) -> Option<(f64, f64)> {
        let mut room = std::mem::take(&mut self.room);
        let found = self.known(count, &mut room).or_else(|| self.look(values, &mut room));
        self.room = room;
        found
    }

    /// The result from the held values alone, where they suffice.
    fn known(&self, count: usize, room: &mut Vec<f64>) -> Option<(f64, f64)> {
        let [around, low, high] = &self.bands[..] else { return None };
        fill(room, around.inside.iter().copied());
        let [lower, upper] = middle_two(room, around.below, count)?;
        let median = lower.midpoint(upper);
        let nearer = high.below.checked_sub(low.below + low.inside.len())?;
        let held = low.inside.iter().chain(&high.inside);
        fill(room, held.map(|value| (value - median).abs()));
        let [lower, upper] = middle_two(room, nearer, count)?;
        // No value between the bands is farther from the median than these values, and none beyond the bands is nearer.
        let is_between = (median - low.until).max(high.from - median) <= lower
            && upper <= (median - low.from).min(high.until - median);
        is_between.then(|| (median, lower.midpoint(upper)))
    }

    fn look(
        &mut self,
        values: &(impl Iterator<Item = f64> + Clone),
        room: &mut Vec<f64>,
    ) -> Option<(f64, f64)> {
        fill(room, values.clone().filter(|value| !value.is_nan()));
        let median = median_in_place(room)?;
        for value in &mut *room {
            *value = (*value - median).abs();
        }
        let mad = median_in_place(room)?;
        self.bands = bands(median, mad);
        self.bands.iter_mut().for_each(|band| band.push(values.clone()));
        Some((median, mad))
    }
}

/// Replaces the values in a vector.
fn fill(room: &mut Vec<f64>, values: impl Iterator<Item = f64>) {
    room.clear();
    room.extend(values);
}

/// The bands in which the middle values are expected next time.
fn bands(median: f64, mad: f64) -> Vec<Band> {
    let reach = REACH * mad;
    let (near, far) = ((mad - reach).max(0.0), mad + reach);
    // If all values are equal, each band holds at least these.
    let above = |from: f64, until: f64| Band::new(from, until.max(from.next_up()));
    let around = above(median - reach, (median + reach).max(median.next_up()));
    let high = above(median + near, (median + far).max((median + mad).next_up()));
    vec![around, Band::new(median - far, median - near), high]
}

/// The two middle values of `count` (the same twice for an odd count), where `values` rank after `before` others;
/// `None` if the middle values are not among `values`.
fn middle_two(values: &mut [f64], before: usize, count: usize) -> Option<[f64; 2]> {
    let lower_rank = (count.checked_sub(1)? / 2).checked_sub(before)?;
    let upper_rank = (count / 2).checked_sub(before).filter(|rank| *rank < values.len())?;
    let (below, upper, _) = values.select_nth_unstable_by(upper_rank, f64::total_cmp);
    let upper = *upper;
    if lower_rank == upper_rank {
        return Some([upper; 2]);
    }
    let lower = below.iter().copied().max_by(f64::total_cmp)?;
    Some([lower, upper])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::robust::{mad, median};

    fn held(middle: &Middle) -> usize {
        middle.bands.iter().map(|band| band.inside.len()).sum()
    }

    /// Numbers between 0 and 1 without an order.
    fn noise(count: usize) -> Vec<f64> {
        let number = |k: usize| (k as u32).wrapping_mul(2_654_435_769);
        (0..count).map(|k| f64::from(number(k)) / 2f64.powi(32)).collect()
    }

    #[test]
    fn nothing_has_no_middle() {
        let mut middle = Middle::default();
        assert_eq!(middle.median_and_mad(0, &[f64::NAN].into_iter()), None);
        assert_eq!(middle.median_and_mad(1, &[7.0].into_iter()), Some((7.0, 0.0)));
        middle.slide(&[7.0].into_iter(), &[].into_iter());
        assert_eq!(middle.median_and_mad(0, &[].into_iter()), None);
    }

    #[test]
    fn of_noise_a_few_values_are_enough() {
        let values = noise(20_000);
        let mut middle = Middle::default();
        middle.median_and_mad(10_000, &values[..10_000].iter().copied());
        for begin in (0..10_000).step_by(100) {
            let (gone, new) = (begin..begin + 100, begin + 10_000..begin + 10_100);
            middle.slide(&values[gone].iter().copied(), &values[new].iter().copied());
            assert!(middle.known(10_000, &mut Vec::new()).is_some() && held(&middle) < 4000);
        }
    }

    #[test]
    fn equal_values_are_known_to_be_equal() {
        for value in [0.0, -3.5, 1e99] {
            let mut middle = Middle::default();
            middle.median_and_mad(6, &[value; 6].into_iter());
            middle.slide(&[value; 2].into_iter(), &[value, 2.0 * value + 1.0].into_iter());
            assert_eq!(middle.known(6, &mut Vec::new()), Some((value, 0.0)));
        }
    }

    proptest! {
        #[test]
        fn a_window_that_slides_has_the_middle_of_its_values(
            values in prop::collection::vec(
                prop_oneof![
                    8 => -1.0..1.0f64,
                    8 => (-3i32..3).prop_map(f64::from),
                    1 => -1e9..1e9f64,
                    1 => Just(f64::NAN),
                ],
                1..2000,
            ),
            drift in prop_oneof![Just(0.0), -0.01..0.01f64],
            (length, step) in (1usize..400, 1usize..100),
            anew in prop_oneof![4 => Just(false), 1 => Just(true)],
        ) {
            let drifted = |(k, value): (usize, &f64)| value + drift * k as f64;
            let values: Vec<f64> = values.iter().enumerate().map(drifted).collect();
            let mut middle = Middle::default();
            let mut last = 0..0;
            for end in (0..=values.len()).step_by(step) {
                let window = end.saturating_sub(length).max(last.start)..end;
                let gone = last.start..window.start.min(last.end);
                let new = window.start.max(last.end)..end;
                let of = |range: std::ops::Range<usize>| values[range].iter().copied();
                middle.slide(&of(gone), &of(new));
                if anew {
                    middle.clear();
                }
                let count = of(window.clone()).filter(|value| !value.is_nan()).count();
                let found = middle.median_and_mad(count, &of(window.clone()));
                let inside = &values[window.clone()];
                prop_assert_eq!(found, median(inside).zip(mad(inside)));
                last = window;
            }
        }
    }
}
