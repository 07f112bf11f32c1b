//! The pulses of a span as a series, good or not.

use super::pulse::Pulse;
use crate::robust::median_in_place;

/// An interval is odd when it deviates from the median by more than this share.
const ODD: f64 = 0.25;

/// Values are large and small in turn if they deviate by more than this share, and more than this share of deviations
/// has the opposite sign of the one before.
const TURN: f64 = 0.08;
const MOSTLY: f64 = 0.8;

/// Intervals, amplitudes and shapes of successive pulses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Train {
    /// The number of pulses.
    pub(super) count: usize,
    /// The median interval [s]; NaN without any.
    pub(super) usual_secs: f64,
    /// The share of intervals that are odd.
    pub(super) odd: f64,
    /// Half the mean deviation of amplitudes from the mean of their neighbours, as a share of the mean.
    pub(super) jagged: f64,
    /// The share of these deviations with the opposite sign of the one before: 1 where amplitudes alternate.
    pub(super) alternate: f64,
    /// The median rise [s], and the median width at half of the amplitude [s]; NaN if unknown.
    pub(super) rise_secs: f64,
    pub(super) width_secs: f64,
    /// Whether pulses are narrow and broad in turn, so that every second one is of a different kind.
    pub(super) is_of_two_kinds: bool,
}

impl Train {
    /// The series of these pulses of a signal at `rate_hz`.
    pub(super) fn of(pulses: &[&Pulse], rate_hz: f64) -> Train {
        let all = |of: fn(&Pulse) -> f64| -> Vec<f64> {
            pulses.iter().map(|pulse| of(pulse)).filter(|value| value.is_finite()).collect()
        };
        let usual = |mut values: Vec<f64>| median_in_place(&mut values).unwrap_or(f64::NAN);
        let secs = |pair: &[&Pulse]| (pair[1].sample - pair[0].sample) / rate_hz;
        let intervals: Vec<f64> = pulses.windows(2).map(secs).collect();
        let usual_secs = usual(intervals.clone());
        let is_odd = |secs: &&f64| (*secs / usual_secs - 1.0).abs() > ODD;
        let odd = intervals.iter().filter(is_odd).count();
        let amplitudes = all(|pulse| pulse.amplitude);
        let bends = bends(&amplitudes);
        let (rises, widths) = (all(|pulse| pulse.rise_ms), all(|pulse| pulse.width_ms));
        Train {
            count: pulses.len(),
            usual_secs,
            odd: odd as f64 / intervals.len().max(1) as f64,
            jagged: mean_size(&bends) / mean_size(&amplitudes),
            alternate: alternate(&bends),
            is_of_two_kinds: in_turn(&rises) && in_turn(&widths),
            rise_secs: usual(rises) / 1e3,
            width_secs: usual(widths) / 1e3,
        }
    }
}

/// Whether values are large and small in turn.
fn in_turn(values: &[f64]) -> bool {
    let bends = bends(values);
    mean_size(&bends) > TURN * mean_size(values) && alternate(&bends) > MOSTLY
}

/// Half the deviation of each value from the mean of its neighbours.
pub(super) fn bends(values: &[f64]) -> Vec<f64> {
    values.windows(3).map(|three| (three[1] - three[0].midpoint(three[2])) / 2.0).collect()
}

/// The share of bends with the opposite sign of the one before.
pub(super) fn alternate(bends: &[f64]) -> f64 {
    let turned = bends.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
    turned as f64 / (bends.len().max(2) - 1) as f64
}

/// The mean of absolute values; 0 without any.
pub(super) fn mean_size(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pulses at these times [s] with these amplitudes, at 100 Hz.
    fn train(at_secs: &[f64], amplitude: impl Fn(usize) -> f64) -> Train {
        let pulse = |(index, at): (usize, &f64)| Pulse {
            sample: 100.0 * at,
            onset: 100.0 * at - 20.0,
            middle: 100.0 * at - 10.0,
            amplitude: amplitude(index),
            rise_ms: 200.0,
            width_ms: 300.0,
        };
        let pulses: Vec<Pulse> = at_secs.iter().enumerate().map(pulse).collect();
        Train::of(&pulses.iter().collect::<Vec<_>>(), 100.0)
    }

    #[test]
    fn equal_pulses_are_even_and_alternating_ones_turn() {
        let at_secs: Vec<f64> = (0..20).map(f64::from).collect();
        let equal = train(&at_secs, |_| 2.0);
        assert_eq!((equal.odd, equal.jagged, equal.alternate), (0.0, 0.0, 0.0));
        let alternating = train(&at_secs, |index| [2.0, 1.0][index % 2]);
        assert_eq!(alternating.alternate, 1.0);
        assert!((alternating.jagged - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn narrow_and_broad_pulses_in_turn_are_of_two_kinds() {
        let at = |index: usize, broad: f64| {
            let size = if index.is_multiple_of(2) { 1.0 } else { broad };
            let (rise_ms, width_ms) = (100.0 * size, 140.0 * size);
            let sample = 50.0 * index as f64;
            let (onset, middle) = (sample - 10.0, sample - 5.0);
            Pulse { sample, onset, middle, amplitude: 1.0, rise_ms, width_ms }
        };
        let is_of_two_kinds = |broad: f64| {
            let pulses: Vec<Pulse> = (0..20).map(|index| at(index, broad)).collect();
            Train::of(&pulses.iter().collect::<Vec<_>>(), 100.0).is_of_two_kinds
        };
        assert!(is_of_two_kinds(1.4) && !is_of_two_kinds(1.1));
    }

    #[test]
    fn a_missed_pulse_leaves_an_odd_interval() {
        let train = train(&[0.0, 1.0, 2.0, 4.0, 5.0], |_| 1.0);
        assert_eq!((train.usual_secs, train.odd), (1.0, 0.25));
    }

    #[test]
    fn without_pulses_nothing_is_known() {
        let train = train(&[], |_| 1.0);
        assert_eq!((train.count, train.odd, train.alternate), (0, 0.0, 0.0));
        assert!(train.usual_secs.is_nan() && train.rise_secs.is_nan());
    }
}
