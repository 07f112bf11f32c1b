//! The newest values of a stream, contiguous in memory.

use std::ops::Range;

/// At least the newest `length` values, addressed by their index in the stream (from 0).
///
/// Indices before the first value hold copies of it.
#[derive(Clone, Debug)]
pub(crate) struct History {
    values: Vec<f64>,
    length: usize,
    /// The number of values so far.
    pub(crate) count: i64,
}

impl History {
    pub(crate) fn new(length: usize) -> History {
        let length = length.max(1);
        History { values: Vec::with_capacity(2 * length), length, count: 0 }
    }

    pub(crate) fn push(&mut self, value: f64) {
        if self.count == 0 {
            self.values.resize(self.length, value);
        }
        if self.values.len() == 2 * self.length {
            self.values.copy_within(self.length.., 0);
            self.values.truncate(self.length);
        }
        self.values.push(value);
        self.count += 1;
    }

    /// The values at these indices, as far as they are held.
    pub(crate) fn at(&self, places: Range<i64>) -> &[f64] {
        let origin = self.count - self.values.len() as i64;
        let index = |place: i64| (place - origin).clamp(0, self.values.len() as i64) as usize;
        let (begin, end) = (index(places.start), index(places.end));
        &self.values[begin..end.max(begin)]
    }

    pub(crate) fn newest(&self, length: usize) -> &[f64] {
        &self.values[self.values.len().saturating_sub(length)..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_values_stand_at_their_places() {
        let mut history = History::new(4);
        (0..23).for_each(|value| history.push(f64::from(value)));
        assert_eq!(history.at(19..23), [19.0, 20.0, 21.0, 22.0]);
        assert_eq!(history.newest(2), [21.0, 22.0]);
        assert_eq!(history.at(30..40), [0.0; 0]);
    }

    #[test]
    fn before_the_first_value_stand_copies_of_it() {
        let mut history = History::new(3);
        history.push(7.0);
        assert_eq!(history.at(-2..1), [7.0, 7.0, 7.0]);
    }
}
