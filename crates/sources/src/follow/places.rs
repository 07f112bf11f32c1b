//! Where messages of reliable publishers were lost: in this machine's receive buffers, whose losses the kernel counts,
//! or before they reached this machine.

use std::collections::{BTreeMap, VecDeque};

/// The largest number of checks between a loss and the report that a receive buffer overflowed, which is made every
/// second.
const NEWS_TAKE: usize = 3;
/// The smallest number of checks between two reports.
const BETWEEN_REPORTS: u32 = 20;

/// Losses that have not been located yet, by check.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// The losses by topic in each of the last checks.
    waiting: VecDeque<BTreeMap<String, u64>>,
    /// The number of further checks whose losses may come from the last overflow.
    overflowed: usize,
    /// Losses that occurred before reaching this machine.
    elsewhere: BTreeMap<String, u64>,
    until_report: u32,
}

impl Places {
    /// Records that a receive buffer of this machine overflowed.
    pub(super) fn overflow(&mut self) {
        self.waiting.clear();
        self.overflowed = NEWS_TAKE;
    }

    /// Takes the losses by topic since the last check; returns a report if one is due.
    pub(super) fn look(&mut self, lost: BTreeMap<String, u64>) -> Option<String> {
        if self.overflowed > 0 {
            self.overflowed -= 1;
            self.waiting.clear();
        } else {
            self.waiting.push_back(lost);
        }
        if self.waiting.len() > NEWS_TAKE {
            for (topic, count) in self.waiting.pop_front().into_iter().flatten() {
                *self.elsewhere.entry(topic).or_default() += count;
            }
        }
        self.until_report = self.until_report.saturating_sub(1);
        if self.until_report > 0 { None } else { self.report() }
    }

    /// Reports the losses that occurred before reaching this machine; `None` if there are none.
    pub(super) fn report(&mut self) -> Option<String> {
        let elsewhere = std::mem::take(&mut self.elsewhere);
        let count: u64 = elsewhere.values().sum();
        if count == 0 {
            return None;
        }
        self.until_report = BETWEEN_REPORTS;
        let messages = if count == 1 { "message" } else { "messages" };
        let topics = match elsewhere.keys().next() {
            Some(topic) if elsewhere.len() == 1 => topic.clone(),
            _ => format!("{} topics", elsewhere.len()),
        };
        Some(format!(
            "{count} {messages} of {topics} lost before reaching this machine, whose receive buffers had \
             room: overwritten by the publisher before they were sent (a larger depth helps), or lost \
             by the network and not sent again in time"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(count: u64) -> BTreeMap<String, u64> {
        BTreeMap::from([("/scan".to_owned(), count)])
    }

    /// Checks this many times without a loss; returns the reports.
    fn quiet(places: &mut Places, looks: usize) -> Vec<String> {
        (0..looks).filter_map(|_| places.look(BTreeMap::new())).collect()
    }

    #[test]
    fn what_no_receive_buffer_dropped_was_lost_before() {
        let mut places = Places::default();
        assert_eq!(places.look(lost(7)), None, "the news may still come");
        let labels = quiet(&mut places, NEWS_TAKE);
        assert!(
            labels[0].starts_with("7 messages of /scan lost before reaching this"),
            "{labels:?}"
        );
        assert_eq!(labels.len(), 1);
        assert_eq!(places.report(), None, "each is reported once");
    }

    #[test]
    fn what_is_lost_around_an_overflow_may_be_lost_here() {
        let mut places = Places::default();
        places.look(lost(5));
        places.overflow();
        places.look(lost(5));
        assert!(quiet(&mut places, 40).is_empty());
        places.look(lost(1));
        assert!(quiet(&mut places, 40)[0].starts_with("1 message of /scan lost before"));
    }

    #[test]
    fn losses_that_go_on_are_reported_now_and_then_and_all_together() {
        let mut places = Places::default();
        let labels: Vec<String> = (0..100).filter_map(|_| places.look(lost(2))).collect();
        assert!((2..=6).contains(&labels.len()), "{labels:?}");
        let rest = quiet(&mut places, 40);
        let count = |labels: &String| labels.split(' ').next().unwrap().parse::<u64>().unwrap();
        assert_eq!(labels.iter().chain(&rest).map(count).sum::<u64>(), 200);
    }

    #[test]
    fn several_topics_are_counted_together() {
        let mut places = Places::default();
        places.look(BTreeMap::from([("/a".to_owned(), 1), ("/b".to_owned(), 2)]));
        assert!(quiet(&mut places, 5)[0].starts_with("3 messages of 2 topics"));
    }
}
