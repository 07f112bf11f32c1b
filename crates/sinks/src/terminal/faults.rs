//! Faults of the session itself, pinned to the screen until acknowledged.

use teampulse_core::time::Time;

/// The maximum number of different faults that are kept.
const MOST: usize = 100;

/// The faults of the session, each listed once.
#[derive(Debug, Default)]
pub(super) struct Faults(Vec<Fault>);

/// A fault and its number of occurrences.
#[derive(Debug)]
pub(super) struct Fault {
    /// The text of the fault.
    pub label: String,
    /// The number of occurrences.
    pub count: u64,
    /// The time of the last occurrence.
    pub last: Time,
    /// Whether it was acknowledged.
    is_seen: bool,
}

impl Faults {
    /// Counts a fault.
    pub fn take(&mut self, label: &str, at: Time) {
        if let Some(fault) = self.0.iter_mut().find(|fault| fault.label == label) {
            (fault.count, fault.last, fault.is_seen) = (fault.count + 1, at, false);
        } else if self.0.len() < MOST {
            let label = label.to_owned();
            self.0.push(Fault { label, count: 1, last: at, is_seen: false });
        }
    }

    /// Acknowledges all faults; they remain in the log and the summary.
    pub fn see(&mut self) {
        for fault in &mut self.0 {
            fault.is_seen = true;
        }
    }

    /// Faults not yet acknowledged, the newest first.
    pub fn unseen(&self) -> Vec<&Fault> {
        let mut unseen: Vec<&Fault> = self.0.iter().filter(|fault| !fault.is_seen).collect();
        unseen.sort_by_key(|fault| std::cmp::Reverse(fault.last));
        unseen
    }

    /// All faults.
    pub fn all(&self) -> &[Fault] {
        &self.0
    }
}

impl Fault {
    /// The fault with its number of occurrences.
    pub fn words(&self) -> String {
        match self.count {
            1 => self.label.clone(),
            count => format!("{} ({count} times)", self.label),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_stays_until_it_is_seen_and_comes_back_when_it_happens_again() {
        let (mut faults, at) = (Faults::default(), |secs| Time::from_stamp(secs, 0));
        faults.take("bag: failed to write", at(1));
        faults.take("robots: failed to listen", at(2));
        faults.take("bag: failed to write", at(3));
        let words: Vec<String> = faults.unseen().iter().map(|fault| fault.words()).collect();
        assert_eq!(words, ["bag: failed to write (2 times)", "robots: failed to listen"]);
        faults.see();
        assert!(faults.unseen().is_empty() && faults.all().len() == 2);
        faults.take("robots: failed to listen", at(4));
        assert_eq!(faults.unseen().len(), 1);
    }
}
