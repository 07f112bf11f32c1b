//! Steps of the contact, which are faster than a response.

use std::ops::Range;

use super::Response;
use crate::gaps::is_usable;

/// A response needs longer than this for most of its rise [s].
const QUICK_SECS: f64 = 0.25;
/// The share of a rise that counts as most of it.
const MOST: f64 = 0.85;
/// Filters ring for this long before a step [s].
const RINGING_SECS: f64 = 0.5;
/// A smaller rise may be as quick because of noise [µS].
const LEAST_US: f64 = 0.2;
/// Below this rate [Hz] a response may rise from one sample to the next.
const LEAST_HZ: f64 = 3.5;

/// The samples around the rise of a response, in the signal that its positions refer to.
pub(super) fn rise(response: &Response, rate_hz: f64) -> Range<usize> {
    let begin = response.onset - QUICK_SECS * rate_hz;
    let end = response.peak + RINGING_SECS * rate_hz;
    begin.max(0.0) as usize..end.max(0.0) as usize + 1
}

/// Whether a response is a step, or a step after filtering: 85 % of its amplitude and at least 0.2 µS within a quarter
/// of a second.
///
/// `around` are the samples [µS] of its [rise]. None is a step below 3.5 Hz.
pub(super) fn is_step(around: &[f64], rate_hz: f64, amplitude_us: f64) -> bool {
    if rate_hz < LEAST_HZ {
        return false;
    }
    let reach = (QUICK_SECS * rate_hz).round().max(1.0) as usize;
    let least_us = (MOST * amplitude_us).max(LEAST_US);
    let rises = |(later, earlier): (&f64, &f64)| {
        is_usable(*later) && is_usable(*earlier) && later - earlier >= least_us
    };
    around.iter().skip(reach).zip(around).any(rises)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_that_changes_at_once_is_a_step_and_a_response_is_none() {
        for rate_hz in [4.0, 32.0, 128.0] {
            let at = |k: usize| k as f64 / rate_hz;
            let count = (2.0 * rate_hz) as usize;
            let step: Vec<f64> = (0..count).map(|k| f64::from(u8::from(at(k) > 1.0))).collect();
            assert!(is_step(&step, rate_hz, 1.0), "{rate_hz}");
            let small: Vec<f64> = step.iter().map(|value| 0.1 * value).collect();
            assert!(!is_step(&small, rate_hz, 0.1), "{rate_hz}");
            let rise = |k: usize| 1.9 * ((-at(k) / 2.0).exp() - (-at(k) / 0.5).exp());
            let response: Vec<f64> = (0..count).map(rise).collect();
            assert!(!is_step(&response, rate_hz, 0.9), "{rate_hz}");
        }
        assert!(!is_step(&[1.0, 4.0], 1.0, 3.0) && !is_step(&[], 4.0, 3.0));
        assert!(!is_step(&[f64::NAN, 4.0], 4.0, 3.0));
    }
}
