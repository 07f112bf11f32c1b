//! Validity of skin conductance samples.

use std::cell::LazyCell;

use super::checked_rate;
use super::contact::glitches;
use crate::gaps::is_usable;

/// The plausible range of skin conductance [µS]; below it an electrode is off.
const RANGE_US: std::ops::RangeInclusive<f64> = 0.05..=60.0;
/// The level from which on electrodes certainly touch the skin [µS].
const FIRM_US: f64 = 0.2;
/// The steepest plausible slope [µS/s].
const STEEPEST_US_PER_SEC: f64 = 10.0;
/// The shortest time over which slopes are taken [s]: over a shorter time, a step of the converter's last digit is
/// steep.
const SLOPE_SECS: f64 = 0.25;
/// The temperature of the skin below a worn device [°C].
const SKIN_C: std::ops::RangeInclusive<f64> = 30.0..=40.0;
/// Samples this close to an invalid one are invalid as well [s].
pub(super) const SPREAD_SECS: f64 = 5.0;
/// A value constant for longer means a disconnected or saturated input [s].
const FLAT_SECS: f64 = 20.0;
/// The highest value is the end of the range if it is constant for at least this time [s] and was reached fast.
const RAIL_SECS: f64 = 1.0;
/// The fewest samples at the end of the range, and the fewest smallest steps by which it is reached: a peak is reached
/// in single steps.
const RAIL_SAMPLES: usize = 4;
const RAIL_STEPS: f64 = 3.0;

/// Whether each sample of a skin conductance [µS] is valid: the rules of Kleckner et al. (2018),
/// doi:10.1109/TBME.2017.2758643, and that the signal varies.
///
/// Samples are invalid if they are missing, outside 0.05 to 60 µS, with a slope over a quarter of a second above 10
/// µS/s, within a contact glitch, with a skin `temperature` [°C] (may be empty) outside 30 to 40 °C, or constant for 20
/// s (or throughout) or, at the highest value, for a second after a rise that stops at once, and all within 5 s of one
/// of these. None is valid at a rate outside 1 to 2000 Hz.
pub fn valid_samples(signal: &[f64], temperature: &[f64], rate_hz: f64) -> Vec<bool> {
    if checked_rate(rate_hz).is_err() {
        return vec![false; signal.len()];
    }
    let mut valid: Vec<bool> = signal.iter().map(|value| RANGE_US.contains(value)).collect();
    for (valid, celsius) in valid.iter_mut().zip(temperature) {
        *valid &= !is_usable(*celsius) || SKIN_C.contains(celsius);
    }
    refuse_steep(signal, rate_hz, &mut valid);
    refuse_constant(signal, rate_hz, &mut valid);
    for (valid, is_glitch) in valid.iter_mut().zip(glitches(signal, rate_hz)) {
        *valid &= !is_glitch;
    }
    spread(&mut valid, (SPREAD_SECS * rate_hz) as usize);
    valid
}

/// The share of [valid samples](valid_samples) [0..1], weighted by how firmly the electrodes touch: 0 at a
/// mean of 0.05 µS, 1 from 0.2 µS on. `None` without samples.
pub fn quality(signal: &[f64], temperature: &[f64], rate_hz: f64) -> Option<f64> {
    let valid = valid_samples(signal, temperature, rate_hz);
    let share = valid.iter().filter(|&&each| each).count() as f64 / valid.len() as f64;
    (!valid.is_empty()).then(|| share * firmness(signal))
}

/// The certainty of skin contact from the mean plausible level [0..1].
pub(super) fn firmness(signal: &[f64]) -> f64 {
    let touching = || signal.iter().filter(|value| RANGE_US.contains(value));
    let level_us = touching().sum::<f64>() / touching().count() as f64;
    let least_us = *RANGE_US.start();
    let firmness = (level_us - least_us) / (FIRM_US - least_us);
    // NaN without plausible samples.
    if firmness.is_finite() { firmness.clamp(0.0, 1.0) } else { 0.0 }
}

fn refuse_steep(signal: &[f64], rate_hz: f64, valid: &mut [bool]) {
    let step = (SLOPE_SECS * rate_hz).ceil() as usize;
    let most_us = STEEPEST_US_PER_SEC * step as f64 / rate_hz;
    for place in step..signal.len() {
        // A difference to a missing sample is NaN, and rejects nothing.
        if (signal[place] - signal[place - step]).abs() > most_us {
            valid[place] = false;
        }
    }
}

/// Rejects samples that are constant for long, and those at the end of the range.
fn refuse_constant(signal: &[f64], rate_hz: f64, valid: &mut [bool]) {
    let longest = ((FLAT_SECS * rate_hz) as usize).min(signal.len().saturating_sub(1)).max(1);
    let shortest_rail = ((RAIL_SECS * rate_hz) as usize).max(RAIL_SAMPLES);
    let scale = LazyCell::new(|| (highest_us(signal), RAIL_STEPS * smallest_step_us(signal)));
    let is_rail = |begin: usize, height_us: f64| {
        let (highest_us, least_us) = *scale;
        height_us >= highest_us && begin > 0 && height_us - signal[begin - 1] >= least_us
    };
    let mut begin = 0;
    for run in signal.chunk_by(|a, b| a.to_bits() == b.to_bits()) {
        if run.len() > longest || run.len() >= shortest_rail && is_rail(begin, run[0]) {
            valid[begin..begin + run.len()].fill(false);
        }
        begin += run.len();
    }
}

fn highest_us(signal: &[f64]) -> f64 {
    let usable = signal.iter().filter(|value| is_usable(**value));
    usable.copied().fold(f64::NEG_INFINITY, f64::max)
}

fn smallest_step_us(signal: &[f64]) -> f64 {
    let steps = signal.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
}

/// Also rejects samples less than `reach` away from a rejected one.
fn spread(valid: &mut [bool], reach: usize) {
    let run = |valid: &mut dyn Iterator<Item = &mut bool>| {
        let mut left = 0_usize;
        for valid in valid {
            let was_valid = std::mem::replace(valid, *valid && left == 0);
            left = if was_valid { left.saturating_sub(1) } else { reach };
        }
    };
    let refused = valid.to_vec();
    run(&mut valid.iter_mut());
    let mut backwards = refused;
    run(&mut backwards.iter_mut().rev());
    valid.iter_mut().zip(backwards).for_each(|(valid, other)| *valid &= other);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A minute at 4 Hz.
    fn skin() -> Vec<f64> {
        (0..240).map(|k| 1.0 + 0.01 * f64::from(k % 7)).collect()
    }

    fn refused(signal: &[f64], temperature: &[f64]) -> usize {
        valid_samples(signal, temperature, 4.0).iter().filter(|valid| !**valid).count()
    }

    #[test]
    fn five_seconds_around_what_cannot_be_skin_are_refused() {
        assert_eq!(quality(&skin(), &[], 4.0), Some(1.0));
        for (wrong, count) in [(0.0, 41), (f64::NAN, 41), (61.0, 42), (f64::INFINITY, 42)] {
            let mut signal = skin();
            signal[100] = wrong;
            // The way back is steep, too.
            assert_eq!(refused(&signal, &[]), count, "{wrong}");
        }
    }

    #[test]
    fn cold_skin_is_none() {
        let mut celsius = vec![33.0; 240];
        celsius[100] = 25.0;
        celsius[200] = f64::NAN;
        assert_eq!(refused(&skin(), &celsius), 41);
    }

    #[test]
    fn what_never_moves_is_no_skin() {
        assert_eq!(quality(&[3.0; 240], &[], 4.0), Some(0.0));
        assert_eq!(quality(&[3.0; 8], &[], 4.0), Some(0.0));
        let mut signal = skin();
        signal[60..120].fill(1.0);
        assert_eq!(quality(&signal, &[], 4.0), Some(1.0));
        signal[60..150].fill(1.0);
        assert!(quality(&signal, &[], 4.0) < Some(0.6));
    }

    #[test]
    fn an_electrode_that_hardly_touches_is_not_believed() {
        let dry: Vec<f64> = skin().iter().map(|value| 0.08 * value).collect();
        assert!(quality(&dry, &[], 4.0).is_some_and(|quality| (0.1..0.4).contains(&quality)));
        let quiet: Vec<f64> = skin().iter().map(|value| 0.3 * value).collect();
        assert_eq!(quality(&quiet, &[], 4.0), Some(1.0));
    }

    #[test]
    fn half_a_second_of_other_contact_is_refused() {
        let mut signal = skin();
        signal[100] += 0.6;
        signal[101] += 0.6;
        assert_eq!(refused(&signal, &[]), 42);
    }

    #[test]
    fn a_jump_is_steeper_than_skin() {
        let mut signal = skin();
        signal[100..].iter_mut().for_each(|value| *value += 2.6);
        assert_eq!(refused(&signal, &[]), 41);
    }

    #[test]
    fn the_end_of_the_range_is_not_believed_and_a_flat_peak_is() {
        let wave =
            |k: u32| 3.0 + 0.8 * (f64::from(k) / 12.0).sin() + 1e-6 * f64::from(k * 7919 % 1009);
        let whole: Vec<f64> = (0..240).map(wave).collect();
        let coarse: Vec<f64> = whole.iter().map(|value| (value * 10.0).round() / 10.0).collect();
        for signal in [&whole, &coarse] {
            assert_eq!(quality(signal, &[], 4.0), Some(1.0));
        }
        let cut: Vec<f64> = whole.iter().map(|value| value.min(3.4)).collect();
        assert!(quality(&cut, &[], 4.0) < Some(0.4));
    }

    #[test]
    fn nothing_has_no_quality() {
        assert_eq!(quality(&[], &[], 4.0), None);
        assert_eq!(quality(&skin(), &[], f64::NAN), Some(0.0));
    }
}
