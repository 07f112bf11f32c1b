//! Candidate pulses: blocks in which the signal's short-term power exceeds its average over a beat.

use super::level::Level;
use crate::history::History;
use crate::sliding::{Fold, Sum};

/// The duration of a systolic peak, and of a beat [s] (Elgendi et al. 2013).
const PEAK_SECS: f64 = 0.111;
const BEAT_SECS: f64 = 0.667;
/// The margin by which the short average must exceed the long one, as a share of the usual power.
const OFFSET: f64 = 0.02;
/// The longest block [s].
const LONGEST_SECS: f64 = 1.0;

/// A candidate pulse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// The position of the maximum of the band-passed signal [samples].
    pub(super) place: i64,
    /// The value of that maximum, positive.
    pub(super) height: f64,
    /// Whether the block was as long as a systolic peak.
    pub(super) is_broad: bool,
}

/// Finds blocks in a band-passed signal that arrives sample by sample.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    band: History,
    /// Squares not yet in the short average, whose window lags.
    squares: History,
    peak: Fold<Sum>,
    beat: Fold<Sum>,
    level: Level,
    peak_half: i64,
    beat_half: i64,
    longest: i64,
    begin: Option<i64>,
    is_reported: bool,
}

impl Blocks {
    pub(super) fn new(rate_hz: f64) -> Blocks {
        let half = |secs: f64| (secs * rate_hz / 2.0).round().max(1.0) as i64;
        let (peak_half, beat_half) = (half(PEAK_SECS), half(BEAT_SECS).max(half(PEAK_SECS) + 1));
        let longest = 2 * half(LONGEST_SECS);
        Blocks {
            band: History::new((longest + beat_half + 2) as usize),
            squares: History::new((beat_half + 2) as usize),
            peak: Fold::new((2 * peak_half + 1) as usize),
            beat: Fold::new((2 * beat_half + 1) as usize),
            level: Level::new(rate_hz),
            peak_half,
            beat_half,
            longest,
            begin: None,
            is_reported: false,
        }
    }

    /// The number of samples needed after a position to judge it.
    pub(super) fn lag(&self) -> i64 {
        self.beat_half
    }

    /// Takes in the next sample of the band-passed signal.
    pub(super) fn push(&mut self, sample: f64) -> Option<Candidate> {
        let square = sample.max(0.0).powi(2);
        self.band.push(sample);
        self.squares.push(square);
        self.level.push(square);
        self.beat.push(Sum(square));
        let newest = self.band.count - 1;
        let behind = newest - (self.beat_half - self.peak_half);
        let square_behind = self.squares.at(behind..behind + 1).first().filter(|_| behind >= 0);
        self.peak.push(Sum(square_behind.copied().unwrap_or(0.0)));
        let place = newest - self.beat_half;
        if place < 0 { None } else { self.judge(place, newest) }
    }

    fn judge(&mut self, place: i64, newest: i64) -> Option<Candidate> {
        let peak = self.peak.merged().0 / (2 * self.peak_half + 1) as f64;
        let beat = self.beat.merged().0 / (2 * self.beat_half + 1) as f64;
        let is_in_block = peak > beat + OFFSET * self.level.usual();
        if !is_in_block {
            let begin = self.begin.take()?;
            let is_new = !std::mem::take(&mut self.is_reported);
            let is_long = place - begin > self.peak_half;
            let highest = (is_new && is_long).then(|| self.highest(begin, place))?;
            return highest.map(|highest| Candidate { is_broad: false, ..highest });
        }
        let begin = *self.begin.get_or_insert(place);
        if self.is_reported || place - begin < 2 * self.peak_half {
            return None;
        }
        // The following samples are known: a maximum that is not exceeded before the signal falls below its mean again
        // is the maximum of the block.
        let begin = begin.max(place - self.longest);
        let rest = self.band.at(place + 1..newest + 1).iter().take_while(|&&value| value > 0.0);
        let end = place + 1 + rest.count() as i64;
        let candidate = self.highest(begin, end).filter(|highest| highest.place <= place)?;
        self.is_reported = true;
        Some(candidate)
    }

    /// The first maximum within a range.
    fn highest(&self, begin: i64, end: i64) -> Option<Candidate> {
        let begin = begin.max(end - self.longest);
        let values = self.band.at(begin..end).iter().copied();
        let candidates = (begin..).zip(values);
        let candidates =
            candidates.map(|(place, height)| Candidate { place, height, is_broad: true });
        candidates.filter(|candidate| candidate.height > 0.0).reduce(|highest, candidate| {
            if candidate.height > highest.height { candidate } else { highest }
        })
    }
}
