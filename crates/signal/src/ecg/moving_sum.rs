//! The sum of the newest values.

/// The sum of the newest `length` values, in two additions a value and without ever taking one off
/// again: what was large leaves no rounding behind.
///
/// Values come in blocks of `length`: the newest ones are the end of the last block, whose sums are
/// known, and the beginning of this one. Before the first value stand zeros.
#[derive(Clone, Debug)]
pub(super) struct MovingSum {
    block: Vec<f64>,
    /// Of each place in the last block, the sum from there to its end.
    ends: Vec<f64>,
    begin: f64,
    length: usize,
}

impl MovingSum {
    pub(super) fn new(length: usize) -> MovingSum {
        let length = length.max(1);
        let (block, ends) = (Vec::with_capacity(length), vec![0.0; length + 1]);
        MovingSum { block, ends, begin: 0.0, length }
    }

    /// The sum after the next value.
    pub(super) fn push(&mut self, value: f64) -> f64 {
        self.block.push(value);
        self.begin += value;
        let sum = self.ends[self.block.len()] + self.begin;
        if self.block.len() == self.length {
            for place in (0..self.length).rev() {
                self.ends[place] = self.ends[place + 1] + self.block[place];
            }
            self.block.clear();
            self.begin = 0.0;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_sum_of_the_newest_whatever_was_before() {
        let values: Vec<f64> =
            (0..200i32).map(|k| if k == 50 { 1e20 } else { f64::from(k * k % 17) }).collect();
        let mut sum = MovingSum::new(7);
        for (index, &value) in values.iter().enumerate() {
            let newest = &values[index.saturating_sub(6)..=index];
            let (sum, truth) = (sum.push(value), newest.iter().sum::<f64>());
            assert!(sum == truth || newest.contains(&1e20), "{sum} for {truth}");
        }
    }
}
