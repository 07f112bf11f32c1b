//! How well beats can be read off an ECG.

use std::ops::RangeInclusive;

use super::kernel::{Kernel, sigma_secs};
use super::recent::median;
use crate::gaps::{bridged, is_usable};

/// Rates at which there is something to judge [Hz].
const RATES_HZ: RangeInclusive<f64> = 80.0..=4000.0;
/// The part of the heart cycle that is compared, before and after the beat [s].
const BEFORE_SECS: f64 = 0.1;
const AFTER_SECS: f64 = 0.15;
/// A signal that stays the same for longer is flat, or at the end of its range [s].
const FLAT_SECS: f64 = 0.2;

/// Where QRS complexes have most of their power [Hz], and how far the weights reach that tell [σ].
const QRS_HZ: f64 = 10.0;
const REACH_SIGMAS: f64 = 3.0;
/// Pieces whose power is compared [s].
const PIECE_SECS: f64 = 2.0;

/// Signal quality from 0 (useless) to 1 (nothing but equal QRS complexes).
///
/// √(likeness · power share) · living share, where
/// - likeness is the mean correlation of beats with the median beat from 0.1 s before to 0.15 s
///   after, each above the line between its ends and not below 0 (Orphanidou et al. 2015,
///   doi:10.1109/JBHI.2014.2338351);
/// - the power share is what QRS complexes' band around 10 Hz has of all power but the mean, in the
///   median piece of 2 s (after Clifford et al. 2012, doi:10.1088/0967-3334/33/9/1419);
/// - the living share is that of samples that are usable numbers and not flat (the same for more
///   than 0.2 s: a fallen electrode, or saturation).
///
/// `beats` are the [samples](super::Beat::sample) of beats within the signal. Fewer than three
/// give 0: 10 s of a living heart have more. `None` without a signal or a rate between 80 and
/// 4000 Hz.
///
/// It compares signals of one person and place: high T waves and beats of several kinds lower it,
/// although nothing is wrong.
pub fn quality(signal: &[f64], rate_hz: f64, beats: &[f64]) -> Option<f64> {
    if signal.is_empty() || !RATES_HZ.contains(&rate_hz) {
        return None;
    }
    let cycles = cycles(signal, rate_hz, beats);
    if cycles.len() < 3 {
        return Some(0.0);
    }
    let template = median_cycle(&cycles);
    let correlations = cycles.iter().map(|cycle| correlation(cycle, &template).max(0.0));
    let likeness = correlations.sum::<f64>() / cycles.len() as f64;
    let fit = (likeness * power_share(signal, rate_hz)).sqrt();
    Some((fit * living_share(signal, rate_hz)).clamp(0.0, 1.0))
}

/// The share of the QRS complexes' band in the power of the median piece.
fn power_share(signal: &[f64], rate_hz: f64) -> f64 {
    let Ok(bridged) = bridged(signal) else { return 0.0 };
    let half = (REACH_SIGMAS * sigma_secs(2, QRS_HZ) * rate_hz).ceil() as usize;
    let kernel = Kernel::even(QRS_HZ, half, rate_hz);
    let band: Vec<f64> = bridged.windows(kernel.length()).map(|part| kernel.apply(part)).collect();
    let middle = bridged.get(half..half + band.len()).unwrap_or_default();
    let length = (PIECE_SECS * rate_hz) as usize;
    let pieces = band.chunks(length).zip(middle.chunks(length));
    let mut shares: Vec<f64> = pieces.map(|(band, all)| power(band) / power(all)).collect();
    shares.retain(|share| share.is_finite());
    median(&mut shares).unwrap_or(0.0).min(1.0)
}

fn power(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64
}

/// The surroundings of each beat that are whole, without their means.
fn cycles(signal: &[f64], rate_hz: f64, beats: &[f64]) -> Vec<Vec<f64>> {
    let (before, after) = ((BEFORE_SECS * rate_hz).round(), (AFTER_SECS * rate_hz).round());
    let cycle = |&beat: &f64| {
        let (begin, end) = (beat.round() - before, beat.round() + after);
        let is_inside = begin >= 0.0 && end < signal.len() as f64;
        let cycle = is_inside.then(|| &signal[begin as usize..=end as usize])?;
        let is_whole = cycle.len() > 2 && cycle.iter().all(|&sample| is_usable(sample));
        is_whole.then(|| without_mean(&without_tilt(cycle)))
    };
    beats.iter().filter_map(cycle).collect()
}

/// The values above the line between their ends: breath and motion are slower than a QRS complex.
fn without_tilt(values: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    let step = (last - first) / (values.len() - 1).max(1) as f64;
    (0..values.len()).map(|index| values[index] - (first + step * index as f64)).collect()
}

fn without_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

fn median_cycle(cycles: &[Vec<f64>]) -> Vec<f64> {
    let mut values = Vec::with_capacity(cycles.len());
    let median_at = |place: usize| {
        values.clear();
        values.extend(cycles.iter().map(|cycle| cycle[place]));
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let median: Vec<f64> = (0..cycles[0].len()).map(median_at).collect();
    without_mean(&median)
}

/// Pearson's correlation of values without mean; 0 where one does not change.
fn correlation(left: &[f64], right: &[f64]) -> f64 {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scale = (product(left, left) * product(right, right)).sqrt();
    if scale > 0.0 && scale.is_finite() { product(left, right) / scale } else { 0.0 }
}

/// The share of samples that are usable and not flat.
fn living_share(signal: &[f64], rate_hz: f64) -> f64 {
    let longest = (FLAT_SECS * rate_hz) as usize;
    let is_same = |a: &f64, b: &f64| a.total_cmp(b).is_eq() || !(is_usable(*a) || is_usable(*b));
    let living = signal.chunk_by(is_same).filter(|run| is_usable(run[0]) && run.len() <= longest);
    living.map(<[f64]>::len).sum::<usize>() as f64 / signal.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 100.0;
    const BEATS: [f64; 4] = [100.0, 200.0, 300.0, 400.0];

    fn clean() -> Vec<f64> {
        let bump = |k: usize, at: f64, width: f64| (-((k % 100) as f64 - at).powi(2) / width).exp();
        (0..500)
            .map(|k| bump(k, 0.0, 5.0) + bump(k, 100.0, 5.0) + 0.1 * bump(k, 50.0, 900.0))
            .collect()
    }

    #[test]
    fn the_more_noise_the_less_quality() {
        let noise = |k: usize| ((k * k) as f64 * 0.7).sin();
        let qualities = [0.0, 0.05, 0.1, 0.2, 0.4, 0.8].map(|height| {
            let noisy = clean().into_iter().enumerate().map(|(k, v)| v + height * noise(k));
            quality(&noisy.collect::<Vec<_>>(), RATE_HZ, &BEATS).unwrap()
        });
        assert!(qualities.is_sorted_by(|a, b| a > b), "{qualities:?}");
    }

    #[test]
    fn what_is_flat_or_missing_counts_as_lost() {
        for lost in [0.3, f64::NAN] {
            let mut signal = clean();
            signal[225..275].fill(lost);
            let (all, without) = (clean(), signal);
            let [all, without] = [all, without].map(|v| quality(&v, RATE_HZ, &BEATS).unwrap());
            // A tenth of the signal; it has a little less power outside of the band then.
            assert!((0.75..0.95).contains(&(without / all)), "{without} of {all}");
        }
    }

    #[test]
    fn without_beats_there_is_no_quality() {
        assert_eq!(quality(&clean(), RATE_HZ, &BEATS[..2]), Some(0.0));
        assert_eq!(quality(&[], RATE_HZ, &BEATS), None);
        assert_eq!(quality(&clean(), f64::NAN, &BEATS), None);
        assert_eq!(quality(&clean(), RATE_HZ, &[f64::NAN, -1e300, 1e300]), Some(0.0));
    }
}
