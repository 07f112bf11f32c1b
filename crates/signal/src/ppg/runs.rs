//! Missing, flat and saturated stretches of a signal.

use std::collections::VecDeque;
use std::ops::Range;

use crate::gaps::is_usable;

/// A signal constant for longer is flat [s].
const FLAT_SECS: f64 = 0.2;
/// A signal at its maximum or minimum for longer is saturated [s].
const SATURATED_SECS: f64 = 0.08;

/// A run of samples that are equal, or all missing.
#[derive(Clone, Debug)]
struct Run {
    samples: Range<usize>,
    value: f64,
}

impl Run {
    fn goes_on_with(&self, value: f64) -> bool {
        let is_same = self.value.total_cmp(&value).is_eq();
        is_same || !(is_usable(self.value) || is_usable(value))
    }

    fn within(&self, samples: &Range<usize>) -> Range<usize> {
        self.samples.start.max(samples.start)..self.samples.end.min(samples.end)
    }
}

/// The runs of a signal as it arrives: missing samples, and runs that may be too long.
#[derive(Clone, Debug)]
pub(super) struct Runs {
    longest_flat: usize,
    longest_saturated: usize,
    kept: VecDeque<Run>,
    newest: Run,
}

impl Runs {
    pub(super) fn new(rate_hz: f64) -> Runs {
        let most = |secs: f64| (secs * rate_hz).ceil().max(3.0) as usize;
        Runs {
            longest_flat: most(FLAT_SECS),
            longest_saturated: most(SATURATED_SECS),
            kept: VecDeque::new(),
            newest: Run { samples: 0..0, value: f64::NAN },
        }
    }

    /// The runs of a whole signal.
    pub(super) fn of(signal: &[f64], rate_hz: f64) -> Runs {
        let mut runs = Runs::new(rate_hz);
        for &value in signal {
            runs.push(value);
        }
        runs
    }

    pub(super) fn push(&mut self, value: f64) {
        let end = self.newest.samples.end;
        if !self.newest.goes_on_with(value) {
            let newest = std::mem::replace(&mut self.newest, Run { samples: end..end, value });
            if self.gives(&newest) {
                self.kept.push_back(newest);
            }
        }
        self.newest.samples.end = end + 1;
    }

    fn gives(&self, run: &Run) -> bool {
        !is_usable(run.value) || run.samples.len() > self.longest_saturated
    }

    /// Drops the runs before a sample.
    pub(super) fn forget(&mut self, before: usize) {
        while self.kept.front().is_some_and(|run| run.samples.end <= before) {
            self.kept.pop_front();
        }
    }

    /// Finds which of these samples are alive, given their values and the runs.
    pub(super) fn living(
        &self,
        samples: Range<usize>,
        values: impl Iterator<Item = f64>,
    ) -> Living {
        let begin = self.kept.partition_point(|run| run.samples.end <= samples.start);
        let inside = self.kept.range(begin..).chain([&self.newest]).filter(|run| self.gives(run));
        let inside = inside.map(|run| (run.value, run.within(&samples)));
        let inside: Vec<_> = inside.filter(|(_, part)| !part.is_empty()).collect();
        let is_dead =
            |value: f64, part: &Range<usize>| !is_usable(value) || part.len() > self.longest_flat;
        let may_be_saturated = |value: f64, part: &Range<usize>| {
            is_usable(value) && part.len() > self.longest_saturated
        };
        let any = inside.iter().any(|(value, part)| may_be_saturated(*value, part));
        let ends = if any { ends(values) } else { [f64::NAN; 2] };
        let is_saturated = |value: f64, part: &Range<usize>| {
            may_be_saturated(value, part) && ends.iter().any(|end| end.total_cmp(&value).is_eq())
        };
        let those = |which: &dyn Fn(f64, &Range<usize>) -> bool| {
            let those = inside.iter().filter(|(value, part)| which(*value, part));
            those.map(|(_, part)| part.clone()).collect()
        };
        Living { dead: those(&is_dead), saturated: those(&is_saturated), samples }
    }
}

/// The smallest and the largest usable value.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let usable = values.filter(|&value| is_usable(value));
    usable.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, greatest], value| {
        [least.min(value), greatest.max(value)]
    })
}

/// Which samples of a span are usable and not flat, and which are saturated.
pub(super) struct Living {
    pub(super) samples: Range<usize>,
    /// Ranges of dead samples, in order.
    dead: Vec<Range<usize>>,
    saturated: Vec<Range<usize>>,
}

impl Living {
    /// The share of the samples in a range that are usable and not flat.
    pub(super) fn share(&self, begin: f64, end: f64) -> f64 {
        let samples = self.places(begin, end);
        let dead: usize = overlaps(&self.dead, &samples).sum();
        (samples.len() - dead) as f64 / samples.len().max(1) as f64
    }

    pub(super) fn is_saturated(&self, begin: f64, end: f64) -> bool {
        overlaps(&self.saturated, &self.places(begin, end)).next().is_some()
    }

    fn places(&self, begin: f64, end: f64) -> Range<usize> {
        let place =
            |at: f64| (at.round().max(0.0) as usize).clamp(self.samples.start, self.samples.end);
        place(begin)..place(end).max(place(begin))
    }
}

/// The number of samples by which each range overlaps another one.
fn overlaps(parts: &[Range<usize>], samples: &Range<usize>) -> impl Iterator<Item = usize> {
    let first = parts.partition_point(|part| part.end <= samples.start);
    let near = parts[first..].iter().take_while(|part| part.start < samples.end);
    let overlap = |part: &Range<usize>| {
        part.end.min(samples.end).saturating_sub(part.start.max(samples.start))
    };
    near.map(overlap).filter(|&count| count > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_or_flat_does_not_live() {
        let signal: Vec<f64> = (0..100)
            .map(|k| if (20..30).contains(&k) { f64::NAN } else { f64::from(k.max(40)) })
            .collect();
        let living = Runs::of(&signal, 20.0).living(0..100, signal.iter().copied());
        // The lowest value stays for more than 3 samples, before the gap and after it.
        assert_eq!(living.share(0.0, 100.0), 0.59);
        assert_eq!(living.share(10.0, 45.0), 4.0 / 35.0);
        assert_eq!(living.share(50.0, 90.0), 1.0);
        assert!(living.is_saturated(35.0, 60.0) && !living.is_saturated(41.0, 60.0));
        assert!(!living.is_saturated(20.0, 30.0));
    }

    #[test]
    fn only_what_lies_in_the_span_counts() {
        let signal: Vec<f64> = (0..50).map(|k| f64::from(k.max(10))).collect();
        let runs = Runs::of(&signal, 20.0);
        assert_eq!(runs.living(8..50, signal[8..].iter().copied()).share(8.0, 50.0), 1.0);
        assert_eq!(runs.living(5..50, signal[5..].iter().copied()).share(0.0, 50.0), 39.0 / 45.0);
    }
}
