//! Blinks in the frontal EEG, causal and of whole recordings.

mod candidates;
mod noise;
mod polarity;
mod causal;
mod whole;

pub use causal::BlinkDetector;
pub use whole::find_blinks;

use crate::error::SignalError;
use crate::filter::{Design, butterworth};

/// The low-pass that removes alpha and muscle activity [Hz].
const LOW_PASS_HZ: f64 = 7.0;
/// The median frequency of a blink's power, at which the filter's delay is taken [Hz].
const BLINK_HZ: f64 = 3.0;
/// Rates above twice this are decimated towards it [Hz].
const WORKING_RATE_HZ: f64 = 100.0;
/// The smallest height of a blink, relative to the usual variation and absolute [µV].
const LEAST_RATIO: f64 = 5.0;
const LEAST_UV: f64 = 30.0;

/// A blink of the eyes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blink {
    /// The time of closed lids [samples from the first one], fractional.
    pub sample: f64,
    /// The height above the signal before or after it, whichever is less, below 7 Hz [µV].
    pub amplitude_uv: f64,
    /// The width at half of that height [s].
    pub duration_secs: f64,
}

/// The low-pass before the detection: of order 4, or 2 when applied both ways.
fn low_pass(order: u32, rate_hz: f64) -> Result<Design, SignalError> {
    butterworth::low_pass(order, LOW_PASS_HZ, super::checked_rate_hz(rate_hz)?)
}

/// The decimation factor to the working rate.
fn thinning(rate_hz: f64) -> usize {
    (rate_hz / WORKING_RATE_HZ).floor().max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RATE_HZ: f64 = 256.0;
    const AT_SECS: [f64; 12] =
        [5.0, 8.5, 9.0, 14.0, 20.0, 20.3, 27.0, 31.0, 36.0, 44.0, 49.5, 55.0];

    fn noise(k: usize) -> f64 {
        let bits = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / 8_388_608.0 - 1.0
    }

    /// Blinks of 150 µV and about 0.1 s at half height, which open more slowly than they close.
    fn blinks(k: usize) -> f64 {
        let secs = k as f64 / RATE_HZ;
        let lid = |at: &f64| {
            let away = secs - at;
            let width = if away < 0.0 { 0.04 } else { 0.06 };
            150.0 * (-(away / width).powi(2) / 2.0).exp()
        };
        AT_SECS.iter().map(lid).sum()
    }

    /// Alpha of 20 µV, noise that wanders, drift and a step of the electrode.
    fn background() -> Vec<f64> {
        let mut wander = 0.0;
        let value = |k: usize| {
            let secs = k as f64 / RATE_HZ;
            wander = 0.98 * wander + 3.0 * noise(k);
            let step = if secs > 40.0 { 400.0 } else { 0.0 };
            20.0 * (std::f64::consts::TAU * 10.3 * secs).sin() + wander + 8.0 * secs + step
        };
        (0..(60.0 * RATE_HZ) as usize).map(value).collect()
    }

    fn signal(sign: f64) -> Vec<f64> {
        background().iter().enumerate().map(|(k, value)| value + sign * blinks(k)).collect()
    }

    fn causal(signal: &[f64]) -> Vec<Blink> {
        let mut detector = BlinkDetector::new(RATE_HZ).unwrap();
        signal.iter().filter_map(|&sample| detector.push(sample)).collect()
    }

    #[test]
    fn all_blinks_are_found_and_nothing_else_in_either_polarity() {
        for sign in [1.0, -1.0] {
            for found in [find_blinks(&signal(sign), RATE_HZ).unwrap(), causal(&signal(sign))] {
                assert_eq!(found.len(), AT_SECS.len(), "{found:?}");
                for (blink, at_secs) in found.iter().zip(AT_SECS) {
                    assert!((blink.sample / RATE_HZ - at_secs).abs() < 0.03, "{blink:?} {at_secs}");
                    assert!((110.0..190.0).contains(&blink.amplitude_uv), "{blink:?}");
                    assert!((0.08..0.2).contains(&blink.duration_secs), "{blink:?}");
                }
            }
        }
    }

    #[test]
    fn blinks_are_found_at_any_rate() {
        for rate_hz in [100.0, 125.0, 160.0, 199.9, 250.0, 500.0, 1000.0, 2048.0, 5000.0] {
            let bump = |k: usize| {
                let secs = k as f64 / rate_hz;
                let alpha = 15.0 * (std::f64::consts::TAU * 10.3 * secs).sin();
                120.0 * (-((secs % 3.0 - 1.5) / 0.06).powi(2) / 2.0).exp() + alpha
            };
            let signal: Vec<f64> = (0..(30.0 * rate_hz) as usize).map(bump).collect();
            let mut detector = BlinkDetector::new(rate_hz).unwrap();
            let causal: Vec<Blink> =
                signal.iter().filter_map(|&sample| detector.push(sample)).collect();
            let whole = find_blinks(&signal, rate_hz).unwrap();
            // The first comes before the causal detector has learnt what is usual.
            for (found, first) in [(causal, 4.5), (whole, 1.5)] {
                let secs: Vec<f64> = found.iter().map(|blink| blink.sample / rate_hz).collect();
                assert!((secs[0] - first).abs() < 0.02, "{rate_hz} Hz: {secs:?}");
                assert_eq!(secs.len(), ((30.0 - first) / 3.0).ceil() as usize, "{rate_hz} Hz");
                let apart = secs.windows(2).map(|pair| pair[1] - pair[0]);
                assert!(apart.into_iter().all(|secs| (secs - 3.0).abs() < 0.03), "{secs:?}");
            }
        }
    }

    #[test]
    fn alpha_drift_steps_and_silence_are_no_blinks() {
        for signal in [background(), vec![0.0; 10_000], vec![f64::NAN; 10_000], Vec::new()] {
            assert_eq!(causal(&signal), []);
            assert_eq!(find_blinks(&signal, RATE_HZ).unwrap_or_default(), []);
        }
    }

    #[test]
    fn a_blink_is_reported_within_half_a_second() {
        let mut detector = BlinkDetector::new(RATE_HZ).unwrap();
        for (k, sample) in signal(1.0).into_iter().enumerate() {
            if let Some(blink) = detector.push(sample) {
                assert!((k as f64 - blink.sample) / RATE_HZ < 0.5);
            }
        }
    }

    #[test]
    fn rates_that_are_none_are_refused() {
        for rate_hz in [0.0, 1e-9, 1e9, f64::NAN, f64::INFINITY] {
            assert!(BlinkDetector::new(rate_hz).is_err());
            assert!(find_blinks(&[1.0; 100], rate_hz).is_err());
        }
    }

    proptest! {
        #[test]
        fn any_signal_is_survived(
            signal in prop::collection::vec(prop::num::f64::ANY, 0..600),
            rate_hz in 100.0..5000.0f64,
        ) {
            let mut detector = BlinkDetector::new(rate_hz).unwrap();
            let causal = signal.iter().filter_map(|&sample| detector.push(sample)).collect();
            let whole = find_blinks(&signal, rate_hz).unwrap_or_default();
            for blink in [causal, whole].concat() {
                let numbers = [blink.sample, blink.amplitude_uv, blink.duration_secs];
                prop_assert!(numbers.iter().all(|number| number.is_finite()));
            }
        }
    }
}
