use std::collections::VecDeque;
use std::ops::Range;

use super::{Recording, Span};
use crate::gaps::is_usable;

/// The samples of one quantity with their times, numbered from the first one.
///
/// Times ascend. Old samples can be dropped; the numbers of the others do not change.
#[derive(Clone, Debug)]
pub struct Track {
    rate_hz: f64,
    first: usize,
    at_ns: VecDeque<i64>,
    values: VecDeque<f64>,
    /// The running count of [usable](is_usable) samples, so that a window's coverage takes one subtraction;
    /// wraps at 2³².
    usable: VecDeque<u32>,
}

impl Track {
    /// An empty track for a rate [Hz].
    pub fn new(rate_hz: f64) -> Track {
        let (at_ns, values, usable) = (VecDeque::new(), VecDeque::new(), VecDeque::new());
        Track { rate_hz, first: 0, at_ns, values, usable }
    }

    /// A track of values at the sample times of a recording.
    pub fn of(recording: &Recording<'_>, values: Vec<f64>) -> Track {
        let at_ns = (0..values.len()).map(|sample| recording.time_ns(sample as f64)).collect();
        let mut count = 0;
        let up_to = |value: &f64| {
            count = one_more(count, *value);
            count
        };
        let usable = values.iter().map(up_to).collect();
        Track { rate_hz: recording.rate_hz, first: 0, at_ns, values: values.into(), usable }
    }

    /// Takes in the next sample.
    pub fn push(&mut self, at_ns: i64, value: f64) {
        self.at_ns.push_back(at_ns);
        self.values.push_back(value);
        let before = self.usable.back().copied().unwrap_or(0);
        self.usable.push_back(one_more(before, value));
    }

    /// The sampling rate [Hz].
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The range of indices of the samples still held, counted from the first sample ever.
    pub fn held(&self) -> Range<usize> {
        self.first..self.first + self.values.len()
    }

    /// The numbers of the samples in a span, as far as they are held.
    pub fn samples_in(&self, span: Span) -> Range<usize> {
        let place = |at_ns| self.first + self.at_ns.partition_point(|&each| each < at_ns);
        place(span.begin_ns)..place(span.end_ns.max(span.begin_ns))
    }

    /// The values of a span, as far as they are held.
    pub fn values_in(&self, span: Span) -> Vec<f64> {
        self.values(self.samples_in(span))
    }

    /// The values of samples, as far as they are held.
    pub fn values(&self, samples: Range<usize>) -> Vec<f64> {
        self.iter(samples).collect()
    }

    /// Iterates over the values of samples, as far as they are held.
    pub fn iter(&self, samples: Range<usize>) -> impl ExactSizeIterator<Item = f64> + '_ {
        let held = self.held();
        let begin = samples.start.clamp(held.start, held.end);
        let end = samples.end.clamp(begin, held.end);
        self.values.range(begin - self.first..end - self.first).copied()
    }

    /// The number of samples in the longest run that is not [usable](crate::gaps::is_usable), as far as they are held.
    pub fn longest_gap(&self, samples: Range<usize>) -> usize {
        let (mut run, mut longest) = (0, 0);
        for value in self.iter(samples) {
            run = if is_usable(value) { 0 } else { run + 1 };
            longest = longest.max(run);
        }
        longest
    }

    /// The time of a (fractional) sample position [ns], also slightly beyond the ends; `None` when no sample
    /// is held.
    pub fn time_ns(&self, sample: f64) -> Option<i64> {
        let last = self.at_ns.len().checked_sub(1)?;
        let place = (sample - self.first as f64).clamp(0.0, last as f64);
        let (whole, part) = (place.floor() as usize, sample - self.first as f64 - place.floor());
        let next = self.at_ns.get(whole + 1).filter(|_| part <= 1.0);
        let begin_ns = self.at_ns[whole];
        let step_ns = next.map_or(1e9 / self.rate_hz, |&next| next.saturating_sub(begin_ns) as f64);
        Some(begin_ns.saturating_add((part * step_ns).round() as i64))
    }

    /// The (fractional) sample position at a time [ns]; `None` outside what is held.
    pub fn sample_at(&self, at_ns: i64) -> Option<f64> {
        let after = self.at_ns.partition_point(|&each| each <= at_ns);
        let before = after.checked_sub(1)?;
        let begin_ns = self.at_ns[before];
        let part = match self.at_ns.get(after) {
            Some(&next) => {
                at_ns.saturating_sub(begin_ns) as f64 / (next.saturating_sub(begin_ns)) as f64
            }
            None if begin_ns == at_ns => 0.0,
            None => return None,
        };
        Some((self.first + before) as f64 + part)
    }

    /// The share of the samples of a span that are held and [usable](crate::gaps::is_usable) [0..1].
    pub fn coverage(&self, span: Span) -> f64 {
        let expected = (span.secs() * self.rate_hz).round().max(1.0);
        (self.usable_in(span) as f64 / expected).min(1.0)
    }

    /// The number of samples of a span that are held and [usable](crate::gaps::is_usable).
    pub fn usable_in(&self, span: Span) -> usize {
        let samples = self.samples_in(span);
        let (first, end) = (samples.start - self.first, samples.end - self.first);
        if first == end {
            return 0;
        }
        let after_first = self.usable[end - 1].wrapping_sub(self.usable[first]);
        after_first as usize + usize::from(is_usable(self.values[first]))
    }

    /// Drops the samples before a time [ns].
    pub fn forget(&mut self, before_ns: i64) {
        while self.at_ns.front().is_some_and(|&at_ns| at_ns < before_ns) {
            self.at_ns.pop_front();
            self.values.pop_front();
            self.usable.pop_front();
            self.first += 1;
        }
    }
}

fn one_more(count: u32, value: f64) -> u32 {
    count.wrapping_add(u32::from(is_usable(value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ten() -> Track {
        let mut track = Track::new(10.0);
        (0..10).for_each(|k| track.push(k * 100_000_000, k as f64));
        track
    }

    #[test]
    fn a_span_holds_its_beginning_and_not_its_end() {
        let span = Span { begin_ns: 200_000_000, end_ns: 500_000_000 };
        assert_eq!(ten().values_in(span), [2.0, 3.0, 4.0]);
        assert_eq!(ten().coverage(span), 1.0);
        assert_eq!(ten().coverage(Span { begin_ns: 0, end_ns: 2_000_000_000 }), 0.5);
    }

    #[test]
    fn numbers_stay_when_samples_are_let_go() {
        let mut track = ten();
        track.forget(350_000_000);
        assert_eq!(track.held(), 4..10);
        assert_eq!(track.values(0..6), [4.0, 5.0]);
        assert_eq!(track.time_ns(5.5), Some(550_000_000));
    }

    #[test]
    fn times_and_places_lie_between_samples_too() {
        let track = ten();
        assert_eq!(track.time_ns(2.25), Some(225_000_000));
        assert_eq!(track.time_ns(9.5), Some(950_000_000));
        assert_eq!(track.time_ns(-1.0), Some(-100_000_000));
        assert_eq!(track.sample_at(225_000_000), Some(2.25));
        assert_eq!(track.sample_at(900_000_000), Some(9.0));
        assert_eq!(track.sample_at(900_000_001), None);
        assert_eq!(Track::new(1.0).time_ns(0.0), None);
    }
}
