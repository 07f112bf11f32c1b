//! Signal quality of an EEG.

use super::band::ratio;
use super::examiner::Examiner;
use crate::error::SignalError;

/// Segments of a lower [quality](Quality::combined) are artefacts: their power does not come from the brain.
pub const LEAST_QUALITY: f64 = 0.1;
/// The usual range of the amplitude of an EEG [µV], and the limits beyond which it is impossible.
const USUAL_UV: (f64, f64) = (1.0, 100.0);
const TOO_LOW_UV: f64 = 0.1;
const TOO_HIGH_UV: f64 = 1000.0;
/// The mains power relative to that of the EEG at which the quality is zero.
const MOST_MAINS: f64 = 1e4;
/// The power share of 30–45 Hz at which the quality is zero: white noise has a third.
const MOST_MUSCLE: f64 = 0.5;

/// The quality measures of a stretch of an EEG.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Root mean square between 1 and 45 Hz [µV]; NaN where too much is missing.
    pub rms_uv: f64,
    /// Power within 1 Hz of 50 and 60 Hz, relative to 1–45 Hz [1].
    pub mains_ratio: f64,
    /// The share of 30–45 Hz in the power of 1–45 Hz [0..1]: muscle activity.
    pub muscle_share: f64,
    /// The share of samples constant for more than 0.2 s [0..1]: a detached electrode.
    pub flat_share: f64,
    /// The share of samples in runs of three or more at the end of the range [0..1].
    pub saturated_share: f64,
    /// The share of samples that are not [usable numbers](crate::gaps::is_usable) [0..1].
    pub missing_share: f64,
}

impl Quality {
    /// The mean quality of the 4 s segments of a signal at 100 to 5000 Hz.
    ///
    /// Returns an error for another rate, or less than one segment.
    pub fn of(signal: &[f64], rate_hz: f64) -> Result<Quality, SignalError> {
        let mut examiner = Examiner::new(rate_hz)?;
        let length = examiner.length();
        if signal.len() < length {
            return Err(SignalError::TooShort { count: signal.len(), least: length });
        }
        let segments = signal.windows(length).step_by(examiner.step());
        let qualities: Vec<Quality> = segments.map(|segment| examiner.examine(segment)).collect();
        let mean = |part: fn(&Quality) -> f64| mean_of_known(qualities.iter().map(part));
        Ok(Quality {
            rms_uv: mean(|quality| quality.rms_uv),
            mains_ratio: mean(|quality| quality.mains_ratio),
            muscle_share: mean(|quality| quality.muscle_share),
            flat_share: mean(|quality| quality.flat_share),
            saturated_share: mean(|quality| quality.saturated_share),
            missing_share: mean(|quality| quality.missing_share),
        })
    }

    /// All measures combined into one number from 0 (useless) to 1: amplitude · mains · muscle · living
    /// share.
    ///
    /// Each factor falls from 1 without a fault to 0:
    /// - amplitude (RMS, 1–45 Hz): from 100 µV up to 1 mV, and from 1 µV down to 0.1 µV, logarithmically;
    /// - mains: from the power of the EEG to 10,000 times that, logarithmically: mains hum lies outside all
    ///   bands, but indicates poor contact;
    /// - muscle: from a 30–45 Hz share of 0 to one of ½ (Whitham et al. 2007,
    ///   doi:10.1016/j.clinph.2007.04.027: above 20 Hz, most of the power at the scalp is muscle activity);
    /// - the living share: samples that are neither flat nor saturated nor missing.
    ///
    /// The limits are conventions, for comparing channels and times; a blink lowers the quality little.
    pub fn combined(&self) -> f64 {
        let low = falls(USUAL_UV.0 / self.rms_uv, USUAL_UV.0 / TOO_LOW_UV);
        let high = falls(self.rms_uv / USUAL_UV.1, TOO_HIGH_UV / USUAL_UV.1);
        let mains = falls(self.mains_ratio, MOST_MAINS);
        let muscle = (1.0 - self.muscle_share / MOST_MUSCLE).max(0.0);
        let living = 1.0 - self.flat_share - self.saturated_share - self.missing_share;
        let combined = low * high * mains * muscle * living.max(0.0);
        if combined.is_finite() { combined.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Falls logarithmically from 1 at a ratio of 1 to 0 at `most`.
fn falls(ratio: f64, most: f64) -> f64 {
    if ratio.is_nan() {
        return 0.0;
    }
    (1.0 - ratio.max(1.0).ln() / most.ln()).max(0.0)
}

fn mean_of_known(values: impl Iterator<Item = f64>) -> f64 {
    let finite = values.filter(|value| value.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    ratio(sum, count).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const RATE_HZ: f64 = 256.0;

    fn noise(k: usize) -> f64 {
        let bits = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / 8_388_608.0 - 1.0
    }

    fn wave(k: usize, hz: f64) -> f64 {
        (TAU * hz * k as f64 / RATE_HZ).sin()
    }

    fn combined(value: impl Fn(usize) -> f64) -> f64 {
        let signal: Vec<f64> = (0..2560).map(value).collect();
        Quality::of(&signal, RATE_HZ).unwrap().combined()
    }

    fn brain(k: usize) -> f64 {
        20.0 * wave(k, 10.0) + 15.0 * wave(k, 2.5) + noise(k)
    }

    #[test]
    fn a_clean_eeg_is_nearly_perfect() {
        assert!(combined(brain) > 0.95);
    }

    #[test]
    fn the_more_noise_the_less_quality() {
        let with = |height: f64| combined(|k| brain(k) + height * noise(k));
        let qualities = [0.0, 5.0, 10.0, 20.0, 40.0, 80.0].map(with);
        assert!(qualities.is_sorted_by(|a, b| a > b), "{qualities:?}");
        let with = |height: f64| combined(|k| brain(k) + height * wave(k, 50.0));
        let qualities = [0.0, 50.0, 200.0, 1000.0].map(with);
        assert!(qualities.is_sorted_by(|a, b| a > b), "{qualities:?}");
    }

    #[test]
    fn what_is_flat_saturated_missing_or_wild_counts_as_lost() {
        let all = combined(brain);
        let flat = combined(|k| if (1000..1200).contains(&k) { 3.0 } else { brain(k) });
        let saturated = combined(|k| brain(k).clamp(-25.0, 25.0));
        let missing = combined(|k| if (1000..1600).contains(&k) { f64::NAN } else { brain(k) });
        let wild = combined(|k| 20.0 * brain(k));
        for lost in [flat, saturated, missing, wild] {
            assert!(lost < 0.95 * all, "{lost} of {all}");
        }
        for nothing in [0.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(combined(|_| nothing), 0.0);
        }
    }

    #[test]
    fn too_little_and_rates_that_are_none_are_errors() {
        assert!(Quality::of(&[1.0; 1023], RATE_HZ).is_err());
        for rate_hz in [0.0, 1e-9, 1e9, f64::NAN, f64::INFINITY] {
            assert!(Quality::of(&[1.0; 1024], rate_hz).is_err());
        }
    }
}
