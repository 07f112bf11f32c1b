//! The faults of a session: when each was first reported, and how often.

use std::collections::BTreeMap;

use teampulse_core::time::Time;

/// The maximum number of kinds of faults kept separately; further kinds are only counted.
const MOST: usize = 1000;

/// The faults so far, by label.
#[derive(Debug, Default)]
pub(super) struct FaultCounts {
    kinds: BTreeMap<String, (Time, u64)>,
    /// The number of faults of further kinds.
    others: u64,
}

impl FaultCounts {
    /// Takes a fault.
    pub(super) fn take(&mut self, label: &str, at: Time) {
        if self.kinds.len() < MOST || self.kinds.contains_key(label) {
            self.kinds.entry(label.to_owned()).or_insert((at, 0)).1 += 1;
        } else {
            self.others += 1;
        }
    }

    /// The kinds of faults kept, each with its first time and its count, in order of first time.
    pub(super) fn kinds(&self) -> Vec<(&str, Time, u64)> {
        let all = self.kinds.iter();
        let mut kinds: Vec<_> =
            all.map(|(label, &(at, count))| (label.as_str(), at, count)).collect();
        kinds.sort_by_key(|&(label, at, _)| (at, label));
        kinds
    }

    /// The number of faults of further kinds.
    pub(super) fn others(&self) -> u64 {
        self.others
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_beyond_those_kept_are_counted() {
        let mut faults = FaultCounts::default();
        for number in 0..MOST + 2 {
            faults.take(&format!("fault {number}"), Time::from_nanos(1_000_000 - number as i64));
        }
        faults.take("fault 0", Time::from_nanos(2_000_000));
        assert_eq!((faults.kinds().len(), faults.others()), (MOST, 2));
        assert_eq!(faults.kinds().last(), Some(&("fault 0", Time::from_nanos(1_000_000), 2)));
    }
}
