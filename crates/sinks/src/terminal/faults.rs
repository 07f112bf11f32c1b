//! Faults of the session itself: pinned to the screen until somebody has seen them.

use teampulse_core::time::Time;

/// More kinds of faults than these are not kept apart.
const MOST: usize = 100;

/// The faults of the session, each once.
#[derive(Debug, Default)]
pub(super) struct Faults(Vec<Fault>);

/// A fault, and how often there was one like it.
#[derive(Debug)]
pub(super) struct Fault {
    /// What failed.
    pub label: String,
    /// How often.
    pub count: u64,
    /// When, the last time.
    pub last: Time,
    /// Whether somebody has seen it.
    is_seen: bool,
}

impl Faults {
    /// Takes a fault.
    pub fn take(&mut self, label: &str, at: Time) {
        if let Some(fault) = self.0.iter_mut().find(|fault| fault.label == label) {
            (fault.count, fault.last, fault.is_seen) = (fault.count + 1, at, false);
        } else if self.0.len() < MOST {
            let label = label.to_owned();
            self.0.push(Fault { label, count: 1, last: at, is_seen: false });
        }
    }

    /// Somebody has seen them: they stand in the log, and in the summary.
    pub fn see(&mut self) {
        for fault in &mut self.0 {
            fault.is_seen = true;
        }
    }

    /// Those that are still to be seen, the newest first.
    pub fn unseen(&self) -> Vec<&Fault> {
        let mut unseen: Vec<&Fault> = self.0.iter().filter(|fault| !fault.is_seen).collect();
        unseen.sort_by_key(|fault| std::cmp::Reverse(fault.last));
        unseen
    }

    /// All of them.
    pub fn all(&self) -> &[Fault] {
        &self.0
    }
}

impl Fault {
    /// The fault with how often it came.
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
