//! Shapes of rises that sweat glands do not produce.

use std::ops::Range;

use crate::gaps::is_usable;

/// Rise and fall are compared over the rise time of a response, but at least this time [s].
pub(super) const LEAST_RISE_SECS: f64 = 0.5;
/// How far the peak may be from where it was detected, and the lowest point from the onset [s].
pub(super) const NEAR_SECS: f64 = 0.3;
/// The size of a fall that is like the rise, as a share of it. One of these shapes occurs by chance in 7 % of 1130
/// simulated responses that overlap every 1.6 to 3.5 s, and in none of 376 every 8 to 25 s; it occurs in 99 % of 800
/// waves of breathing, 94 % of 299 bumps and 81 % of 232 dips.
const ALIKE: Range<f64> = 0.75..1.25;
/// A fall by at most this share of the rise does not count as one, after the rise or before it.
const NONE_AFTER: f64 = 0.35;
const NONE_BEFORE: f64 = 0.5;

/// Whether a rise is one side of a symmetric bump, of a wave, or of a dip: a response falls more slowly than it
/// rises, and does not end where a fall began.
///
/// `signal` [µS] begins two rise times of `rise` samples and `near` samples before the `peak`, and has a rise time and
/// `near` samples after it. `None` where it is incomplete.
pub(super) fn is_symmetric(signal: &[f64], peak: usize, rise: usize, near: usize) -> Option<bool> {
    let around = signal.get(peak.checked_sub(near)?..=peak + near)?;
    if !signal.iter().all(|value| is_usable(*value)) {
        return None;
    }
    let highest = (0..around.len()).reduce(|a, b| if around[b] > around[a] { b } else { a })?;
    let peak = peak - near + highest;
    let onset = peak.checked_sub(rise)?;
    let trough = &signal[onset.saturating_sub(near)..=(onset + near).min(peak)];
    let lowest_us = trough.iter().copied().fold(f64::INFINITY, f64::min);
    let before = &signal[onset.checked_sub(rise)?..=onset];
    let before_us = before.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let rise_us = signal[peak] - lowest_us;
    let after = (signal[peak] - signal.get(peak + rise)?) / rise_us;
    let before = (before_us - lowest_us) / rise_us;
    let is_bump = after > ALIKE.start && before < NONE_BEFORE;
    let is_wave = ALIKE.contains(&after) && ALIKE.contains(&before);
    let is_dip = after.abs() < NONE_AFTER && ALIKE.contains(&before);
    Some(is_bump || is_wave || is_dip)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rise with its peak at 6 s of 16 Hz; `None` for a shape that is not judged.
    fn judged(form: impl Fn(f64) -> f64, rise_secs: f64) -> Option<bool> {
        let signal: Vec<f64> = (0..192).map(|k| 5.0 + form(f64::from(k) / 16.0 - 6.0)).collect();
        is_symmetric(&signal, 96, (rise_secs * 16.0) as usize, 5)
    }

    #[test]
    fn waves_bumps_and_dips_are_symmetric_and_responses_are_not() {
        for period_secs in [3.0, 4.0, 6.0] {
            let wave = |secs: f64| 0.03 * (std::f64::consts::TAU * secs / period_secs).cos();
            assert_eq!(judged(wave, period_secs * 0.45), Some(true), "{period_secs}");
        }
        assert_eq!(judged(|secs| 0.4 * (-2.0 * secs * secs).exp(), 1.2), Some(true));
        let dip = |secs: f64| -0.4 * (-2.0 * (secs + 1.2).powi(2)).exp();
        assert_eq!(judged(dip, 1.2), Some(true));
        for fall_secs in [1.5, 2.0, 6.0] {
            let response = |secs: f64| {
                let since = (secs + 1.3).max(0.0);
                (-since / fall_secs).exp() - (-since / 0.6).exp()
            };
            assert_eq!(judged(response, 1.3), Some(false), "{fall_secs}");
        }
    }

    #[test]
    fn what_is_incomplete_is_not_judged() {
        assert_eq!(is_symmetric(&[], 0, 1, 0), None);
        assert_eq!(is_symmetric(&[1.0, 2.0, 3.0], 2, 1, 0), None);
        assert_eq!(judged(|secs| if secs > 1.0 { f64::NAN } else { secs }, 1.2), None);
    }
}
