//! ECG quality in segments of a few seconds.

use std::collections::VecDeque;

use super::bands::Bands;
use super::history::History;
use super::recent::Recent;
use crate::gaps::is_usable;

/// The length and the hop of segments [s]: long enough for a band from 0 to 1 Hz and a beat or two.
pub(super) const PIECE_SECS: f64 = 4.0;
pub(super) const STEP_SECS: f64 = 2.0;
/// The longest time that a signal may stay constant before it is flat [s].
const FLAT_SECS: f64 = 0.2;
/// The longest time at the end of the range before the signal is saturated [s].
const SATURATED_SECS: f64 = 0.03;
/// A range above this many usual ones (the median of the newest segments) is motion.
const MOTION_RANGES: f64 = 2.5;
/// Baseline wander above this share of the power is motion, too.
const MOTION_WANDER: f64 = 0.8;

/// A segment of an ECG; shares lie between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) begin_ns: i64,
    pub(super) end_ns: i64,
    /// The share of flat samples.
    pub(super) flat: f64,
    /// The share of samples at the end of the range so far.
    pub(super) saturated: f64,
    /// Whether the person or an electrode moved.
    pub(super) moved: bool,
    /// The median absolute clean signal: the level between beats [unit of the signal].
    pub(super) between: f64,
    /// Kurtosis of the clean signal; NaN for a constant signal, like the next two.
    pub(super) kurtosis: f64,
    /// The power at 5–15 Hz over that at 5–40 Hz.
    pub(super) qrs_share: f64,
    /// The power at 0–1 Hz over that at 0–40 Hz.
    pub(super) base_share: f64,
}

/// Cuts a signal into segments, sample by sample; segments less than half usable are dropped.
#[derive(Clone)]
pub(super) struct Pieces {
    rate_hz: f64,
    length: usize,
    step: usize,
    raw: History,
    held: History,
    clean: History,
    at_ns: VecDeque<i64>,
    until_next: usize,
    lowest: f64,
    highest: f64,
    ranges: Recent,
    bands: Bands,
    sizes: Vec<f64>,
}

impl Pieces {
    pub(super) fn new(rate_hz: f64) -> Pieces {
        let length = (PIECE_SECS * rate_hz).round() as usize;
        Pieces {
            rate_hz,
            length,
            step: (STEP_SECS * rate_hz).round() as usize,
            raw: History::new(length),
            held: History::new(length),
            clean: History::new(length),
            at_ns: VecDeque::with_capacity(length + 1),
            until_next: length,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            ranges: Recent::default(),
            bands: Bands::new(rate_hz, length),
            sizes: Vec::with_capacity(length),
        }
    }

    /// Takes in a sample, raw and clean; returns the segment that ends with it.
    pub(super) fn push(&mut self, at_ns: i64, sample: f64, clean: f64) -> Option<Piece> {
        if is_usable(sample) {
            self.lowest = self.lowest.min(sample);
            self.highest = self.highest.max(sample);
        }
        let before = self.held.newest(1).first().copied().unwrap_or(0.0);
        self.raw.push(sample);
        self.held.push(if is_usable(sample) { sample } else { before });
        self.clean.push(if is_usable(clean) { clean } else { 0.0 });
        self.at_ns.push_back(at_ns);
        if self.at_ns.len() > self.length {
            self.at_ns.pop_front();
        }
        self.until_next -= 1;
        if self.until_next > 0 {
            return None;
        }
        self.until_next = self.step;
        self.piece()
    }

    fn piece(&mut self) -> Option<Piece> {
        let raw = self.raw.newest(self.length);
        let count = self.length as f64;
        let usable = raw.iter().filter(|&&sample| is_usable(sample)).count() as f64;
        let (begin_ns, last_ns) = (*self.at_ns.front()?, *self.at_ns.back()?);
        if usable < count / 2.0 {
            return None;
        }
        let (flat, saturated) = self.unmoving();
        let clean = self.clean.newest(self.length);
        let (kurtosis, range) = (kurtosis(clean), range(clean));
        let [base, qrs, fast, all] = self.bands.powers(self.held.newest(self.length));
        let base_share = base / all;
        let usual = self.ranges.median().unwrap_or(range);
        self.ranges.push(range);
        let moved = range > MOTION_RANGES * usual || base_share > MOTION_WANDER;
        Some(Piece {
            begin_ns,
            end_ns: last_ns.saturating_add((1e9 / self.rate_hz) as i64),
            flat: flat as f64 / count,
            saturated: saturated as f64 / count,
            moved,
            between: self.between(),
            kurtosis,
            qrs_share: qrs / fast,
            base_share,
        })
    }

    fn between(&mut self) -> f64 {
        self.sizes.clear();
        self.sizes.extend(self.clean.newest(self.length).iter().map(|value| value.abs()));
        let middle = self.length / 2;
        *self.sizes.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// The numbers of flat and of saturated samples.
    fn unmoving(&self) -> (usize, usize) {
        let longest = |secs: f64| ((secs * self.rate_hz) as usize).max(2);
        let (flat, saturated) = (longest(FLAT_SECS), longest(SATURATED_SECS));
        let varies = self.highest > self.lowest;
        let is_end = |value: f64| varies && (value >= self.highest || value <= self.lowest);
        let runs = self.raw.newest(self.length).chunk_by(|a, b| a.total_cmp(b).is_eq());
        let runs = runs.filter(|run| is_usable(run[0]));
        runs.fold((0, 0), |(flats, ends), run| match run.len() {
            length if length > saturated && is_end(run[0]) => (flats, ends + length),
            length if length > flat => (flats + length, ends),
            _ => (flats, ends),
        })
    }
}

/// The fourth moment over the square of the second: 3 for a normal distribution.
fn kurtosis(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let (second, fourth) = values.iter().fold((0.0, 0.0), |(second, fourth), value| {
        let square = (value - mean).powi(2);
        (second + square, fourth + square * square)
    });
    count * fourth / (second * second)
}

fn range(values: &[f64]) -> f64 {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.iter().fold(ends, |(low, high), &v| (v.min(low), v.max(high)));
    high - low
}
