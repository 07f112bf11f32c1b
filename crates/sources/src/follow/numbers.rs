//! The sequence numbers of publishers' samples.

use std::collections::BTreeMap;

use teampulse_ros::graph::Gid;

/// The largest number of publishers tracked separately; a topic has a few.
const MOST: usize = 4096;
/// The largest step back of a late sample; a larger step back is a restart.
const LATE: u64 = 16;

/// Finds samples that never reached their publisher, by the publisher's own numbers: a device that lost its radio link
/// leaves a gap that the bus can't detect.
#[derive(Debug, Default)]
pub(super) struct Numbers(BTreeMap<Gid, Counting>);

#[derive(Debug, Default)]
struct Counting {
    newest: Option<u64>,
    /// Whether two consecutive numbers were seen: constant numbers and times are not a count.
    is_counting: bool,
}

impl Numbers {
    /// The number of samples missing before a publisher's sample.
    pub(super) fn missing_before(&mut self, publisher: Gid, index: u64) -> u64 {
        if self.0.len() >= MOST && !self.0.contains_key(&publisher) {
            self.0.clear();
        }
        self.0.entry(publisher).or_default().missing_before(index)
    }
}

impl Counting {
    fn missing_before(&mut self, index: u64) -> u64 {
        let Some(newest) = self.newest else {
            self.newest = Some(index);
            return 0;
        };
        if index <= newest && newest - index <= LATE {
            return 0;
        }
        self.newest = Some(index);
        match index.checked_sub(newest) {
            Some(1) => {
                self.is_counting = true;
                0
            }
            Some(step) if self.is_counting => step - 1,
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missing(indices: &[u64]) -> u64 {
        let mut numbers = Numbers::default();
        indices.iter().map(|index| numbers.missing_before(Gid::default(), *index)).sum()
    }

    #[test]
    fn a_jump_is_what_never_reached_the_publisher() {
        assert_eq!(missing(&[7, 8, 12, 13, 20]), 3 + 6);
    }

    #[test]
    fn a_publisher_that_begins_anew_has_lost_nothing() {
        assert_eq!(missing(&[100, 101, 102, 0, 1, 2]), 0);
        assert_eq!(missing(&[0, 1, 2, 0, 1, 2, 3]), 0);
    }

    #[test]
    fn who_does_not_count_loses_nothing() {
        assert_eq!(missing(&[0, 0, 0, 0]), 0);
        assert_eq!(missing(&[1_000_000, 5_000_000, 9_000_000]), 0);
        assert_eq!(missing(&[0, u64::MAX]), 0);
    }
}
