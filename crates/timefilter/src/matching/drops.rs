//! Why messages are dropped, and counts by reason.

use std::fmt;

/// Why a message is in no set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DropReason {
    /// The message was the oldest in a queue that overflowed.
    QueueFull,
    /// Another topic has no message close enough for the longest interval of a set.
    NoPartner,
    /// The topic that determines its set has lost messages to a full queue, so that a better set may be
    /// lost too.
    PartnerLost,
    /// A better set was found, or a later one was complete first.
    Overtaken,
    /// Another message of its topic arrived with the same stamp, and only one can be matched.
    Replaced,
    /// There is no such topic.
    UnknownTopic,
}

impl DropReason {
    /// All reasons.
    pub const ALL: [DropReason; 6] = [
        DropReason::QueueFull,
        DropReason::NoPartner,
        DropReason::PartnerLost,
        DropReason::Overtaken,
        DropReason::Replaced,
        DropReason::UnknownTopic,
    ];
}

impl fmt::Display for DropReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            DropReason::QueueFull => "queue full",
            DropReason::NoPartner => "no partner near enough",
            DropReason::PartnerLost => "partner lost to a full queue",
            DropReason::Overtaken => "overtaken by a better set",
            DropReason::Replaced => "replaced by one with the same stamp",
            DropReason::UnknownTopic => "unknown topic",
        })
    }
}

/// The numbers of dropped messages, by topic and reason.
#[derive(Clone, Debug)]
pub(super) struct Drops {
    /// Counts for each topic, and for all unknown topics together.
    counts: Vec<[u64; DropReason::ALL.len()]>,
}

impl Drops {
    pub(super) fn of(topics: usize) -> Drops {
        Drops { counts: vec![[0; DropReason::ALL.len()]; topics + 1] }
    }

    #[inline]
    pub(super) fn add(&mut self, topic: usize, reason: DropReason) {
        let row = self.row(topic);
        self.counts[row][reason as usize] += 1;
    }

    pub(super) fn count(&self, topic: usize, reason: DropReason) -> u64 {
        self.counts[self.row(topic)][reason as usize]
    }

    #[inline]
    fn row(&self, topic: usize) -> usize {
        topic.min(self.counts.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_is_counted_for_its_topic_alone() {
        let mut drops = Drops::of(2);
        for (place, reason) in DropReason::ALL.into_iter().enumerate() {
            assert_eq!(reason as usize, place);
            drops.add(1, reason);
            assert_eq!(drops.count(1, reason), 1);
            assert_eq!(drops.count(0, reason), 0);
        }
        drops.add(7, DropReason::UnknownTopic);
        assert_eq!(drops.count(usize::MAX, DropReason::UnknownTopic), 1);
    }
}
