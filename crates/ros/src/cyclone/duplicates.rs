//! Detection of duplicate messages: a subscription may receive a message through two of its readers.

use std::collections::BTreeMap;

use crate::graph::Gid;
use crate::runs::Runs;

/// The most publishers that are tracked separately; a topic has a few.
const MOST: usize = 4096;

/// The sequence numbers received from each publisher.
#[derive(Debug, Default)]
pub(super) struct Duplicates(BTreeMap<Gid, Runs>);

impl Duplicates {
    /// Whether a message is new. A message without a sequence number always counts as new.
    pub(super) fn first_time(&mut self, publisher: Gid, sequence: Option<u64>) -> bool {
        let Some(sequence) = sequence else { return true };
        if self.0.len() >= MOST && !self.0.contains_key(&publisher) {
            self.0.clear();
        }
        self.0.entry(publisher).or_default().insert(sequence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_seen_for_the_first_time_once() {
        let mut seen = Duplicates::default();
        let (one, other) = (Gid::prefixed([1; 16]), Gid::prefixed([2; 16]));
        assert!(seen.first_time(one, Some(5)));
        assert!(seen.first_time(other, Some(5)));
        assert!(seen.first_time(one, Some(1)), "what is transient local may come later");
        assert!(!seen.first_time(one, Some(5)));
        assert!(seen.first_time(one, None) && seen.first_time(one, None));
    }
}
