//! The store of an analysed ECG, which can be queried for any span.

use std::collections::VecDeque;

use super::company::is_in_company;
use super::doubt::Doubt;
use super::likeness::{Echo, Looks};
use super::pieces::Piece;
use super::quality::Parts;
use super::settle::looked_at_again;
use super::signs::Signs;
use super::silence::Silence;
use super::steepness::Steepness;
use super::values;
use crate::analysis::{LEAST_COVERAGE, Measured, Reason, Span, Track, Value, Windows};
use crate::hrv::HeartWindows;
use crate::respiration::derived::{Beat, BreathingWindows};
use crate::robust::median_in_place;

/// A longer time without a beat is silence [s]: 20 beats a minute.
pub(super) const LONGEST_SECS: f64 = 3.0;
/// The longest pause of the heart while the signal is present [s].
pub(super) const LONGEST_PAUSE_SECS: f64 = 8.0;
/// The shortest gap that may hide a beat when the interval is a multiple of the usual one.
const HIDING_PART_SECS: f64 = 0.02;
const HIDING_CYCLES: f64 = 1.4;
const USUAL_BEATS: usize = 12;
/// The shortest gap that may always hide a beat [s].
pub(super) const HIDING_SECS: f64 = 0.1;
/// The smallest probability of the rate for which it is reported.
const LEAST_PROBABILITY: f64 = 0.4;
/// The smallest signal quality at which the times of beats are exact enough for their variability.
const LEAST_QUALITY: f64 = 0.4;
/// The probability of the rate if the beats are of two rhythms: the rate is that of one of them if the other is seldom
/// seen.
const OF_COMPANY: f64 = 0.5;
/// The number of values of the rate itself.
const RATES: usize = 4;

/// A beat, with all that is needed to analyse a span.
#[derive(Clone, Copy, Debug)]
pub(super) struct WindowBeat {
    pub(super) at_ns: i64,
    /// The interval from the beat before [ms]; `None` for the first beat, or if another beat may be hidden in between.
    pub(super) rr_ms: Option<f64>,
    /// The morphology of the beat, if it could be examined.
    pub(super) looks: Option<Looks>,
    /// The peak-to-peak range between this beat and the one before, where neither has waves [unit of the
    /// signal].
    pub(super) between: Option<f64>,
    /// A possible missed beat in between.
    pub(super) echo: Option<Echo>,
    /// The slopes of the beat, if it could be examined.
    pub(super) steepness: Option<Steepness>,
}

pub(super) struct EcgWindows {
    values: Vec<Value>,
    heart: HeartWindows,
    breathing: BreathingWindows,
    pub(super) track: Track,
    pub(super) beats: VecDeque<WindowBeat>,
    pub(super) pieces: VecDeque<Piece>,
}

impl EcgWindows {
    /// Creates a store; `how` states how beats were detected, causally or as a whole.
    pub(super) fn new(rate_hz: f64, how: &'static str, heart: HeartWindows) -> EcgWindows {
        let values = [values::of_signal(how), heart.values().to_vec()].concat();
        EcgWindows {
            values,
            heart,
            breathing: BreathingWindows::default(),
            track: Track::new(rate_hz),
            beats: VecDeque::new(),
            pieces: VecDeque::new(),
        }
    }

    /// The interval between two successive beats [ms].
    pub(super) fn interval_ms(&self, before: f64, beat: f64) -> Option<f64> {
        let (begin_ns, end_ns) = (self.track.time_ns(before)?, self.track.time_ns(beat)?);
        let interval_ms = end_ns.saturating_sub(begin_ns) as f64 / 1e6;
        if !(0.0..=LONGEST_PAUSE_SECS * 1e3).contains(&interval_ms) {
            return None;
        }
        let is_long = self.usual_ms().is_some_and(|usual| interval_ms > HIDING_CYCLES * usual);
        let hiding_secs = if is_long { HIDING_PART_SECS } else { HIDING_SECS };
        let hiding = (hiding_secs * self.track.rate_hz()) as usize;
        let longest = self.track.longest_gap(before as usize..beat as usize);
        (longest <= hiding).then_some(interval_ms)
    }

    /// The median of the newest intervals [ms].
    fn usual_ms(&self) -> Option<f64> {
        let newest = self.beats.iter().rev().take(USUAL_BEATS).filter_map(|beat| beat.rr_ms);
        let mut values = [0.0; USUAL_BEATS];
        let count = values.iter_mut().zip(newest).map(|(place, rr_ms)| *place = rr_ms).count();
        median_in_place(&mut values[..count])
    }

    pub(super) fn push(&mut self, beat: WindowBeat) {
        self.beats.push_back(beat);
        self.heart.push(beat.at_ns);
    }

    /// Records a gap in the data [ns].
    pub(super) fn mark_gap(&mut self, (from_ns, to_ns): (i64, i64)) {
        self.heart.mark_gap(from_ns, to_ns);
    }

    pub(super) fn forget(&mut self, before_ns: i64, kept_secs: f64) {
        let newest_ns = self.track.time_ns(self.track.held().end as f64).unwrap_or(before_ns);
        let before_ns = before_ns.min(newest_ns.saturating_sub((kept_secs * 1e9) as i64));
        self.track.forget(before_ns);
        self.heart.forget(before_ns);
        while self.beats.front().is_some_and(|beat| beat.at_ns < before_ns) {
            self.beats.pop_front();
        }
        while self.pieces.front().is_some_and(|piece| piece.begin_ns < before_ns) {
            self.pieces.pop_front();
        }
    }

    fn beats_in(&self, span: Span) -> Vec<WindowBeat> {
        self.beats.iter().copied().filter(|beat| span.holds(beat.at_ns)).collect()
    }

    /// The times of the beats before and after a span [ns].
    fn outside_ns(&self, span: Span) -> [Option<i64>; 2] {
        let after = self.beats.partition_point(|beat| beat.at_ns < span.end_ns);
        let first = self.beats.partition_point(|beat| beat.at_ns < span.begin_ns);
        let at = |place: usize| self.beats.get(place).map(|beat| beat.at_ns);
        [first.checked_sub(1).and_then(at), at(after)]
    }

    fn pieces_in(&self, span: Span) -> Vec<Piece> {
        let is_inside =
            |piece: &Piece| piece.begin_ns >= span.begin_ns && piece.end_ns <= span.end_ns;
        self.pieces.iter().copied().filter(is_inside).collect()
    }
}

impl Windows for EcgWindows {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        self.measure_after(span, None)
    }

    fn measure_again(&self, span: Span, last: &Measured) -> Measured {
        self.measure_after(span, Some(last))
    }
}

impl EcgWindows {
    /// Measures a span, reusing the expensive values of the heart rate from `last`.
    fn measure_after(&self, span: Span, last: Option<&Measured>) -> Measured {
        let coverage = self.track.coverage(span);
        if coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, 0.0, self.values.len(), Reason::Gap);
        }
        let (mut beats, pieces) = (self.beats_in(span), self.pieces_in(span));
        let silence = Silence::judge(&self.track, &mut beats, span, self.outside_ns(span));
        let signs = Signs::of(&pieces);
        let silent = silent_share(&beats, span);
        let living = signs.map_or(1.0, |signs| 1.0 - signs.flat - signs.saturated);
        // Missing data count once, as coverage; flat data have no beats either.
        let silent_there = (silent - (1.0 - coverage)).max(0.0) / coverage;
        let living = living.max(0.0).min(1.0 - silent_there);
        let quality = quality(&beats, &pieces, 1.0);
        let is_poor = quality * living < LEAST_QUALITY;
        let doubt = Doubt::of(&beats, signs, span);
        let probability = doubt.probability(quality, living);
        let quality = looked_at_again(probability, &doubt, silence, &beats);
        let quality = if is_in_company(&beats) { quality.min(OF_COMPANY) } else { quality };
        let mut values = rates(&beats, span).to_vec();
        values.push(self.breathing_rate(&beats, span));
        values.extend(self.heart.measure_after(span, last).values);
        if span.secs() > LONGEST_SECS {
            if quality < LEAST_PROBABILITY {
                values.fill(Err(Reason::Quality));
            } else if is_poor {
                values[RATES..].fill(Err(Reason::Quality));
            }
        }
        let of_signal = [&[Ok(quality)][..], &Signs::values(signs), &[Ok(silent)]].concat();
        values.splice(values::OF_BEATS..values::OF_BEATS, of_signal);
        Measured { coverage, quality, values }
    }

    /// The breathing rate [1/min], from the times and heights of beats.
    fn breathing_rate(&self, beats: &[WindowBeat], span: Span) -> Result<f64, Reason> {
        let beat = |beat: &WindowBeat| {
            let height = beat.looks.map_or(f64::NAN, |looks| looks.height);
            Beat { at_ns: beat.at_ns, heights: [height, f64::NAN] }
        };
        Ok(self.breathing.measure(beats.iter().map(beat), span)?.rate_per_min.value)
    }
}

/// Mean, lowest, highest rate and its standard deviation [1/min].
fn rates(beats: &[WindowBeat], span: Span) -> [Result<f64, Reason>; 4] {
    let inside = |beat: &&WindowBeat| {
        beat.rr_ms
            .is_some_and(|rr_ms| beat.at_ns as f64 - rr_ms * 1e6 >= span.begin_ns as f64 - 1.0)
    };
    let intervals_ms: Vec<f64> =
        beats.iter().filter(inside).filter_map(|beat| beat.rr_ms).collect();
    let count = intervals_ms.len() as f64;
    if intervals_ms.is_empty() {
        return [Err(Reason::Short); 4];
    }
    let rates: Vec<f64> = intervals_ms.iter().map(|rr_ms| 60_000.0 / rr_ms).collect();
    let mean = 60_000.0 * count / intervals_ms.iter().sum::<f64>();
    let average = rates.iter().sum::<f64>() / count;
    let squares: f64 = rates.iter().map(|rate| (rate - average).powi(2)).sum();
    let deviation =
        if count < 2.0 { Err(Reason::Short) } else { Ok((squares / (count - 1.0)).sqrt()) };
    let lowest = rates.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = rates.iter().copied().fold(0.0, f64::max);
    [Ok(mean), Ok(lowest), Ok(highest), deviation]
}

/// The quality as of [`super::quality()`]; for spans shorter than a segment, from beats alone.
fn quality(beats: &[WindowBeat], pieces: &[Piece], living: f64) -> f64 {
    let looks = beats.iter().filter_map(|beat| beat.looks);
    let mut heights: Vec<f64> = looks.clone().map(|looks| looks.height).collect();
    let likenesses: Vec<f64> = looks.filter_map(|looks| looks.likeness).collect();
    let mut between: Vec<f64> = pieces.iter().map(|piece| piece.between).collect();
    let between = median_in_place(&mut between).unwrap_or(0.0);
    let likeness = likenesses.iter().sum::<f64>() / likenesses.len() as f64;
    median_in_place(&mut heights)
        .map_or(0.0, |height| Parts { likeness, between: between / height, living }.quality())
}

/// The share of a span in stretches of more than 3 s without a beat.
fn silent_share(beats: &[WindowBeat], span: Span) -> f64 {
    let ends_ns = std::iter::once(span.begin_ns)
        .chain(beats.iter().map(|beat| beat.at_ns))
        .chain([span.end_ns]);
    let ends_ns: Vec<i64> = ends_ns.collect();
    let stretches = ends_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0]) as f64 / 1e9);
    let silent: f64 = stretches.filter(|&secs| secs > LONGEST_SECS).sum();
    if span.secs() > 0.0 { (silent / span.secs()).clamp(0.0, 1.0) } else { 0.0 }
}
