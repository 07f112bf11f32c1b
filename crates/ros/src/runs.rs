//! Sets of numbers that are mostly consecutive.

/// The most runs that are kept separately; beyond this number the oldest ones are merged.
const MOST: usize = 64;

/// A set of sequence numbers, stored as runs.
#[derive(Debug, Default)]
pub(crate) struct Runs(Vec<(u64, u64)>);

impl Runs {
    /// Adds a number; returns whether it is new. When there are too many gaps the oldest one is closed:
    /// numbers in it no longer count as new.
    pub(crate) fn insert(&mut self, number: u64) -> bool {
        let behind = self.0.partition_point(|(first, _)| *first <= number);
        if behind > 0 && self.0[behind - 1].1 >= number {
            return false;
        }
        let joins_before = behind > 0 && self.0[behind - 1].1.checked_add(1) == Some(number);
        let joins_behind = self.0.get(behind).is_some_and(|(first, _)| first - 1 == number);
        match (joins_before, joins_behind) {
            (true, true) => self.0[behind - 1].1 = self.0.remove(behind).1,
            (true, false) => self.0[behind - 1].1 = number,
            (false, true) => self.0[behind].0 = number,
            (false, false) => self.0.insert(behind, (number, number)),
        }
        if self.0.len() > MOST {
            self.0[1].0 = self.0.remove(0).0;
        }
        true
    }

    /// The smallest and the largest number; `None` if the set is empty.
    pub(crate) fn ends(&self) -> Option<(u64, u64)> {
        Some((self.0.first()?.0, self.0.last()?.1))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_number_is_new_once(numbers: Vec<u8>) {
            let (mut runs, mut set) = (Runs::default(), BTreeSet::new());
            for number in numbers.into_iter().map(|number| u64::from(number % 100)) {
                prop_assert_eq!(runs.insert(number), set.insert(number));
                let ends = Some((*set.first().unwrap(), *set.last().unwrap()));
                prop_assert_eq!(runs.ends(), ends);
            }
        }

        #[test]
        fn it_stays_small(numbers: Vec<u64>) {
            let mut runs = Runs::default();
            for number in numbers {
                runs.insert(number);
                prop_assert!(runs.0.len() <= MOST);
            }
        }
    }

    #[test]
    fn the_greatest_number_is_a_number() {
        let mut runs = Runs::default();
        assert!(runs.insert(u64::MAX) && runs.insert(0) && runs.insert(u64::MAX - 1));
        assert!(!runs.insert(u64::MAX));
    }
}
