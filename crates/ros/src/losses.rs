//! Message losses: gaps in the publishers' sequence numbers.

use std::collections::BTreeMap;

use crate::graph::Gid;
use crate::runs::Runs;

/// The most publishers that are tracked separately; a topic has a few.
const MOST: usize = 4096;

/// Counts the lost messages of a topic, for each of its publishers.
#[derive(Debug, Default)]
pub struct Losses(BTreeMap<Gid, Publisher>);

#[derive(Debug, Default)]
struct Publisher {
    heard: Runs,
    /// The number of messages that were counted as lost but arrived later.
    mistaken: u64,
}

impl Losses {
    /// Creates a counter without publishers.
    pub fn new() -> Losses {
        Losses::default()
    }

    /// Takes in the sequence number of a received message; returns the number of messages lost before it.
    ///
    /// Counting starts at the first number received. A message that arrives out of order was already counted as lost,
    /// so it is deducted from the next loss. Duplicates, and messages from before the first, are ignored.
    pub fn observe(&mut self, publisher: Gid, sequence: u64) -> u64 {
        if self.0.len() >= MOST && !self.0.contains_key(&publisher) {
            self.0.clear();
        }
        self.0.entry(publisher).or_default().observe(sequence)
    }
}

impl Publisher {
    fn observe(&mut self, sequence: u64) -> u64 {
        let ends = self.heard.ends();
        let is_new = self.heard.insert(sequence);
        match ends {
            Some((_, last)) if sequence > last => {
                let missing = sequence - last - 1;
                let lost = missing.saturating_sub(self.mistaken);
                self.mistaken -= missing - lost;
                lost
            }
            Some((first, _)) if is_new && sequence > first => {
                self.mistaken += 1;
                0
            }
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lost(sequences: impl IntoIterator<Item = u64>) -> u64 {
        let mut losses = Losses::new();
        sequences.into_iter().map(|sequence| losses.observe(Gid::default(), sequence)).sum()
    }

    #[test]
    fn consecutive_numbers_lose_nothing_wherever_they_begin() {
        assert_eq!(lost(1..100), 0);
        assert_eq!(lost(5_000_000_000..5_000_000_100), 0);
    }

    #[test]
    fn a_jump_is_as_many_losses_as_it_is_wide() {
        assert_eq!(lost([1, 2, 5, 6, 10]), 5);
        assert_eq!(lost([0, u64::MAX]), u64::MAX - 1);
    }

    #[test]
    fn what_is_transient_local_may_come_after_what_is_live() {
        assert_eq!(lost([4, 1, 2, 3, 5]), 0);
    }

    #[test]
    fn what_comes_late_is_made_good_with_the_next_loss() {
        assert_eq!(lost([1, 3, 2, 4]), 1);
        assert_eq!(lost([1, 3, 2, 5]), 1);
    }

    #[test]
    fn publishers_are_counted_apart() {
        let mut losses = Losses::new();
        let (one, other) = (Gid::prefixed([1; 16]), Gid::prefixed([2; 16]));
        assert_eq!(losses.observe(one, 1), 0);
        assert_eq!(losses.observe(other, 50), 0);
        assert_eq!(losses.observe(one, 2), 0);
        assert_eq!(losses.observe(other, 53), 2);
    }

    proptest! {
        #[test]
        fn duplicates_change_nothing(numbers in prop::collection::vec(0_u64..50, 0..40)) {
            let sorted = {
                let mut sorted = numbers.clone();
                sorted.sort_unstable();
                sorted
            };
            let mut once = sorted.clone();
            once.dedup();
            prop_assert_eq!(lost(sorted), lost(once));
        }

        #[test]
        fn what_is_lost_and_what_is_heard_are_all_there_was(
            heard in prop::collection::btree_set(0_u64..200, 1..60),
        ) {
            let (first, last) = (*heard.first().unwrap(), *heard.last().unwrap());
            let count = heard.len() as u64;
            prop_assert_eq!(lost(heard) + count, last - first + 1);
        }
    }
}
