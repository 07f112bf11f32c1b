//! The mean cycle of a span.

use std::f64::consts::TAU;

use super::pulses::Shaped;
use super::smoothed::Part;
use super::train::{alternate, bends, mean_size};
use crate::robust::median_in_place;

/// The number of points per cycle, from peak to peak.
const PLACES: usize = 24;
/// The fewest cycles for a mean.
const LEAST_CYCLES: usize = 5;
/// [Bends](bends) of intervals alternate if more than this share has the opposite sign of the one before.
const ALTERNATING: f64 = 0.8;

/// The mean cycle, and its variation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cycles {
    /// The second and third harmonic over the first: present in a pulse, zero in a sine.
    pub(super) harmonics: f64,
    /// The time of the mean cycle's second crest [s after the first], and the prominence of that crest as a share of
    /// the range; 0 without one.
    pub(super) crest_secs: f64,
    pub(super) crest_height: f64,
    /// The share of power not explained by the mean cycle, scaled to each cycle.
    pub(super) rest: f64,
    /// The alternation of intervals between long and short, as a share of the mean.
    pub(super) alternation: f64,
    /// The mean deviation of intervals from their mean, as a share of it.
    pub(super) variation: f64,
    /// The total duration [s].
    pub(super) secs: f64,
    /// The median interval [s].
    pub(super) usual_secs: f64,
}

impl Cycles {
    /// The cycles between neighbouring pulses; `None` with too few.
    pub(super) fn of(
        signal: &Part<'_>,
        pairs: &[(&Shaped, &Shaped)],
        rate_hz: f64,
    ) -> Option<Cycles> {
        let cycles: Vec<[f64; PLACES]> =
            pairs.iter().filter_map(|(one, other)| cycle(signal, one, other)).collect();
        if cycles.len() < LEAST_CYCLES {
            return None;
        }
        let mut mean = [0.0; PLACES];
        for cycle in &cycles {
            let size = size(cycle);
            mean.iter_mut()
                .zip(cycle)
                .for_each(|(mean, value)| *mean += value / size.max(f64::MIN_POSITIVE));
        }
        let secs =
            |(one, other): &(&Shaped, &Shaped)| (other.pulse.sample - one.pulse.sample) / rate_hz;
        let intervals: Vec<f64> = pairs.iter().map(secs).collect();
        let usual_secs = median_in_place(&mut intervals.clone())?;
        let (crest_place, crest_height) = crest(&mean);
        Some(Cycles {
            harmonics: harmonic(&mean, 2).hypot(harmonic(&mean, 3)) / harmonic(&mean, 1),
            crest_secs: crest_place * usual_secs,
            crest_height,
            rest: rest(&cycles, &mean),
            alternation: alternation(&intervals),
            variation: variation(&intervals),
            secs: intervals.iter().sum(),
            usual_secs,
        })
    }
}

/// A cycle from peak to peak, detrended by the line between them, with mean 0.
fn cycle(signal: &Part<'_>, one: &Shaped, other: &Shaped) -> Option<[f64; PLACES]> {
    let (begin, end) = (one.pulse.sample, other.pulse.sample);
    let samples = signal.values(begin as usize..end as usize + 2);
    if samples.len() < 6 {
        return None;
    }
    let step = (end - begin) / PLACES as f64;
    let at = |index: usize| {
        let place = begin.fract() + index as f64 * step;
        let left = (place as usize).min(samples.len() - 2);
        samples[left] + (samples[left + 1] - samples[left]) * (place - left as f64).min(1.0)
    };
    let slope = (at(PLACES) - at(0)) / PLACES as f64;
    let mut values: [f64; PLACES] = std::array::from_fn(|index| at(index) - slope * index as f64);
    let mean = values.iter().sum::<f64>() / PLACES as f64;
    for value in &mut values {
        *value -= mean;
    }
    (size(&values) > 0.0 && size(&values).is_finite()).then_some(values)
}

fn size(values: &[f64; PLACES]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

fn harmonic(mean: &[f64; PLACES], number: usize) -> f64 {
    let (mut cosine, mut sine) = (0.0, 0.0);
    for (place, value) in mean.iter().enumerate() {
        let angle = TAU * (number * place) as f64 / PLACES as f64;
        cosine += value * angle.cos();
        sine += value * angle.sin();
    }
    cosine.hypot(sine)
}

/// The position [share of a cycle] and the prominence of the second crest.
fn crest(mean: &[f64; PLACES]) -> (f64, f64) {
    let low = mean.iter().copied().fold(f64::INFINITY, f64::min);
    let high = mean.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut best = (0.0, 0.0);
    for place in 3..PLACES - 2 {
        if mean[place] < mean[place - 1] || mean[place] < mean[place + 1] {
            continue;
        }
        let before = mean[..place].iter().copied().fold(f64::INFINITY, f64::min);
        let after = mean[place..].iter().copied().fold(f64::INFINITY, f64::min);
        let height = (mean[place] - before.max(after)) / (high - low);
        if height > best.1 {
            best = (place as f64 / PLACES as f64, height);
        }
    }
    best
}

fn rest(cycles: &[[f64; PLACES]], mean: &[f64; PLACES]) -> f64 {
    let squares = mean.iter().map(|value| value * value).sum::<f64>();
    let (mut left, mut all) = (0.0, 0.0);
    for cycle in cycles {
        let both: f64 = cycle.iter().zip(mean).map(|(value, mean)| value * mean).sum();
        let power = size(cycle).powi(2);
        // Each cycle has the same weight, whatever its amplitude.
        left += 1.0 - both * both / (squares * power);
        all += 1.0;
    }
    left / all
}

/// The mean deviation of intervals from their mean, as a share of it.
fn variation(intervals: &[f64]) -> f64 {
    let mean = mean_size(intervals);
    let deviations: Vec<f64> = intervals.iter().map(|interval| interval - mean).collect();
    mean_size(&deviations) / mean
}

/// The amplitude of the alternating component of intervals, as a share of the mean; 0 if they do not alternate.
fn alternation(intervals: &[f64]) -> f64 {
    let bends = bends(intervals);
    if alternate(&bends) > ALTERNATING { mean_size(&bends) / mean_size(intervals) } else { 0.0 }
}
