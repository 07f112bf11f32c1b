//! Whether breaths recur.

use std::ops::RangeInclusive;

use super::pattern::mean;
use crate::gaps::is_usable;

/// The rate at which slopes are compared [Hz].
const SLOPES_HZ: f64 = 6.25;
/// The number of steps over which a slope is taken.
const SLOPE_STEPS: usize = 2;
/// The lags, in breaths, of the next breath and of its opposite phase.
const NEXT: RangeInclusive<f64> = 0.75..=1.3;
const OPPOSITE: RangeInclusive<f64> = 0.3..=0.7;

/// How much higher the autocorrelation of the signal's slope is one breath later than half a breath later.
///
/// 1.5 to 1.8 for breaths of equal duration, 2 for a sine. The slope of a random walk is white, however much
/// the walk itself looks like breaths: about 0.2. 0 for a signal shorter than two breaths or a constant one.
pub(super) fn recurrence(means: &[f64], rate_hz: f64, breath_secs: f64) -> f64 {
    let group = (rate_hz / SLOPES_HZ).round().max(1.0) as usize;
    let slopes = slopes(means, group);
    let breath = breath_secs * rate_hz / group as f64;
    let (Some(highest), Some(lowest)) = (lags(&NEXT, breath).max(), lags(&OPPOSITE, breath).min())
    else {
        return 0.0;
    };
    if !breath.is_finite() || highest.max(lowest) > slopes.len() / 2 {
        return 0.0;
    }
    let at = |lag: usize| covariance(&slopes, lag);
    let next = lags(&NEXT, breath).map(at).fold(f64::NEG_INFINITY, f64::max);
    let opposite = lags(&OPPOSITE, breath).map(at).fold(f64::INFINITY, f64::min);
    let recurrence = (next - opposite) / at(0);
    if recurrence.is_finite() { recurrence } else { 0.0 }
}

/// The slopes of group means, without their mean; 0 where one is missing.
fn slopes(means: &[f64], group: usize) -> Vec<f64> {
    let levels: Vec<f64> = means.chunks_exact(group).map(mean).collect();
    let slope = |pair: &[f64]| pair[SLOPE_STEPS] - pair[0];
    let slopes: Vec<f64> = levels.windows(SLOPE_STEPS + 1).map(slope).collect();
    let usable: Vec<f64> = slopes.iter().copied().filter(|&slope| is_usable(slope)).collect();
    let usual = mean(&usable);
    let centred = |slope: f64| if is_usable(slope) { slope - usual } else { 0.0 };
    slopes.into_iter().map(centred).collect()
}

fn lags(breaths: &RangeInclusive<f64>, breath: f64) -> RangeInclusive<usize> {
    (breaths.start() * breath).round() as usize..=(breaths.end() * breath).round() as usize
}

/// The mean product of values that are this many steps apart.
fn covariance(values: &[f64], lag: usize) -> f64 {
    let pairs = values.iter().zip(values.iter().skip(lag));
    pairs.map(|(one, other)| one * other).sum::<f64>() / (values.len() - lag) as f64
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const RATE_HZ: f64 = 25.0;

    #[test]
    fn a_sine_recurs_and_noise_does_not() {
        let breaths: Vec<f64> = (0..1500).map(|k| (TAU * f64::from(k) / 100.0).sin()).collect();
        assert!((recurrence(&breaths, RATE_HZ, 4.0) - 2.0).abs() < 0.1);
        let noise: Vec<f64> = (0..1500).map(|k| (f64::from(k * k) * 0.7).sin()).collect();
        assert!(recurrence(&noise, RATE_HZ, 4.0) < 0.5);
    }

    #[test]
    fn what_is_short_flat_or_missing_does_not_recur() {
        for signal in [vec![], vec![1.0; 1500], vec![f64::NAN; 1500], vec![0.0, 1.0, 0.0]] {
            assert!(recurrence(&signal, RATE_HZ, 4.0).abs() < 1e-9);
        }
        assert!(recurrence(&[1.0; 1500], RATE_HZ, f64::NAN).abs() < 1e-9);
    }
}
