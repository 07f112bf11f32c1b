//! Noise of the amplifier, which looks like responses when it is high.

use super::{Threshold, checked_rate};
use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, median_in_place};

/// Noise is estimated from means at this rate [Hz] or above, but below twice that: faster noise is removed before
/// responses are searched for.
const MEANS_HZ: f64 = 4.0;
/// Below this rate [Hz] the rise of a response is as sharp as noise.
const LEAST_HZ: f64 = 3.5;
/// The length of the stretches in which noise is estimated [s].
const STRETCH_SECS: f64 = 10.0;
/// The fewest differences for an estimate.
const FEWEST: usize = 8;
/// The weights of a fourth difference, which is nearly zero for a response.
const DIFFERENCE: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// The standard deviation of a fourth difference of white noise of unit variance: √(1 + 16 + 36 + 16 + 1).
const SPREAD: f64 = 8.366_600_265_340_756;
/// The threshold as a multiple of the noise: from the higher value on there is no false response in five minutes, at
/// the lower one there are several a minute.
const CLEAR: std::ops::RangeInclusive<f64> = 5.5..=9.0;

/// The share of a signal [µS] in which noise does not count as responses [0..1]: 1 where the threshold is at
/// least 9 times the noise of means over a quarter of a second, 0 where it is below 5.5 times.
///
/// It is 1 for fewer than 3 s, and below 3.5 Hz.
pub(super) fn clarity(signal: &[f64], rate_hz: f64, threshold: Threshold) -> f64 {
    let least_us = match threshold {
        Threshold::Absolute(least_us) => least_us,
        Threshold::Relative(_) => match Threshold::default() {
            Threshold::Absolute(least_us) | Threshold::Relative(least_us) => least_us,
        },
    };
    if checked_rate(rate_hz).is_err() || rate_hz < LEAST_HZ {
        return 1.0;
    }
    let every = (rate_hz / MEANS_HZ).floor().max(1.0) as usize;
    let means: Vec<f64> = signal.chunks_exact(every).map(mean).collect();
    let differences: Vec<f64> = means.windows(DIFFERENCE.len()).map(difference).collect();
    let stretch = (STRETCH_SECS * rate_hz / every as f64) as usize;
    let (mut sum, mut count) = (0.0, 0.0);
    for stretch in differences.chunks(stretch) {
        let Some(noise_us) = spread(stretch) else { continue };
        let clear = (least_us / noise_us - CLEAR.start()) / (CLEAR.end() - CLEAR.start());
        // Without noise the quotient is infinite.
        (sum, count) = (sum + clear.clamp(0.0, 1.0), count + 1.0);
    }
    if count > 0.0 { sum / count } else { 1.0 }
}

/// The mean of the usable values; NaN without one.
fn mean(values: &[f64]) -> f64 {
    let usable = || values.iter().filter(|value| is_usable(**value));
    usable().sum::<f64>() / usable().count() as f64
}

fn difference(means: &[f64]) -> f64 {
    means.iter().zip(DIFFERENCE).map(|(mean, weight)| weight * mean).sum()
}

/// The standard deviation of white noise with these fourth differences; `None` for too few.
fn spread(differences: &[f64]) -> Option<f64> {
    let finite = differences.iter().filter(|each| each.is_finite());
    let mut sizes: Vec<f64> = finite.map(|each| each.abs()).collect();
    let middle_us = if sizes.len() < FEWEST { None } else { median_in_place(&mut sizes) };
    Some(SIGMA_FROM_MAD * middle_us? / SPREAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five minutes of a level with noise that is uniform within ± `most_us`.
    fn noisy(rate_hz: f64, most_us: f64) -> Vec<f64> {
        let mut state = 1_u64;
        let mut noise = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        (0..(300.0 * rate_hz) as usize).map(|_| 5.0 + most_us * noise()).collect()
    }

    #[test]
    fn noise_is_clear_up_to_a_ninth_of_the_threshold() {
        for rate_hz in [4.0, 32.0, 128.0] {
            // Uniform noise has a standard deviation of 0.577 of its most, means of `every` less of it.
            let scale = (rate_hz / 4.0_f64).sqrt() / 0.577;
            let clarity_at =
                |us: f64| clarity(&noisy(rate_hz, us * scale), rate_hz, Threshold::default());
            assert!(clarity_at(0.004) > 0.97, "{rate_hz}");
            assert!((0.3..0.7).contains(&clarity_at(0.007)), "{rate_hz}");
            assert!(clarity_at(0.014) < 0.05, "{rate_hz}");
        }
    }

    #[test]
    fn faster_noise_than_responses_is_clear() {
        let hum = |k: u32| 5.0 + 0.05 * (std::f64::consts::TAU * 50.0 * f64::from(k) / 256.0).sin();
        let signal: Vec<f64> = (0..25600).map(hum).collect();
        assert!(clarity(&signal, 256.0, Threshold::default()) > 0.9);
    }

    #[test]
    fn what_cannot_be_estimated_is_clear() {
        for (signal, rate_hz) in
            [(vec![], 4.0), (vec![f64::NAN; 400], 4.0), (vec![1.0; 5], 4.0), (noisy(1.0, 1.0), 1.0)]
        {
            let clarity = clarity(&signal, rate_hz, Threshold::default());
            assert!((clarity - 1.0).abs() < 1e-12, "{clarity}");
        }
    }
}
