//! Times without data.

use std::collections::VecDeque;

/// Holes closer together than this [ns] are merged: no interval fits between them.
const TOGETHER_NS: i64 = 300_000_000;

/// Times without data [ns], disjoint and in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Holes(VecDeque<(i64, i64)>);

impl Holes {
    pub(super) fn mark(&mut self, from_ns: i64, to_ns: i64) {
        if to_ns <= from_ns {
            return;
        }
        let (mut from_ns, mut to_ns) = (from_ns, to_ns);
        let near = |&(begin, end): &(i64, i64)| {
            end >= from_ns.saturating_sub(TOGETHER_NS) && begin <= to_ns.saturating_add(TOGETHER_NS)
        };
        let first = self.0.partition_point(|hole| hole.1 < from_ns.saturating_sub(TOGETHER_NS));
        let count = self.0.range(first..).take_while(|hole| near(hole)).count();
        for &(begin, end) in self.0.range(first..first + count) {
            (from_ns, to_ns) = (from_ns.min(begin), to_ns.max(end));
        }
        self.0.drain(first..first + count);
        self.0.insert(first, (from_ns, to_ns));
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        let before_ns = before_ns.saturating_sub(TOGETHER_NS);
        while self.0.front().is_some_and(|hole| hole.1 < before_ns) {
            self.0.pop_front();
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (i64, i64)> + '_ {
        self.0.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEC: i64 = 1_000_000_000;

    #[test]
    fn holes_that_touch_are_one() {
        let mut holes = Holes::default();
        for (from, to) in [(10, 11), (20, 21), (30, 31), (11, 20), (5, 5), (9, 7)] {
            holes.mark(from * SEC, to * SEC);
        }
        assert_eq!(holes.iter().collect::<Vec<_>>(), [(10 * SEC, 21 * SEC), (30 * SEC, 31 * SEC)]);
        holes.forget(22 * SEC);
        assert_eq!(holes.iter().count(), 1);
        holes.mark(i64::MIN, i64::MAX);
        assert_eq!(holes.iter().collect::<Vec<_>>(), [(i64::MIN, i64::MAX)]);
    }
}
