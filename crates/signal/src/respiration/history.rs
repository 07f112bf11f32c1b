//! The newest values of a stream, contiguous in memory.

use std::ops::Range;

/// A buffer of at least the newest `length` values, addressed by their index in the stream (from 0).
#[derive(Clone, Debug)]
pub(super) struct History {
    values: Vec<f64>,
    length: usize,
    first: usize,
}

impl History {
    pub(super) fn new(length: usize) -> History {
        History { values: Vec::with_capacity(2 * length), length, first: 0 }
    }

    pub(super) fn push(&mut self, value: f64) {
        if self.values.len() == 2 * self.length {
            self.values.drain(..self.length);
            self.first += self.length;
        }
        self.values.push(value);
    }

    /// The values in a range, as far as they are held, and the index of the first one.
    pub(super) fn at(&self, places: Range<usize>) -> (usize, &[f64]) {
        let end = places.end.saturating_sub(self.first).min(self.values.len());
        let begin = places.start.saturating_sub(self.first).min(end);
        (self.first + begin, &self.values[begin..end])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_held_by_their_places() {
        let mut history = History::new(3);
        (0..20).for_each(|k| history.push(f64::from(k)));
        assert_eq!(history.at(17..20), (17, &[17.0, 18.0, 19.0][..]));
        assert_eq!(history.at(19..25), (19, &[19.0][..]));
        assert_eq!(history.at(25..30).1, &[] as &[f64]);
        assert!(history.at(0..20).1.len() >= 3);
    }
}
