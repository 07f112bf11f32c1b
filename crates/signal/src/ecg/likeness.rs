//! The similarity of beats to those before them.

use super::recent::MEMORY;
use crate::gaps::is_usable;

/// The part of the cardiac cycle compared, before and after the R peak [s]: the QRS complex.
const BEFORE_SECS: f64 = 0.1;
const AFTER_SECS: f64 = 0.15;
/// How much of the end may be missing and is replaced by the last sample [s]: a beat late in the deflection by which it
/// is found, such as one after a pacemaker's spike, is reported before it is over.
const MISSING_SECS: f64 = 0.07;
/// The number of points at which beats are compared, 8 ms apart.
const PLACES: usize = 32;
const STEP_SECS: f64 = (BEFORE_SECS + AFTER_SECS) / (PLACES - 1) as f64;
/// The distance from both beats from which a missed one is searched for: this share of the interval, and at least this
/// long [s].
const ECHO_MARGIN: f64 = 0.33;
const ECHO_MARGIN_SECS: f64 = 0.15;
/// A beat is compared with the third most similar of those remembered: several beat morphologies may
/// alternate.
const ALIKE: usize = 3;

type Shape = [f64; PLACES];

/// The morphology of a beat relative to those before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Looks {
    /// The beat's similarity to others [0..1]; `None` for the first one.
    pub(super) likeness: Option<f64>,
    /// The height of the main deflection above its surroundings [unit of the signal].
    pub(super) deflection: f64,
    /// The peak-to-peak range of the beat [unit of the signal].
    pub(super) height: f64,
}

/// A deflection between two beats that may be a beat itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// The correlation of the echo's waveform with that of the beat [−1..1].
    pub(super) correlation: f64,
    /// The size of the echo as a share of the beat's (root of the sum of squares).
    pub(super) share: f64,
}

/// The newest beats, each detrended.
///
/// The similarity of two beats is 2·⟨a, b⟩ / (⟨a, a⟩ + ⟨b, b⟩): 1 for the same shape and height. For one shape
/// in noise it is the share of the shape in the total power, and so gives the signal-to-noise ratio around
/// beats (after Orphanidou et al. 2015, doi:10.1109/JBHI.2014.2338351, who correlate beats with their mean).
#[derive(Clone, Debug)]
pub(super) struct Likeness {
    rate_hz: f64,
    shapes: [Shape; MEMORY],
    count: usize,
    next: usize,
}

impl Likeness {
    pub(super) fn new(rate_hz: f64) -> Likeness {
        let shapes = [[0.0; PLACES]; MEMORY];
        Likeness { rate_hz, shapes, count: 0, next: 0 }
    }

    /// The highest deflection in the middle of the interval before the newest beat, compared with that beat;
    /// `None` where the interval is too short for one.
    pub(super) fn echo(&self, samples: &[f64], before: f64, beat: f64) -> Option<Echo> {
        let newest = &self.shapes[self.next.checked_sub(1).unwrap_or(MEMORY - 1)];
        let deflection = newest[(BEFORE_SECS / STEP_SECS).round() as usize];
        let margin = (ECHO_MARGIN * (beat - before)).max(ECHO_MARGIN_SECS * self.rate_hz);
        let (begin, end) = ((before + margin) as usize, (beat - margin).max(0.0) as usize);
        let middle = samples.get(begin..end)?;
        let height = |place: &usize| deflection * middle[*place];
        let highest = (0..middle.len()).max_by(|a, b| height(a).total_cmp(&height(b)))?;
        let shape = self.shape(samples, (begin + highest) as f64)?;
        let (here, there) = (product(&shape, &shape), product(newest, newest));
        let correlation = product(&shape, newest) / (here * there).sqrt();
        correlation.is_finite().then(|| Echo { correlation, share: (here / there).sqrt() })
    }

    /// Takes in the beat at `middle` of these samples; `None` when they do not reach far enough around it.
    pub(super) fn push(&mut self, samples: &[f64], middle: f64) -> Option<Looks> {
        let shape = self.shape(samples, middle)?;
        let deflection = shape[(BEFORE_SECS / STEP_SECS).round() as usize];
        let (low, high) = ends(&shape);
        let likeness = self.likeness(&shape);
        self.shapes[self.next] = shape;
        self.next = (self.next + 1) % MEMORY;
        self.count = (self.count + 1).min(MEMORY);
        Some(Looks { likeness, deflection, height: high - low })
    }

    /// The detrended waveform around a sample.
    fn shape(&self, samples: &[f64], middle: f64) -> Option<Shape> {
        let mut shape = [0.0; PLACES];
        let last = samples.len() as f64 - 3.0;
        let missing = middle + AFTER_SECS * self.rate_hz - last;
        let end = if missing <= MISSING_SECS * self.rate_hz { last } else { f64::INFINITY };
        for (index, value) in shape.iter_mut().enumerate() {
            let secs = index as f64 * STEP_SECS - BEFORE_SECS;
            *value = between(samples, (middle + secs * self.rate_hz).min(end))?;
        }
        without_line(&mut shape);
        Some(shape)
    }

    fn likeness(&self, shape: &Shape) -> Option<f64> {
        let mut values = [0.0; MEMORY];
        let values = &mut values[..self.count];
        for (value, other) in values.iter_mut().zip(&self.shapes) {
            let both = product(shape, shape) + product(other, other);
            *value = if both > 0.0 { 2.0 * product(shape, other) / both } else { 0.0 };
        }
        values.sort_unstable_by(|a, b| b.total_cmp(a));
        Some(values.get(ALIKE - 1).or(values.last())?.clamp(0.0, 1.0))
    }
}

/// The value at a fractional position, by Catmull–Rom interpolation.
fn between(samples: &[f64], place: f64) -> Option<f64> {
    let begin = place.floor();
    let first = (begin >= 1.0).then(|| begin as usize - 1)?;
    let points = samples.get(first..first.checked_add(4)?)?;
    let &[before, left, right, after] = points else { return None };
    let part = place - begin;
    let cubic = 3.0 * (left - right) + after - before;
    let square = 2.0 * before - 5.0 * left + 4.0 * right - after;
    let value = left + 0.5 * part * (right - before + part * (square + part * cubic));
    points.iter().all(|&each| is_usable(each)).then_some(value)
}

/// Subtracts the least-squares line.
fn without_line(shape: &mut Shape) {
    let place = |index: usize| index as f64 - (PLACES - 1) as f64 / 2.0;
    let mean = shape.iter().sum::<f64>() / PLACES as f64;
    let tilt: f64 = shape.iter().enumerate().map(|(index, value)| place(index) * value).sum();
    let squares: f64 = (0..PLACES).map(|index| place(index).powi(2)).sum();
    for (index, value) in shape.iter_mut().enumerate() {
        *value -= mean + tilt / squares * place(index);
    }
}

fn ends(shape: &Shape) -> (f64, f64) {
    shape.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
        (value.min(low), value.max(high))
    })
}

fn product(left: &Shape, right: &Shape) -> f64 {
    left.iter().zip(right).map(|(left, right)| left * right).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beat_that_is_reported_before_it_is_over_looks_like_others() {
        let rate_hz = 250.0;
        let beat = |k: usize| (-((k as f64 - 100.0) / 4.0).powi(2) / 2.0).exp();
        let samples: Vec<f64> = (0..200).map(beat).collect();
        let mut likeness = Likeness::new(rate_hz);
        for end in [200, 200, 200, 130, 125] {
            let looks = likeness.push(&samples[..end], 100.0).expect("most of it is there");
            assert!(looks.likeness.is_none_or(|likeness| likeness > 0.99), "{end}: {looks:?}");
        }
        assert_eq!(likeness.push(&samples[..115], 100.0), None);
    }
}
