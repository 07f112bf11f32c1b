//! The newest values of a stream, contiguous in memory.

use std::ops::Range;

/// A buffer of at least the newest `length` values, addressed by their index in the stream (from 0).
///
/// Indices before the first value hold copies of it.
#[derive(Clone, Debug)]
pub(crate) struct History {
    /// Twice `length` values, of which those from `end` on are unused.
    values: Vec<f64>,
    end: usize,
    length: usize,
    /// The number of values so far.
    pub(crate) count: i64,
}

impl History {
    pub(crate) fn new(length: usize) -> History {
        let length = length.max(1);
        History { values: vec![0.0; 2 * length], end: 2 * length, length, count: 0 }
    }

    #[inline]
    pub(crate) fn push(&mut self, value: f64) {
        if self.end == self.values.len() {
            self.make_room(value);
        }
        self.values[self.end] = value;
        self.end += 1;
        self.count += 1;
    }

    #[cold]
    fn make_room(&mut self, value: f64) {
        if self.count == 0 {
            self.values[..self.length].fill(value);
        } else {
            self.values.copy_within(self.length.., 0);
        }
        self.end = self.length;
    }

    fn held(&self) -> &[f64] {
        if self.count == 0 { &[] } else { &self.values[..self.end] }
    }

    /// The values at these indices, as far as they are held.
    pub(crate) fn at(&self, places: Range<i64>) -> &[f64] {
        let held = self.held();
        let origin = self.count - held.len() as i64;
        let index = |place: i64| (place - origin).clamp(0, held.len() as i64) as usize;
        let (begin, end) = (index(places.start), index(places.end));
        &held[begin..end.max(begin)]
    }

    pub(crate) fn newest(&self, length: usize) -> &[f64] {
        let held = self.held();
        &held[held.len().saturating_sub(length)..]
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
