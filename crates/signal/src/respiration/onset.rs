//! The onset of a rise after a turning point.

/// For a sinusoidal rise, the time from its start to a tenth of its height, as a share of the time from a tenth to nine
/// tenths.
const FOOT_SHARE: f64 = 0.347_1;
/// The two heights through which the sine is extrapolated: a tenth and nine tenths.
const LOW: f64 = 0.1;
const HIGH: f64 = 0.9;

/// The (fractional) start of the rise from the first to the last value; never before the first.
///
/// During a preceding pause, the extreme value may be anywhere; the start is extrapolated as that of a sine through a
/// tenth and nine tenths of the height.
pub(super) fn onset(way: &[f64]) -> f64 {
    let (Some(first), Some(last)) = (way.first(), way.last()) else { return 0.0 };
    let share = |value: f64| (value - first) / (last - first);
    let Some(before) = way.iter().rposition(|&value| share(value) <= LOW) else { return 0.0 };
    let crossing = |after: usize, level: f64| {
        let (low, high) = (share(way[after - 1]), share(way[after]));
        after as f64 - (high - level) / (high - low)
    };
    let above = (before + 1..way.len()).find(|&place| share(way[place]) >= HIGH);
    let Some(above) = above else { return 0.0 };
    let (low, high) = (crossing(before + 1, LOW), crossing(above, HIGH));
    let begin = low - FOOT_SHARE * (high - low);
    if begin > 0.0 { begin } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn rise(length: u32) -> impl Iterator<Item = f64> {
        (0..=length).map(move |k| 3.0 - (PI * f64::from(k) / f64::from(length)).cos())
    }

    #[test]
    fn a_sine_begins_at_its_trough() {
        let way: Vec<f64> = rise(100).collect();
        assert!(onset(&way) < 0.5, "{}", onset(&way));
        let fall: Vec<f64> = way.iter().map(|height| -height).collect();
        assert_eq!(onset(&fall), onset(&way));
    }

    #[test]
    fn a_pause_is_left_when_the_rise_begins() {
        let way: Vec<f64> = std::iter::repeat_n(2.0, 70).chain(rise(100)).collect();
        assert!((onset(&way) - 70.0).abs() < 1.5, "{}", onset(&way));
    }

    #[test]
    fn what_does_not_rise_begins_at_its_first_value() {
        assert_eq!(onset(&[]), 0.0);
        assert_eq!(onset(&[1.0]), 0.0);
        assert_eq!(onset(&[1.0, 1.0, 1.0]), 0.0);
        assert_eq!(onset(&[f64::NAN, 1.0, 2.0]), 0.0);
    }
}
