//! Glottal pulses: the moments at which the vocal folds close, whose periods and amplitudes are compared.

use super::frame::Glottal;
use super::sound::Sound;

/// The range in which the next pulse is searched for, in periods from the last one.
const NEXT: (f64, f64) = (0.8, 1.25);
/// Pulses whose surroundings have a lower correlation than this do not belong to one voice.
const LEAST_LIKENESS: f64 = 0.3;
/// Half the length of the window over which a pulse's amplitude is taken, in periods (as in Praat).
const AROUND: f64 = 0.2;
/// Periods whose ratio exceeds this are not compared (as in Praat).
const MOST_PERIODS_APART: f64 = 1.3;
/// Amplitudes whose ratio exceeds this are not compared (as in Praat).
const MOST_AMPLITUDES_APART: f64 = 1.6;

/// Tracks the pulses of a voice.
#[derive(Debug, Default)]
pub(super) struct Pulses {
    /// The position of the last pulse [samples], its amplitude, and the period before it [samples].
    last: Option<(f64, f64, Option<f64>)>,
}

impl Pulses {
    /// Searches for pulses up to the sample `end`, in a frame with this period [samples] around the sample
    /// `middle`; the period is `None` if the frame is unvoiced.
    pub(super) fn push(
        &mut self,
        sound: &Sound,
        (middle, end): (usize, usize),
        period: Option<f64>,
        rate_hz: f64,
    ) -> Glottal {
        let mut found = Glottal::default();
        let Some(period) = period else {
            self.last = None;
            return found;
        };
        if self.last.is_none() {
            let first = strongest(sound, middle as f64, period);
            self.last = first.and_then(|at| Some((at, amplitude(sound, at, period)?, None)));
        }
        while let Some((at, loudness, before)) = self.last.filter(|last| last.0 < end as f64) {
            let next = next_lag(sound, at, period);
            let next = next.and_then(|lag| Some((lag, amplitude(sound, at + lag, period)?)));
            let Some((lag, next_loudness)) = next else {
                self.last = None;
                break;
            };
            let period_ms = 1e3 / rate_hz;
            found.periods += 1.0;
            found.period_ms += lag * period_ms;
            found.amplitude += next_loudness;
            if let Some(before) = before.filter(|before| is_near(*before, lag, MOST_PERIODS_APART))
            {
                found.period_pairs += 1.0;
                found.period_change_ms += (lag - before).abs() * period_ms;
            }
            if is_near(loudness, next_loudness, MOST_AMPLITUDES_APART) {
                found.amplitude_pairs += 1.0;
                found.amplitude_change += (next_loudness - loudness).abs();
            }
            self.last = Some((at + lag, next_loudness, Some(lag)));
        }
        found
    }
}

fn is_near(one: f64, other: f64, most: f64) -> bool {
    one.max(other) < most * one.min(other)
}

/// The sample with the largest magnitude within a period around a position.
fn strongest(sound: &Sound, at: f64, period: f64) -> Option<f64> {
    let from = (at - period / 2.0).round() as i64;
    let samples = sound.get(from, from + period.round() as i64)?;
    let sizes = samples.iter().map(|sample| sample.abs()).enumerate();
    let (place, _) = sizes.max_by(|one, other| one.1.total_cmp(&other.1))?;
    Some((from + place as i64) as f64)
}

/// The distance from a pulse to the next [samples], at which the correlation of their surroundings is
/// highest.
fn next_lag(sound: &Sound, at: f64, period: f64) -> Option<f64> {
    let half = (period / 3.0).round() as i64;
    let at = at.round() as i64;
    let this = sound.get(at - half, at + half + 1)?;
    let (least, most) = ((NEXT.0 * period).floor() as i64, (NEXT.1 * period).ceil() as i64);
    let all = sound.get(at - half + least - 1, at + half + most + 2)?;
    let likeness = |lag: i64| {
        let place = (lag - least + 1) as usize;
        likeness(this, &all[place..place + this.len()])
    };
    let best = |best: (i64, f64), lag: i64| {
        let here = likeness(lag);
        if here > best.1 { (lag, here) } else { best }
    };
    let (lag, here) = (least..=most).fold((0, LEAST_LIKENESS), best);
    if lag == 0 {
        return None;
    }
    let (before, after) = (likeness(lag - 1), likeness(lag + 1));
    let curve = before - 2.0 * here + after;
    let aside = if curve < 0.0 { 0.5 * (before - after) / curve } else { 0.0 };
    Some(lag as f64 + aside.clamp(-0.5, 0.5))
}

/// The correlation of two stretches; 0 if a sample is missing, or for silence.
fn likeness(one: &[f64], other: &[f64]) -> f64 {
    let [mut product, mut of_one, mut of_other] = [0.0; 3];
    for (a, b) in one.iter().zip(other) {
        product += a * b;
        of_one += a * a;
        of_other += b * b;
    }
    let likeness = product / (of_one * of_other).sqrt();
    if likeness.is_finite() { likeness } else { 0.0 }
}

/// The root mean square around a pulse, weighted by a raised cosine.
fn amplitude(sound: &Sound, at: f64, period: f64) -> Option<f64> {
    let half = AROUND * period;
    let from = (at - half).ceil() as i64;
    let samples = sound.get(from, (at + half).floor() as i64 + 1)?;
    let [mut power, mut weights] = [0.0; 2];
    for (place, sample) in samples.iter().enumerate() {
        let aside = (from + place as i64) as f64 - at;
        let weight = 0.5 + 0.5 * (std::f64::consts::PI * aside / half).cos();
        (power, weights) = (power + weight * sample * sample, weights + weight);
    }
    Some((power / weights).sqrt()).filter(|amplitude| *amplitude > 0.0)
}
