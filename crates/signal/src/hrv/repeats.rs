//! Intervals that a device repeats: no heart beats so evenly.

use std::collections::VecDeque;

use crate::analysis::Span;

/// This many equal intervals in a row are those of a device that repeats its last one, or counts too coarsely to
/// distinguish them. For hearts that vary by 3 ms, a device that counts in steps of 1 ms does not report four equal
/// intervals in a row.
const LEAST_EQUAL: usize = 16;

/// Stretches of equal intervals.
#[derive(Clone, Debug, Default)]
pub(super) struct Repeats {
    stretches_ns: VecDeque<(i64, i64)>,
    last_ns: Option<i64>,
    begin_ns: i64,
    count: usize,
}

impl Repeats {
    /// Takes in an interval and the time at which it ends [ns].
    pub(super) fn push(&mut self, end_ns: i64, interval_ns: i64) {
        if self.last_ns != Some(interval_ns) {
            (self.last_ns, self.count) = (Some(interval_ns), 0);
            self.begin_ns = end_ns.saturating_sub(interval_ns);
        }
        self.count += 1;
        let stretch = (self.begin_ns, end_ns);
        match self.stretches_ns.back_mut() {
            Some(last) if self.count > LEAST_EQUAL => *last = stretch,
            _ if self.count >= LEAST_EQUAL => self.stretches_ns.push_back(stretch),
            _ => {}
        }
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        // The newest may still grow.
        while self.stretches_ns.len() > 1
            && self.stretches_ns.front().is_some_and(|(_, end_ns)| *end_ns < before_ns)
        {
            self.stretches_ns.pop_front();
        }
    }

    /// The share of a span in stretches of equal intervals [0..1].
    pub(super) fn share(&self, span: Span) -> f64 {
        let inside = |&(begin_ns, end_ns): &(i64, i64)| {
            let (begin_ns, end_ns) = (begin_ns.max(span.begin_ns), end_ns.min(span.end_ns));
            end_ns.saturating_sub(begin_ns).max(0) as f64 / 1e9
        };
        let secs: f64 = self.stretches_ns.iter().map(inside).sum();
        if span.secs() > 0.0 { (secs / span.secs()).min(1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// The share of equal intervals in a minute of intervals.
    fn share(interval_ms: impl Fn(i64) -> i64) -> f64 {
        let mut repeats = Repeats::default();
        let mut end_ns = 0;
        for k in 0..75 {
            end_ns += interval_ms(k) * MS;
            repeats.push(end_ns, interval_ms(k) * MS);
        }
        repeats.share(Span { begin_ns: 0, end_ns })
    }

    #[test]
    fn equal_intervals_are_those_of_a_device() {
        assert!(share(|_| 800) > 0.99);
        let half = share(|k| if k < 40 { 800 + k % 3 } else { 800 });
        assert!((half - 0.47).abs() < 0.02, "{half}");
    }

    #[test]
    fn some_equal_intervals_in_a_row_are_those_of_a_heart() {
        assert!(share(|k| 800 + k / 12) < 1e-9);
    }

    #[test]
    fn what_is_long_ago_is_forgotten() {
        let mut repeats = Repeats::default();
        for k in 1..200 {
            repeats.push(k * 800 * MS, (if k % 40 < 20 { 800 } else { 700 + k }) * MS);
        }
        assert!(repeats.stretches_ns.len() > 3);
        repeats.forget(200 * 800 * MS);
        assert_eq!(repeats.stretches_ns.len(), 1);
    }
}
