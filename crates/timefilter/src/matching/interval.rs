//! The time span of a set's stamps.

use std::hint::select_unpredictable;

/// The interval from the oldest to the newest stamp, with one stamp per topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Interval {
    pub start: i64,
    pub end: i64,
    /// The first topic with the oldest stamp.
    pub first: usize,
    /// The last topic with the newest stamp.
    pub last: usize,
}

impl Interval {
    #[inline]
    pub fn of(stamps: &[i64]) -> Interval {
        let (start, first) = oldest(stamps);
        let (mut end, mut last) = (i64::MIN, 0);
        for (topic, &stamp) in stamps.iter().enumerate() {
            let is_newer = stamp >= end;
            end = select_unpredictable(is_newer, stamp, end);
            last = select_unpredictable(is_newer, topic, last);
        }
        Interval { start, end, first, last }
    }

    /// The interval after the stamp of its first topic has changed.
    #[inline]
    pub fn without_its_first(self, stamps: &[i64]) -> Interval {
        if self.first == self.last {
            return Interval::of(stamps);
        }
        let changed = stamps[self.first];
        let is_newest = (changed, self.first) > (self.end, self.last);
        let (start, first) = oldest(stamps);
        Interval {
            start,
            end: select_unpredictable(is_newest, changed, self.end),
            first,
            last: select_unpredictable(is_newest, self.first, self.last),
        }
    }
}

/// The oldest stamp, and the first topic with it.
#[inline]
fn oldest(stamps: &[i64]) -> (i64, usize) {
    let (mut start, mut first) = (i64::MAX, 0);
    for (topic, &stamp) in stamps.iter().enumerate() {
        let is_older = stamp < start;
        start = select_unpredictable(is_older, stamp, start);
        first = select_unpredictable(is_older, topic, first);
    }
    (start, first)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_interval_is_kept_up_as_it_is_found(
            mut stamps in prop::collection::vec(0..8_i64, 1..10),
            changes in prop::collection::vec(0..16_i64, 0..20),
        ) {
            let mut interval = Interval::of(&stamps);
            for change in changes {
                stamps[interval.first] = change;
                interval = interval.without_its_first(&stamps);
                prop_assert_eq!(interval, Interval::of(&stamps));
                prop_assert_eq!(Some(&interval.start), stamps.iter().min());
                prop_assert_eq!(Some(&interval.end), stamps.iter().max());
                let first = stamps.iter().position(|&stamp| stamp == interval.start);
                let last = stamps.iter().rposition(|&stamp| stamp == interval.end);
                prop_assert_eq!((first, last), (Some(interval.first), Some(interval.last)));
            }
        }
    }
}
