//! Signal quality of an ECG.

use std::ops::RangeInclusive;

use super::clean::without_wander;
use super::likeness::{Likeness, Looks};
use super::pieces::PIECE_SECS;
use super::recent::median;
use crate::filter::zero_phase;
use crate::gaps::is_usable;

/// The supported rates [Hz].
const RATES_HZ: RangeInclusive<f64> = 80.0..=4000.0;
/// A signal constant for longer is flat or saturated [s].
const FLAT_SECS: f64 = 0.2;
/// The level between beats, relative to their height, that halves the quality.
const HALVING: f64 = 0.18;

/// Signal quality from 0 (useless) to 1 (equal beats with nothing between them).
///
/// similarity / (1 + (between / 0.18)³) · living share, where
/// - similarity is the mean similarity of each beat to the third most similar of the eight before it, 2·⟨a, b⟩
///   / (⟨a, a⟩ + ⟨b, b⟩) from 0.1 s before to 0.15 s after, detrended and not below 0: the share of the beats'
///   shape in the total power around them (after Orphanidou et al. 2015, doi:10.1109/JBHI.2014.2338351);
/// - between is the median absolute value of the signal above 0.5 Hz, in the median segment of 4 s, over the
///   median height of beats: 0.02 to 0.05 for a clean ECG;
/// - the living share is the share of samples that are usable numbers and not flat (constant for more than 0.2
///   s: a detached electrode, or saturation).
///
/// Above 0.9 an ECG is clean; below 0.4 one beat in ten is false or missed. Hum counts as noise; high T waves lower the
/// quality slightly. `beats` are the [samples](super::Beat::sample) of beats within the signal. Fewer than three give
/// 0: 10 s with a living heart contain more. `None` without a signal or for a rate outside 80 to 4000 Hz.
pub fn quality(signal: &[f64], rate_hz: f64, beats: &[f64]) -> Option<f64> {
    if signal.is_empty() || !RATES_HZ.contains(&rate_hz) {
        return None;
    }
    let mut likeness = Likeness::new(rate_hz);
    let looks = beats.iter().filter_map(|&beat| likeness.push(signal, beat));
    let (mut heights, likenesses): (Vec<f64>, Vec<Option<f64>>) =
        looks.map(|Looks { height, likeness, .. }| (height, likeness)).unzip();
    if heights.len() < 3 {
        return Some(0.0);
    }
    let likenesses: Vec<f64> = likenesses.into_iter().flatten().collect();
    let parts = Parts {
        likeness: likenesses.iter().sum::<f64>() / likenesses.len() as f64,
        between: between(signal, rate_hz)? / median(&mut heights)?,
        living: living_share(signal, rate_hz),
    };
    Some(parts.quality())
}

/// The components of a quality.
pub(super) struct Parts {
    /// The similarity of beats [0..1].
    pub(super) likeness: f64,
    /// The level between beats, relative to their height.
    pub(super) between: f64,
    /// The share of the signal that is alive [0..1].
    pub(super) living: f64,
}

impl Parts {
    pub(super) fn quality(&self) -> f64 {
        let quality = self.likeness / (1.0 + (self.between / HALVING).powi(3)) * self.living;
        // Beats and the signal between them have zero height: nothing is readable.
        if quality.is_nan() { 0.0 } else { quality.clamp(0.0, 1.0) }
    }
}

/// The level between beats in the median segment.
fn between(signal: &[f64], rate_hz: f64) -> Option<f64> {
    let clean = zero_phase(&without_wander(rate_hz).ok()?, signal).ok()?;
    let pieces = clean.chunks((PIECE_SECS * rate_hz) as usize);
    let sizes = |piece: &[f64]| median(&mut piece.iter().map(|v| v.abs()).collect::<Vec<_>>());
    median(&mut pieces.filter_map(sizes).collect::<Vec<_>>())
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
    /// Twenty seconds with a beat each second.
    fn clean() -> Vec<f64> {
        let bump = |k: usize, at: f64, width: f64| (-((k % 100) as f64 - at).powi(2) / width).exp();
        (0..2000).map(|k| bump(k, 50.0, 5.0) + 0.1 * bump(k, 75.0, 50.0)).collect()
    }

    fn beats() -> Vec<f64> {
        (0..20).map(|k| f64::from(k * 100 + 50)).collect()
    }

    #[test]
    fn the_more_noise_the_less_quality() {
        let noise = |k: usize| ((k * k) as f64 * 0.7).sin();
        let qualities = [0.0, 0.05, 0.1, 0.2, 0.4, 0.8].map(|height| {
            let noisy = clean().into_iter().enumerate().map(|(k, v)| v + height * noise(k));
            quality(&noisy.collect::<Vec<_>>(), RATE_HZ, &beats()).unwrap()
        });
        assert!(qualities.is_sorted_by(|a, b| a > b), "{qualities:?}");
    }

    #[test]
    fn what_is_flat_or_missing_counts_as_lost() {
        for lost in [0.3, f64::NAN] {
            let mut signal = clean();
            signal[1060..1140].fill(lost);
            let (all, without) = (clean(), signal);
            let [all, without] = [all, without].map(|v| quality(&v, RATE_HZ, &beats()).unwrap());
            assert!((0.9..0.99).contains(&(without / all)), "{without} of {all}");
        }
    }

    #[test]
    fn without_beats_there_is_no_quality() {
        assert_eq!(quality(&clean(), RATE_HZ, &beats()[..2]), Some(0.0));
        assert_eq!(quality(&[], RATE_HZ, &beats()), None);
        assert_eq!(quality(&clean(), f64::NAN, &beats()), None);
        assert_eq!(quality(&clean(), RATE_HZ, &[f64::NAN, -1e300, 1e300]), Some(0.0));
    }
}
