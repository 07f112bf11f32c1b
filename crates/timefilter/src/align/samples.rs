//! The samples of one source that future rows may need.

/// Samples in order of time, equal ones in order of arrival: a ring buffer that grows up to its capacity
/// and never shrinks.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    /// The times of the samples; their number is the size of the ring, a power of two.
    times: Vec<i64>,
    /// The values, one per channel for each time.
    values: Vec<f64>,
    channels: usize,
    capacity: usize,
    head: usize,
    len: usize,
}

const SMALLEST: usize = 16;

impl Samples {
    pub fn new(channels: usize, capacity: usize) -> Samples {
        let places = SMALLEST.min(capacity.next_power_of_two());
        Samples {
            times: vec![0; places],
            values: vec![0.0; places * channels],
            channels,
            capacity,
            head: 0,
            len: 0,
        }
    }

    /// The most memory that the buffer can use [B].
    pub fn bytes_bound(&self) -> usize {
        self.capacity.next_power_of_two().max(self.times.len()) * 8 * (1 + self.channels)
    }

    #[inline]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline]
    pub fn is_full(&self) -> bool {
        self.len >= self.capacity
    }

    /// The time of the sample at an index; the oldest is at 0.
    #[inline]
    pub fn time(&self, place: usize) -> Option<i64> {
        if place < self.len { Some(self.times[self.slot(place)]) } else { None }
    }

    /// The index of the first sample after a time.
    pub fn place_after(&self, time: i64) -> usize {
        let (mut before, mut after) = (0, self.len);
        while before < after {
            let middle = usize::midpoint(before, after);
            if self.times[self.slot(middle)] <= time {
                before = middle + 1;
            } else {
                after = middle;
            }
        }
        before
    }

    /// The values of the sample at an index below [`Samples::len`].
    #[inline]
    pub fn values(&self, place: usize) -> &[f64] {
        let begin = self.slot(place) * self.channels;
        &self.values[begin..begin + self.channels]
    }

    /// The times and values of the oldest two samples, if they have one channel.
    #[inline]
    pub fn first_two_of_one_channel(&self) -> Option<[(i64, f64); 2]> {
        if self.channels != 1 || self.len < 2 {
            return None;
        }
        let sample = |slot| (self.times[slot], self.values[slot]);
        Some([sample(self.slot(0)), sample(self.slot(1))])
    }

    /// Inserts a sample after all that are not newer. There must be room: see [`Samples::is_full`].
    #[inline]
    pub fn insert(&mut self, time: i64, values: &[f64]) {
        if self.len == self.times.len() {
            self.grow();
        }
        let mut place = self.len;
        self.len += 1;
        while place > 0 && self.times[self.slot(place - 1)] > time {
            self.copy(place - 1, place);
            place -= 1;
        }
        self.put(self.slot(place), time, values);
    }

    /// Appends a sample that is not older than any. There must be room: see [`Samples::has_room`].
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the call costs more than what it does")]
    pub fn append(&mut self, time: i64, values: &[f64]) {
        let slot = self.slot(self.len);
        if let [value] = values {
            // Copies one number without a loop or a call.
            (self.times[slot], self.values[slot]) = (time, *value);
        } else {
            self.put(slot, time, values);
        }
        self.len += 1;
    }

    /// Whether a sample fits without growth.
    #[inline]
    pub fn has_room(&self) -> bool {
        self.len < self.times.len() && self.len < self.capacity
    }

    fn put(&mut self, slot: usize, time: i64, values: &[f64]) {
        self.times[slot] = time;
        self.values[slot * self.channels..][..self.channels].copy_from_slice(values);
    }

    /// Drops the samples before the last one at or before a time.
    #[inline]
    pub fn forget_before_last_until(&mut self, time: i64) {
        let Samples { mut head, mut len, .. } = *self;
        let after = |place| (place + 1) & (self.times.len() - 1);
        while len >= 2 && self.times[after(head)] <= time {
            (head, len) = (after(head), len - 1);
        }
        (self.head, self.len) = (head, len);
    }

    #[inline]
    pub fn forget_oldest(&mut self) {
        if self.len > 0 {
            self.head = self.slot(1);
            self.len -= 1;
        }
    }

    #[inline]
    fn slot(&self, place: usize) -> usize {
        (self.head + place) & (self.times.len() - 1)
    }

    fn copy(&mut self, from: usize, to: usize) {
        let (from, to) = (self.slot(from), self.slot(to));
        self.times[to] = self.times[from];
        let begin = from * self.channels;
        self.values.copy_within(begin..begin + self.channels, to * self.channels);
    }

    #[cold]
    fn grow(&mut self) {
        let places = self.times.len();
        self.times.rotate_left(self.head);
        self.values.rotate_left(self.head * self.channels);
        self.head = 0;
        self.times.reserve_exact(places);
        self.times.resize(2 * places, 0);
        self.values.reserve_exact(places * self.channels);
        self.values.resize(2 * places * self.channels, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn samples_are_kept_in_order_of_their_times(
            steps in prop::collection::vec((any::<bool>(), -20_i64..20), 0..300),
        ) {
            let mut samples = Samples::new(2, 1_000);
            let mut expected: Vec<(i64, f64)> = Vec::new();
            for (number, (forget, time)) in steps.into_iter().enumerate() {
                if forget && !expected.is_empty() {
                    expected.remove(0);
                    samples.forget_oldest();
                } else {
                    expected.push((time, number as f64));
                    expected.sort_by_key(|sample| sample.0);
                    samples.insert(time, &[number as f64, -1.0]);
                }
            }
            let kept = (0..samples.len()).map(|k| (samples.time(k).unwrap(), samples.values(k)[0]));
            prop_assert!(kept.eq(expected));
        }
    }
}
