//! Small breaths between those that are counted.

use super::Breath;
use super::turns::{Kind, Turns};
use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, median};

/// The time over which averages remove noise from the rises between breaths [s].
const SMOOTH_SECS: f64 = 0.5;
/// The smallest rise between breaths that may be a breath, as a share of the median amplitude.
const LEAST_RISE: f64 = 0.08;
/// The multiple of the noise that such a rise must exceed.
const RISE_SIGMAS: f64 = 6.0;
/// Noise is estimated from every fourth sample, as sorting all of them would take longer than everything else.
const EACH: usize = 4;
/// The shortest inhalation [s]: the heart's rises are shorter.
const SHORTEST_RISE_SECS: f64 = 0.55;

/// The share of all rises that were not counted as breaths [0..1].
///
/// Uncounted are rises of the signal between the peak of a breath and its end, by 8 % of the median amplitude and six
/// times the noise, that take 0.55 s or longer: shallow breaths after deep ones, or speech.
pub(super) fn uncounted_share(means: &[f64], rate_hz: f64, breaths: &[&Breath]) -> f64 {
    let amplitudes: Vec<f64> = breaths.iter().map(|breath| breath.amplitude).collect();
    let Some(usual) = median(&amplitudes) else { return 0.0 };
    let smoothed = smoothed(means, (SMOOTH_SECS * rate_hz).round().max(1.0) as usize);
    let least = (LEAST_RISE * usual).max(RISE_SIGMAS * noise(means, &smoothed, rate_hz));
    let shortest = SHORTEST_RISE_SECS * rate_hz;
    let rises = |breath: &&Breath| {
        let places =
            breath.peak.max(0.0) as usize..(breath.end.max(0.0) as usize).min(smoothed.len());
        rises(smoothed.get(places).unwrap_or_default(), least, shortest)
    };
    let uncounted: usize = breaths.iter().map(rises).sum();
    uncounted as f64 / (uncounted + breaths.len()) as f64
}

/// The number of rises by `least` that take at least `shortest` samples.
fn rises(signal: &[f64], least: f64, shortest: f64) -> usize {
    let (mut turns, mut trough, mut count) = (Turns::default(), None, 0);
    for (place, &height) in signal.iter().enumerate() {
        let Some(turn) = turns.push(place, height, least) else { continue };
        match (turn.kind, trough) {
            (Kind::Trough, _) => trough = Some(turn.place),
            (Kind::Peak, Some(from)) if turn.place - from >= shortest => count += 1,
            _ => {}
        }
    }
    count
}

/// Centred moving averages; a missing one is replaced by the last one.
fn smoothed(means: &[f64], length: usize) -> Vec<f64> {
    let (mut sum, mut count, mut last) = (0.0, 0usize, 0.0);
    let reach = length / 2;
    let mut all = Vec::with_capacity(means.len());
    for place in 0..means.len() + reach {
        if let Some(&mean) = means.get(place).filter(|mean| is_usable(**mean)) {
            sum += mean;
            count += 1;
        }
        if let Some(&mean) = place
            .checked_sub(length)
            .and_then(|left| means.get(left))
            .filter(|mean| is_usable(**mean))
        {
            sum -= mean;
            count -= 1;
        }
        if count > 0 {
            last = sum / count as f64;
        }
        if place >= reach {
            all.push(last);
        }
    }
    all
}

/// The noise of averages, from the deviations of the unsmoothed means from them.
fn noise(means: &[f64], smoothed: &[f64], rate_hz: f64) -> f64 {
    let left: Vec<f64> = means
        .iter()
        .zip(smoothed)
        .step_by(EACH)
        .map(|(mean, level)| (mean - level).abs())
        .collect();
    SIGMA_FROM_MAD * median(&left).unwrap_or(0.0) / (SMOOTH_SECS * rate_hz).max(1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const RATE_HZ: f64 = 25.0;

    /// Breaths of 4 s, of which every other one has a share of the height.
    fn share(shallow: f64, ripple: f64) -> f64 {
        let height = |k: u32| {
            let secs = f64::from(k) / RATE_HZ;
            let depth = if secs % 8.0 < 4.0 { 1.0 } else { shallow };
            -depth * ((TAU * secs / 4.0).cos() - 1.0) + ripple * (TAU * 1.2 * secs).sin()
        };
        let signal: Vec<f64> = (0..1600).map(height).collect();
        let begins = (0..8).map(|number| 200.0 * f64::from(number));
        let breath =
            |begin| Breath { begin, peak: begin + 50.0, end: begin + 200.0, amplitude: 2.0 };
        let breaths: Vec<Breath> = begins.map(breath).collect();
        uncounted_share(&signal, RATE_HZ, &breaths.iter().collect::<Vec<_>>())
    }

    #[test]
    fn shallow_breaths_are_seen_and_pauses_and_the_heart_are_none() {
        assert!((share(0.15, 0.0) - 0.5).abs() < 0.01);
        assert!(share(0.0, 0.0).abs() < 0.01);
        assert!(share(0.0, 0.2).abs() < 0.01);
    }

    #[test]
    fn without_breaths_or_samples_nothing_is_uncounted() {
        let breath = Breath { begin: 0.0, peak: 10.0, end: 90.0, amplitude: 1.0 };
        for signal in [vec![], vec![f64::NAN; 100], vec![1.0; 100]] {
            assert!(uncounted_share(&signal, RATE_HZ, &[&breath]).abs() < 0.01);
            assert!(uncounted_share(&signal, RATE_HZ, &[]).abs() < 0.01);
        }
    }
}
