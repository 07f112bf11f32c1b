//! A moving sum.

/// The sum of the newest `length` values, with two additions per value and no subtraction, so that large
/// values leave no rounding error behind.
///
/// Values come in blocks of `length`: the window is the end of the last block, whose suffix sums are known,
/// and the start of the current one. Values before the first count as zero.
#[derive(Clone, Debug)]
pub(super) struct MovingSum {
    block: Vec<f64>,
    /// The suffix sums of the last block.
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
