//! The samples of a stream that are still needed.

use std::collections::VecDeque;
use std::ops::Range;

use crate::analysis::Span;
use crate::gaps::is_usable;

/// Samples of several channels in order of time.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    at_ns: VecDeque<i64>,
    channels: Vec<VecDeque<f64>>,
}

impl Kept {
    pub(super) fn new(channels: usize) -> Kept {
        Kept { at_ns: VecDeque::new(), channels: vec![VecDeque::new(); channels] }
    }

    /// The number of channels.
    pub(super) fn width(&self) -> usize {
        self.channels.len()
    }

    /// Inserts a sample in order of time, after others of the same time; missing or unusable numbers become
    /// NaN.
    pub(super) fn insert(&mut self, at_ns: i64, numbers: &[f64]) {
        let is_newest = self.at_ns.back().is_none_or(|newest_ns| *newest_ns <= at_ns);
        let place = if is_newest { self.at_ns.len() } else { self.place(at_ns.saturating_add(1)) };
        make_room(&mut self.at_ns);
        self.at_ns.insert(place, at_ns);
        for (index, channel) in self.channels.iter_mut().enumerate() {
            make_room(channel);
            channel.insert(place, numbers.get(index).map_or(f64::NAN, |number| usable(*number)));
        }
    }

    /// The indices of the samples in a span.
    pub(super) fn places(&self, span: Span) -> Range<usize> {
        self.place(span.begin_ns)..self.place(span.end_ns.max(span.begin_ns))
    }

    pub(super) fn times_ns(&self, places: Range<usize>) -> impl Iterator<Item = i64> + Clone + '_ {
        self.at_ns.range(places).copied()
    }

    pub(super) fn values(
        &self,
        channel: usize,
        places: Range<usize>,
    ) -> impl Iterator<Item = f64> + Clone + '_ {
        self.channels[channel].range(places).copied()
    }

    /// The values of a channel, each with its time after `origin_ns` [s].
    pub(super) fn points(
        &self,
        channel: usize,
        places: Range<usize>,
        origin_ns: i64,
    ) -> impl Iterator<Item = (f64, f64)> + Clone + '_ {
        let secs = move |at_ns: i64| at_ns.saturating_sub(origin_ns) as f64 / 1e9;
        self.times_ns(places.clone()).map(secs).zip(self.values(channel, places))
    }

    /// Drops the samples before a time [ns].
    pub(super) fn forget(&mut self, before_ns: i64) {
        let gone = self.place(before_ns);
        let_go(&mut self.at_ns, gone);
        self.channels.iter_mut().for_each(|channel| let_go(channel, gone));
    }

    /// The number of samples before a time [ns].
    fn place(&self, at_ns: i64) -> usize {
        self.at_ns.partition_point(|each| *each < at_ns)
    }
}

/// Reserves room for one more sample, without doubling: a sliding window hardly grows.
fn make_room<T>(samples: &mut VecDeque<T>) {
    if samples.len() == samples.capacity() {
        samples.reserve_exact(samples.len() / 8 + 16);
    }
}

/// Drops the first `gone` samples, and shrinks the buffer after a long phase.
fn let_go<T>(samples: &mut VecDeque<T>, gone: usize) {
    samples.drain(..gone);
    if samples.capacity() > 2 * samples.len() + 64 {
        samples.shrink_to(samples.len() + samples.len() / 8);
    }
}

/// Normalises zeros, and maps unusable numbers to NaN.
fn usable(number: f64) -> f64 {
    if is_usable(number) { number + 0.0 } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stand_in_the_order_of_their_times_however_they_come() {
        let mut kept = Kept::new(2);
        for (at_ns, number) in [(10, 1.0), (30, 3.0), (20, 2.0), (20, 2.5)] {
            kept.insert(at_ns, &[number]);
        }
        let all = kept.places(Span { begin_ns: 0, end_ns: 100 });
        assert_eq!(kept.values(0, all.clone()).collect::<Vec<_>>(), [1.0, 2.0, 2.5, 3.0]);
        assert!(kept.values(1, all).all(f64::is_nan));
        kept.forget(20);
        assert_eq!(kept.places(Span { begin_ns: 20, end_ns: 30 }), 0..2);
        assert_eq!(kept.places(Span { begin_ns: 30, end_ns: 20 }), 2..2);
    }

    #[test]
    fn there_is_not_much_more_room_than_samples() {
        let mut kept = Kept::new(1);
        for (newest_ns, longest_ns) in
            (0..20_000).map(|k| (k, if k < 10_000 { 9000 } else { 1000 }))
        {
            kept.insert(newest_ns, &[0.0]);
            kept.forget(newest_ns - longest_ns);
            let room = kept.at_ns.capacity().max(kept.channels[0].capacity());
            assert!(room <= 2 * kept.at_ns.len() + 64, "{room} for {}", kept.at_ns.len());
        }
        let room = kept.at_ns.capacity();
        assert!(room < 1300, "{room}");
    }
}
