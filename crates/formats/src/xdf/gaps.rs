//! Gaps in evenly sampled stamps that jitter.

use std::collections::VecDeque;

/// The span of the stamps that are compared before and after a place [s], and their minimum number.
const AROUND_SECS: f64 = 2.0;
const FEWEST: usize = 20;
/// The number of periods between two stamps from which a sample may be missing.
const STEP_PERIODS: f64 = 1.5;
/// After a gap, all later stamps are late by more than this many periods plus this many times the usual jitter.
const LATE_PERIODS: f64 = 0.5;
const LATE_JITTERS: f64 = 4.0;

/// The indices of the stamps before which samples are missing. If stamps are only delayed, later stamps catch up; after
/// a gap they stay late.
pub(super) fn gaps(stamps_secs: &[f64], rate_hz: f64) -> Vec<usize> {
    let width = ((AROUND_SECS * rate_hz) as usize).max(FEWEST);
    let Some(period_secs) = period_secs(stamps_secs, width) else { return Vec::new() };
    // How late each stamp is, relative to the others.
    let late: Vec<f64> =
        stamps_secs.iter().enumerate().map(|(at, secs)| secs - at as f64 * period_secs).collect();
    let after = least_from_here(&late, width);
    let jitter_secs = median(late.iter().zip(&after).map(|(late, least)| late - least));
    let limit_secs = LATE_PERIODS * period_secs + LATE_JITTERS * jitter_secs.unwrap_or_default();

    let (mut found, mut before) = (Vec::new(), Least::new(width));
    for at in 0..late.len() {
        let is_late = before.least().is_some_and(|before| after[at] - before > limit_secs);
        let steps = at > 0 && stamps_secs[at] - stamps_secs[at - 1] > STEP_PERIODS * period_secs;
        let is_known = before.count >= FEWEST && late.len() - at >= FEWEST;
        if is_known && steps && is_late {
            found.push(at);
            before = Least::new(width);
        }
        before.push(late[at]);
    }
    found
}

/// The usual period [s], from pairs of stamps `width` samples apart, most of which have no gap in between.
fn period_secs(stamps_secs: &[f64], width: usize) -> Option<f64> {
    let lag = width.min(stamps_secs.len() / 4);
    if lag < FEWEST / 4 {
        return None;
    }
    let spans = stamps_secs.iter().zip(&stamps_secs[lag..]);
    let period_secs = median(spans.map(|(first, last)| (last - first) / lag as f64))?;
    (period_secs > 0.0).then_some(period_secs)
}

fn median(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    let middle = numbers.len() / 2;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// For each number, the minimum of `width` numbers starting with it.
fn least_from_here(numbers: &[f64], width: usize) -> Vec<f64> {
    let mut least = Least::new(width);
    let backwards = numbers.iter().rev().map(|number| {
        least.push(*number);
        least.least().unwrap_or(*number)
    });
    let mut found: Vec<f64> = backwards.collect();
    found.reverse();
    found
}

/// The minimum of the newest `width` numbers.
struct Least {
    width: usize,
    count: usize,
    /// The numbers that may still become the minimum, in increasing order, each with its index.
    candidates: VecDeque<(usize, f64)>,
}

impl Least {
    fn new(width: usize) -> Least {
        Least { width, count: 0, candidates: VecDeque::new() }
    }

    fn push(&mut self, number: f64) {
        while self.candidates.back().is_some_and(|last| last.1 >= number) {
            self.candidates.pop_back();
        }
        self.candidates.push_back((self.count, number));
        self.count += 1;
        while self.candidates.front().is_some_and(|first| first.0 + self.width < self.count) {
            self.candidates.pop_front();
        }
    }

    fn least(&self) -> Option<f64> {
        self.candidates.front().map(|first| first.1)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers between 0 and 1 that look random.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(2).wrapping_add(1);
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        }
    }

    /// 60 s of stamps, of which some are missing, each delayed by up to so much [s].
    fn stamps(rate_hz: f64, missing: &[std::ops::Range<usize>], jitter_secs: f64) -> Vec<f64> {
        let mut noise = noise(7);
        let count = (60.0 * rate_hz) as usize;
        let there = (0..count).filter(|at| !missing.iter().any(|gap| gap.contains(at)));
        there.map(|at| 100.0 + at as f64 / (rate_hz * 1.0004) + jitter_secs * noise()).collect()
    }

    #[test]
    fn missing_samples_are_found_also_beside_jitter() {
        for (jitter_periods, fewest) in [(0.0, 1), (0.2, 2), (1.0, 5), (4.0, 15)] {
            for rate_hz in [32.0, 128.0, 1000.0] {
                let jitter_secs = jitter_periods / rate_hz;
                let gap = 500..500 + fewest;
                assert_eq!(
                    gaps(&stamps(rate_hz, &[gap], jitter_secs), rate_hz),
                    [500],
                    "{rate_hz} Hz"
                );
            }
        }
        let two = [300..330, 900..1000];
        assert_eq!(gaps(&stamps(100.0, &two, 0.004), 100.0), [300, 870]);
    }

    #[test]
    fn stamps_that_are_only_late_are_no_gap() {
        for rate_hz in [16.0, 128.0, 1000.0] {
            for jitter_periods in [0.0, 0.3, 2.0, 20.0] {
                let found = gaps(&stamps(rate_hz, &[], jitter_periods / rate_hz), rate_hz);
                assert_eq!(found, [0; 0], "{rate_hz} Hz");
            }
            // Held up for 0.7 s, and then sent at once.
            let mut held = stamps(rate_hz, &[], 0.0);
            let from = held.len() / 2;
            let until = held[from] + 0.7;
            held.iter_mut().skip(from).for_each(|stamp| *stamp = stamp.max(until));
            assert_eq!(gaps(&held, rate_hz), [0; 0], "{rate_hz} Hz");
        }
        // In pieces of 50 samples that have the time of their last one.
        let pieces: Vec<f64> = (0..6000).map(|at| f64::from(at / 50 + 1) * 0.5).collect();
        assert_eq!(gaps(&pieces, 100.0), [0; 0]);
    }

    proptest! {
        #[test]
        fn any_stamps_are_cut_in_order(
            stamps in prop::collection::vec(prop_oneof![0.0..100.0, Just(1e9), Just(-1e9)], 0..300),
            rate_hz in 0.001..1e5,
        ) {
            let found = gaps(&stamps, rate_hz);
            prop_assert!(found.is_sorted() && found.iter().all(|at| (1..stamps.len()).contains(at)));
        }
    }
}
