//! The mean cycle of a span, and evidence against its pulse rate.

use std::f64::consts::TAU;

use super::pulses::Shaped;
use super::smoothed::Part;
use crate::robust::{interpolated, median_in_place};

/// The number of points per cycle, from peak to peak.
const PLACES: usize = 24;
/// The fewest cycles for a mean.
const LEAST_CYCLES: usize = 5;

/// The probability by the similarity of cycles, when there is no other evidence against the rate.
const OF_LIKENESS: [(f64, f64); 5] =
    [(0.0, 0.0), (0.4, 0.25), (0.5, 0.75), (0.6, 0.95), (1.0, 0.99)];
/// A sine is not a pulse but aliased mains; a near-sine is hardly a pulse, and with other components it may
/// be footsteps.
const SINE: f64 = 0.03;
const HARDLY_A_PULSE: f64 = 0.09;
const ROUND: f64 = 0.29;
/// Where the harmonics are larger than this multiple of the fundamental, each cycle holds two pulses.
const TWO_PULSES: f64 = 2.0;
/// The latest diastolic wave [s]; a later crest is a missed weak pulse.
const LATEST_CREST_SECS: f64 = 0.46;
const CREST_HEIGHT: f64 = 0.08;
/// A residual this large may be a second rhythm.
const MOST_REST: f64 = 0.005;
/// Pulses as slow as this [s] may be every second one of a bigeminy.
const SLOW_SECS: f64 = 1.12;
/// Intervals that alternate more are a bigeminy or diastolic waves.
const MOST_ALTERNATION: f64 = 0.04;

/// The mean cycle, and its variation.
pub(super) struct Cycles {
    /// Second and third harmonic over the first: present in a pulse, zero in a sine.
    pub(super) harmonics: f64,
    /// The time of the mean cycle's second crest [s after the first], and its prominence [shares of the
    /// range]; 0 without one.
    pub(super) crest_secs: f64,
    pub(super) crest_height: f64,
    /// The share of power not explained by the mean cycle, scaled to each cycle.
    pub(super) rest: f64,
    /// The alternation of intervals between long and short [shares of the mean].
    pub(super) alternation: f64,
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
            secs: intervals.iter().sum(),
            usual_secs,
        })
    }

    /// The probability that the rate is correct within 10 %, given the similarity of cycles, calibrated on
    /// simulated signals of 16 kinds (`bench/signal/measure_unkind choosing`).
    pub(super) fn probability(&self, likeness: f64) -> f64 {
        let speaks_against = [
            (self.harmonics < SINE, 0.02),
            (self.harmonics > TWO_PULSES, 0.05),
            (self.harmonics < HARDLY_A_PULSE, 0.15),
            (self.crest_secs > LATEST_CREST_SECS && self.crest_height > CREST_HEIGHT, 0.2),
            (self.rest > MOST_REST && self.harmonics < ROUND, 0.63),
            (self.usual_secs > SLOW_SECS, 0.7),
            (self.alternation > MOST_ALTERNATION, 0.75),
            (self.rest > MOST_REST, 0.79),
        ];
        let most = speaks_against.iter().filter(|(speaks, _)| *speaks).map(|(_, most)| *most);
        most.fold(interpolated(&OF_LIKENESS, likeness), f64::min)
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

/// The amplitude of the alternating component of intervals: half the mean of second differences with
/// alternating signs.
fn alternation(intervals: &[f64]) -> f64 {
    let mean = intervals.iter().sum::<f64>() / intervals.len() as f64;
    let bends: Vec<f64> =
        intervals.windows(3).map(|three| (three[1] - three[0].midpoint(three[2])) / 2.0).collect();
    let turned = bends.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
    let share = turned as f64 / (bends.len().max(2) - 1) as f64;
    let size = bends.iter().map(|bend| bend.abs()).sum::<f64>() / bends.len().max(1) as f64;
    if share > 0.8 { size / mean } else { 0.0 }
}
