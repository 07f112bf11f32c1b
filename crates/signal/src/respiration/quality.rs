//! Signal quality of breathing.

use super::Breath;
use super::band;
use super::cusps::sharpness;
use super::extra::extra_share;
use super::grouping::Grouping;
use super::pattern::mean;
use super::recurrence::recurrence;
use super::rival::{alone, falls};
use super::spectral::Spectral;
use super::uncounted::uncounted_share;
use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, mad, median};
use crate::spectrum::Transforms;

/// A signal constant for longer is flat [s]; at its minimum or maximum, saturated.
const FLAT_SECS: f64 = 3.0;
const SATURATED_SECS: f64 = 0.3;
/// A breath this many times higher or lower than the median is motion or a false detection.
const UNUSUAL_FACTOR: f64 = 4.0;
/// The shares of power around the breathing rate with and without a clear rhythm: a random walk has 0.2.
const RHYTHM: f64 = 0.68;
const NO_RHYTHM: f64 = 0.5;
/// The recurrence of breaths with and without a clear rhythm.
const RECURRING: f64 = 0.85;
const NOT_RECURRING: f64 = 0.45;
/// The share of uncounted rises up to which the rate is not in doubt, and the share from which on the true rate may be
/// a different one: a rate is right within a tenth, and several breaths may hide in one rise.
const UNCOUNTED: (f64, f64) = (0.03, 0.15);
/// The share of breaths that may be heartbeats, up to which the rate is not in doubt, and from which it may be wrong.
const EXTRA: (f64, f64) = (0.05, 0.1);
/// How much sharper than peaks troughs may be without raising doubt, and how much sharper they are in a folded signal.
const FOLDED: (f64, f64) = (0.45, 0.6);
/// The highest quality without a rhythm.
const MOST_WITHOUT_RHYTHM: f64 = 0.29;
/// The number of points of a breath's shape.
const SHAPE_LENGTH: usize = 32;

/// Signal quality from 0 (useless) to 1 (nothing but equal breaths).
///
/// (breathing share · similarity · regularity)^⅓ · rhythm · covered share · living share, where
/// - the breathing share is the share of 0.05–1 Hz in the total power above 0.05 Hz (Welch, 30 s);
/// - similarity is the mean correlation of breaths with the median breath, each stretched to the same
///   length, and not below 0 (as in Charlton et al. 2021, doi:10.1016/j.bspc.2020.102339);
/// - regularity is 1 / (1 + v²), with v = 1.4826 · MAD / median of the durations;
/// - rhythm is the smallest of several factors from 0 to 1, since a random walk has breaths but no rhythm
///   (it lowers the quality to no less than 0.29):
///   - it rises from 0 to 1 as the share of the power at 0.05–1 Hz that lies within 35 % of the mean breathing
///     rate, or of twice that rate, rises from 0.5 to 0.68;
///   - it rises from 0 to 1 as the autocorrelation of the signal's slope (over 0.32 s) at the mean duration of a
///     breath exceeds that at half of this duration by 0.45 to 0.85;
///   - it falls from 1 to 0 as a second rhythm in the spectrum, such as motion or the heart, becomes stronger: a
///     slower line from 0.3 to 0.8 of the power of the counted rhythm (if more than 24 breaths a minute are counted,
///     which may be steps, from 0.03 to 0.1, and from 0.003 to 0.01 for a line with most of the slower power), and a
///     faster line that is not a harmonic from 0.15 to 0.45;
///   - it falls from 1 to 0 as the rate of the strongest line differs from the counted rate by 15 to 40 %;
///   - it falls from 1 to 0 as smaller rises between the counted breaths increase from 3 to 15 % of all rises, such as
///     shallow breaths after deep ones, or speech;
///   - it falls from 1 to 0 as the share of breaths with less than half of the median duration and of the median
///     amplitude increases from 5 to 10 %: these may be beats of a slow heart between slow breaths;
///   - it falls from 1 to 0 as troughs become sharper than peaks, by 0.45 to 0.6: a belt that is stretched in both
///     directions shows two rises per breath;
/// - the covered share is the share of time in breaths with an amplitude between a quarter and four times
///   the median, without motion and sensor dropouts;
/// - the living share is the share of samples that are usable, not flat (constant for more than 3 s) and
///   not saturated (at the minimum or maximum for more than 0.3 s).
///
/// `breaths` are the breaths of the signal. Fewer than two give 0. `None` without a signal or for a rate outside 5 to
/// 2000 Hz. Use it to compare windows of one person and sensor: speech lowers it, although it is not a fault.
pub fn quality(signal: &[f64], rate_hz: f64, breaths: &[Breath]) -> Option<f64> {
    band::band(rate_hz).ok().filter(|_| !signal.is_empty())?;
    let grouping = Grouping::new(rate_hz);
    let placed: Vec<Breath> = breaths.iter().map(|breath| grouping.placed(breath)).collect();
    let rate_hz = rate_hz / grouping.length() as f64;
    let means = grouping.all(signal);
    Some(of_means(&means, rate_hz, &placed, Spectral::of(&means, rate_hz, &Transforms::default())))
}

/// The quality of group means, with breaths at the working rate.
pub(super) fn of_means(
    means: &[f64],
    rate_hz: f64,
    breaths: &[Breath],
    spectral: Option<Spectral>,
) -> f64 {
    let length = means.len() as f64;
    let is_inside =
        |breath: &&Breath| breath.begin >= 0.0 && breath.end < length && breath.begin < breath.end;
    let whole: Vec<&Breath> = breaths.iter().filter(is_inside).collect();
    let Some(spectral) = spectral.filter(|_| whole.len() >= 2) else { return 0.0 };
    let durations: Vec<f64> = whole.iter().map(|breath| breath.duration()).collect();
    let product = spectral.breathing_share * likeness(means, &whole) * regularity(&durations);
    let rhythm = mean(&durations).recip() * rate_hz * 60.0;
    let from_to = |value: f64, from: f64, to: f64| ((value - from) / (to - from)).clamp(0.0, 1.0);
    let kept = from_to(spectral.rhythm_share(rhythm), NO_RHYTHM, RHYTHM).min(from_to(
        recurrence(means, rate_hz, mean(&durations) / rate_hz),
        NOT_RECURRING,
        RECURRING,
    ));
    let uncounted = uncounted_share(means, rate_hz, &whole);
    let folded = falls(sharpness(means, &whole), FOLDED);
    let counted = falls(uncounted, UNCOUNTED).min(falls(extra_share(&whole), EXTRA));
    let kept = kept.min(alone(&spectral, rhythm)).min(counted).min(folded);
    let quality = product.cbrt() * covered_share(breaths, length) * living_share(means, rate_hz);
    let quality = (kept * quality).max(quality.min(MOST_WITHOUT_RHYTHM));
    if quality.is_finite() { quality.clamp(0.0, 1.0) } else { 0.0 }
}

fn regularity(durations: &[f64]) -> f64 {
    let spread = mad(durations).zip(median(durations)).map(|(mad, median)| mad / median);
    1.0 / (1.0 + (SIGMA_FROM_MAD * spread.unwrap_or(f64::INFINITY)).powi(2))
}

fn covered_share(breaths: &[Breath], length: f64) -> f64 {
    let amplitudes: Vec<f64> = breaths.iter().map(|breath| breath.amplitude).collect();
    let usual = median(&amplitudes).unwrap_or(f64::NAN);
    let is_usual = |breath: &&Breath| {
        (usual / UNUSUAL_FACTOR..=usual * UNUSUAL_FACTOR).contains(&breath.amplitude)
    };
    let covered = breaths.iter().filter(is_usual).map(|breath| breath.overlap(&(0.0..length)));
    (covered.sum::<f64>() / length).min(1.0)
}

/// The mean correlation of breaths with the median breath.
fn likeness(means: &[f64], breaths: &[&Breath]) -> f64 {
    let shapes: Vec<Vec<f64>> = breaths.iter().map(|breath| shape(means, breath)).collect();
    let at = |place: usize| shapes.iter().map(|shape| shape[place]).collect::<Vec<f64>>();
    let usual: Vec<f64> = (0..SHAPE_LENGTH).map(|k| median(&at(k)).unwrap_or(0.0)).collect();
    let correlations = shapes.iter().map(|shape| correlation(shape, &usual).max(0.0));
    mean(&correlations.collect::<Vec<f64>>())
}

/// The breath detrended by the line between its ends, at evenly spaced points; missing values are 0.
fn shape(means: &[f64], breath: &Breath) -> Vec<f64> {
    let at = |place: f64| {
        let (before, share) = (place.floor() as usize, place - place.floor());
        let (low, high) = (means[before], means[(before + 1).min(means.len() - 1)]);
        low + (high - low) * share
    };
    let (begin, end) = (at(breath.begin), at(breath.end));
    let height = |k: usize| {
        let share = (k as f64 + 0.5) / SHAPE_LENGTH as f64;
        let above = at(breath.begin + share * breath.duration()) - (begin + (end - begin) * share);
        if is_usable(above) { above } else { 0.0 }
    };
    (0..SHAPE_LENGTH).map(height).collect()
}

/// Pearson's correlation; 0 where one is constant.
fn correlation(left: &[f64], right: &[f64]) -> f64 {
    let (left_mean, right_mean) = (mean(left), mean(right));
    let pairs = || left.iter().zip(right).map(|(l, r)| (l - left_mean, r - right_mean));
    let products: f64 = pairs().map(|(l, r)| l * r).sum();
    let squares = pairs().fold((0.0, 0.0), |sum, (l, r)| (sum.0 + l * l, sum.1 + r * r));
    let scale = squares.0.sqrt() * squares.1.sqrt();
    if scale > 0.0 && scale.is_finite() { products / scale } else { 0.0 }
}

/// The share of values that are usable, not flat and not saturated.
fn living_share(means: &[f64], rate_hz: f64) -> f64 {
    let usable = || means.iter().copied().filter(|&value| is_usable(value));
    let least = usable().fold(f64::INFINITY, f64::min);
    let greatest = usable().fold(f64::NEG_INFINITY, f64::max);
    let longest = |value: f64| {
        let is_end = value.total_cmp(&least).is_eq() || value.total_cmp(&greatest).is_eq();
        rate_hz * if is_end { SATURATED_SECS } else { FLAT_SECS }
    };
    let is_same = |a: &f64, b: &f64| a.total_cmp(b).is_eq() || !(is_usable(*a) || is_usable(*b));
    let runs = means.chunk_by(is_same).filter(|run| is_usable(run[0]));
    let living = runs.filter(|run| run.len() as f64 <= longest(run[0]));
    living.map(<[f64]>::len).sum::<usize>() as f64 / means.len() as f64
}
