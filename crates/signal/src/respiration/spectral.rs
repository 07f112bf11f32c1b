//! The breathing rate from a spectrum.

use super::band;
use super::grouping::Grouping;
use super::pulsation::HEART_HZ;
use crate::gaps::bridged;
use crate::spectrum::{Detrend, Rule, Spectrum, Transforms, Welch};

/// The band of breathing [Hz]: 3 to 60 a minute.
const BREATHING_HZ: (f64, f64) = (0.05, 1.0);
/// The length of the segments of the spectrum [s].
const SEGMENT_SECS: f64 = 30.0;
/// The shortest signal whose spectrum separates breaths from drift [s].
const SHORTEST_SECS: f64 = 10.0;

/// Computes the breathing rate at the peak of the spectrum [1/min].
///
/// It checks the rate of [breaths](super::Breath) but does not replace it: it returns the most frequent rate or, if
/// breaths are irregular, that of the most regular part. *Formula*: Welch's spectrum of the signal at 25 to 50 Hz
/// (averaged samples), segments of 30 s (the whole of a shorter signal), 50 % overlap, Hann, linearly detrended,
/// zero-padded to a power of two; multiplied by frequency, against drift; the vertex of the parabola through its
/// highest bin between 0.05 and 1 Hz. *Window*: at least 10 s. *Limits*: two rates are resolved if 4 a minute apart;
/// sharp breaths of uneven height may have a higher harmonic. `None` for a signal that is too short or constant, and
/// for a rate outside 5 to 2000 Hz.
pub fn spectral_rate_per_min(signal: &[f64], rate_hz: f64) -> Option<f64> {
    band::band(rate_hz).ok()?;
    let grouping = Grouping::new(rate_hz);
    let rate_hz = rate_hz / grouping.length() as f64;
    let kept = Transforms::default();
    Some(Spectral::of(&grouping.all(signal), rate_hz, &kept)?.rate_per_min)
}

/// The relative half-width of a rhythm.
const RHYTHM_WIDTH: f64 = 0.35;
/// A spread below this share of the largest value is a rounding error.
const LEAST_SPREAD: f64 = 1e-9;

/// The summary of a spectrum.
#[derive(Clone, Debug)]
pub(super) struct Spectral {
    /// The rate at the peak within the breathing band [1/min].
    pub(super) rate_per_min: f64,
    /// The share of the breathing band in all power above drift [0..1].
    pub(super) breathing_share: f64,
    /// The power of the heart's frequencies over that of the breathing band.
    pub(super) heart_to_breath: f64,
    /// The breathing band: frequencies [Hz] and power.
    pub(super) powers: Vec<(f64, f64)>,
}

impl Spectral {
    /// Summarises the spectrum of group means; `kept` caches FFT plans.
    pub(super) fn of(means: &[f64], rate_hz: f64, kept: &Transforms) -> Option<Spectral> {
        if (means.len() as f64) < SHORTEST_SECS * rate_hz {
            return None;
        }
        let segment = ((SEGMENT_SECS * rate_hz) as usize).min(means.len());
        let transform = segment.next_power_of_two();
        let welch = Welch {
            transform: Some(transform),
            detrend: Detrend::Linear,
            ..Welch::new(rate_hz, segment)
        };
        let bridged = bridged(means).ok()?;
        let spectrum = welch.of_next(&bridged, kept).ok()?;
        let (low_hz, high_hz) = BREATHING_HZ;
        let breathing = spectrum.band_power(low_hz, high_hz, Rule::Sum)?;
        let all = spectrum.band_power(low_hz, rate_hz, Rule::Sum)?;
        let heart = spectrum.band_power(HEART_HZ.0, HEART_HZ.1, Rule::Sum).unwrap_or(f64::NAN);
        let heart_to_breath = heart / spectrum.band_power(low_hz, HEART_HZ.0, Rule::Sum)?;
        let level = bridged.iter().fold(0.0f64, |level, mean| level.max(mean.abs()));
        let varies = all.sqrt() > LEAST_SPREAD * level;
        let breathing_share = Some(breathing / all).filter(|share| varies && share.is_finite())?;
        let rate_per_min = 60.0 * peak_hz(&spectrum)?;
        let bins = spectrum.bins(low_hz, high_hz);
        let powers =
            bins.filter_map(|bin| Some((spectrum.frequencies_hz[bin], *spectrum.power.get(bin)?)));
        Some(Spectral { rate_per_min, breathing_share, heart_to_breath, powers: powers.collect() })
    }

    /// The share of the breathing band's power around a rate [1/min] and its second harmonic [0..1].
    pub(super) fn rhythm_share(&self, rate_per_min: f64) -> f64 {
        let hz = rate_per_min / 60.0;
        let all: f64 = self.powers.iter().map(|(_, power)| power).sum();
        let is_near =
            |at_hz: f64| [hz, 2.0 * hz].iter().any(|hz| (at_hz / hz - 1.0).abs() <= RHYTHM_WIDTH);
        let near = self.powers.iter().filter(|(hz, _)| is_near(*hz)).map(|(_, power)| power);
        let share = near.sum::<f64>() / all;
        if share.is_finite() { share.min(1.0) } else { 0.0 }
    }
}

fn peak_hz(spectrum: &Spectrum) -> Option<f64> {
    let (low_hz, high_hz) = BREATHING_HZ;
    let bins = spectrum.bins(low_hz, high_hz);
    let power = |bin: usize| Some(spectrum.power.get(bin)? * spectrum.frequencies_hz[bin]);
    let best =
        bins.filter_map(|bin| Some((power(bin)?, bin))).max_by(|a, b| a.0.total_cmp(&b.0))?.1;
    let (before, here, after) = (power(best.checked_sub(1)?)?, power(best)?, power(best + 1)?);
    let (away, _) = super::turns::vertex(before, here, after);
    Some(spectrum.frequencies_hz[best] + away * spectrum.frequencies_hz[1])
}
