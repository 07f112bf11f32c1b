//! Causal smoothing.

use std::ops::Range;

use super::smooth::Smoothing;
use crate::gaps::is_usable;
use crate::history::History;

/// The newest part of a signal, gaps interpolated linearly, smoothed as soon as enough samples have arrived.
///
/// Indices count samples from the first one.
#[derive(Clone, Debug)]
pub(super) struct Smoothed {
    rate_hz: f64,
    smoothing: Smoothing,
    bridged: History,
    last: f64,
    /// The number of samples missing since the last usable value.
    missing: usize,
    /// The index of the first value held.
    first: usize,
    values: Vec<f64>,
}

impl Smoothed {
    pub(super) fn new(rate_hz: f64) -> Smoothed {
        let smoothing = Smoothing::new(rate_hz);
        Smoothed {
            rate_hz,
            bridged: History::new(2 * smoothing.reach() + 1),
            smoothing,
            last: f64::NAN,
            missing: 0,
            first: 0,
            values: Vec::new(),
        }
    }

    /// A whole signal; empty without a usable value.
    pub(super) fn of(signal: &[f64], rate_hz: f64) -> Smoothed {
        let mut smoothed = Smoothed::new(rate_hz);
        for &value in signal {
            smoothed.push(value);
        }
        // The signal is extended by its last value.
        let beyond = smoothed.missing + smoothed.smoothing.reach();
        let last = smoothed.last;
        for _ in 0..if last.is_nan() { 0 } else { beyond } {
            smoothed.take(last);
        }
        smoothed
    }

    /// Takes in the next sample.
    pub(super) fn push(&mut self, value: f64) {
        if !is_usable(value) {
            self.missing += 1;
            return;
        }
        let missing = std::mem::take(&mut self.missing);
        let begin = if self.last.is_nan() { value } else { self.last };
        for step in 1..=missing {
            self.take(begin + (value - begin) * (step as f64 / (missing + 1) as f64));
        }
        self.take(value);
        self.last = value;
    }

    fn take(&mut self, value: f64) {
        self.bridged.push(value);
        let (count, reach) = (self.bridged.count, self.smoothing.reach() as i64);
        if count > reach {
            let around = self.bridged.at(count - 2 * reach - 1..count);
            self.values.push(self.smoothing.at(around));
        }
    }

    /// Drops the values before a sample, now or later.
    pub(super) fn forget(&mut self, before: usize) {
        let unneeded = before.saturating_sub(self.first).min(self.values.len());
        if 2 * unneeded > self.values.len() {
            self.values.drain(..unneeded);
            self.first += unneeded;
        }
    }

    pub(super) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The indices of the samples held.
    pub(super) fn held(&self) -> Range<usize> {
        self.first..self.first + self.values.len()
    }

    /// The part of the signal with these samples, as far as known.
    pub(super) fn part(&self, samples: Range<usize>) -> Part<'_> {
        let held = self.held();
        let place = |sample: usize| sample.clamp(held.start, held.end) - held.start;
        let (begin, end) = (place(samples.start), place(samples.end.max(samples.start)));
        Part { begin: held.start + begin, values: &self.values[begin..end] }
    }
}

/// A part of the signal.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    /// The index of the part's first sample.
    pub(super) begin: usize,
    pub(super) values: &'a [f64],
}

impl<'a> Part<'a> {
    /// The values of samples, as far as they lie in the part.
    pub(super) fn values(&self, samples: Range<usize>) -> &'a [f64] {
        let place = |sample: usize| sample.saturating_sub(self.begin).min(self.values.len());
        &self.values[place(samples.start)..place(samples.end.max(samples.start))]
    }

    /// The largest absolute step between samples in a range.
    pub(super) fn steepest(&self, begin: f64, end: f64) -> f64 {
        let place = |at: f64| at.round().max(0.0) as usize;
        let steps = self.values(place(begin)..place(end)).windows(2);
        steps.map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaps::bridged;

    #[test]
    fn what_is_smoothed_as_it_comes_in_is_what_is_smoothed_at_once() {
        let missing = [0..3, 40..47, 195..200];
        let value = |k: usize| {
            if missing.iter().any(|gap| gap.contains(&k)) { f64::NAN } else { (k * k % 17) as f64 }
        };
        let signal: Vec<f64> = (0..200).map(value).collect();
        let at_once = Smoothing::new(100.0).smoothed(&bridged(&signal).unwrap());
        let smoothed = Smoothed::of(&signal, 100.0);
        assert_eq!(smoothed.held(), 0..200);
        for (place, value) in at_once.iter().enumerate() {
            assert_eq!(smoothed.part(place..place + 1).values, [*value], "{place}");
        }
        let mut newest = smoothed.clone();
        newest.forget(150);
        assert_eq!(newest.part(150..180).values, smoothed.part(150..180).values);
        assert_eq!(newest.part(0..180).begin, 150);
    }

    #[test]
    fn nothing_is_smoothed_without_a_usable_value() {
        assert!(Smoothed::of(&[f64::NAN; 30], 100.0).held().is_empty());
        assert!(Smoothed::of(&[], 100.0).held().is_empty());
    }
}
