//! Sets of messages with stamps near each other.

use std::collections::VecDeque;

use super::age_penalty::AgePenalty;
use super::drops::Drops;
use super::{DropReason, Listener, Message};

/// How [`ApproximateTime`] matches.
#[derive(Clone, Debug, PartialEq)]
pub struct ApproximateSettings {
    /// What is special to each topic; there are as many topics as these.
    pub topics: Vec<TopicSettings>,
    /// How much more a later end of a set counts against it than a later start counts for it;
    /// 0.1 in ROS. Negative and NaN count as 0.
    pub age_penalty: f64,
    /// The longest interval from a set's oldest to its newest stamp [ns]; without end in ROS.
    /// Negative counts as 0. Where stamps are out of order, a set may be longer than that: a search
    /// begins within the interval, and goes on to what is better by the age penalty.
    pub max_interval_nanos: i64,
}

/// What is special to a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicSettings {
    /// How many messages may wait; 0 counts as 1, and with less than 2 many are dropped.
    pub queue_size: usize,
    /// The least time from one stamp to the next [ns], 0 in ROS. Where it is known, a set is out
    /// sooner, since nothing better can follow; where it is wrong, it may be another set.
    pub lower_bound_nanos: i64,
}

impl ApproximateSettings {
    /// ROS's settings for a number of topics, each with a queue of that size.
    pub fn new(topics: usize, queue_size: usize) -> ApproximateSettings {
        ApproximateSettings {
            topics: vec![TopicSettings { queue_size, lower_bound_nanos: 0 }; topics],
            age_penalty: 0.1,
            max_interval_nanos: i64::MAX,
        }
    }
}

/// The sets of ROS's C++ `message_filters::sync_policies::ApproximateTime`, for any number of
/// topics.
///
/// The newest of the oldest messages is the *pivot*: the next set has it, unless a queue overflows
/// before. Of all sets around the pivot the shortest is given out, as soon as no message to come can
/// make a shorter one; an older set is preferred to a slightly shorter one
/// ([`ApproximateSettings::age_penalty`]). So there are at most as many sets as the slowest topic
/// has messages, and none while a topic is silent. Sets do not cross: of each topic, a later set has
/// a later arrival.
///
/// Sets are those of `message_filters` 1.15.15 to the message, where stamps are what `ros::Time`
/// can hold. Stamps out of order are taken as they are. Memory is bounded by the queue sizes, and
/// nothing is allocated once the queues have grown.
#[derive(Clone, Debug)]
pub struct ApproximateTime<T> {
    age_penalty: AgePenalty,
    max_interval_nanos: i64,
    queues: Vec<Queue<T>>,
    /// Of each topic, the stamp of the oldest message that is not passed over. Stale where there
    /// is none.
    heads: Vec<i64>,
    /// How many topics have such a message.
    ready: usize,
    /// Of each topic, whether a message was lost that might have been better than its head.
    lossy: Vec<bool>,
    /// The best set so far: the oldest message of each queue.
    candidate: Option<Candidate>,
    /// What the search ahead looks at, for each topic.
    ahead: Vec<Ahead>,
    /// The set that is given out.
    set: Vec<Message<T>>,
    drops: Drops,
}

#[derive(Clone, Debug)]
struct Queue<T> {
    settings: TopicSettings,
    messages: VecDeque<Message<T>>,
    /// How many of the oldest are passed over in the search for a better set.
    passed: usize,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    pivot: usize,
    pivot_stamp: i64,
    start: i64,
    end: i64,
}

/// A message that is here, or the earliest that can come.
#[derive(Clone, Copy, Debug)]
struct Ahead {
    stamp: i64,
    place: usize,
}

/// From the oldest to the newest stamp among one of each topic.
#[derive(Clone, Copy, Debug)]
struct Interval {
    start: i64,
    end: i64,
    /// The first topic with the oldest.
    first: usize,
    /// The last topic with the newest.
    last: usize,
}

impl<T> ApproximateTime<T> {
    /// Nothing waits.
    pub fn new(settings: &ApproximateSettings) -> ApproximateTime<T> {
        let topics = settings.topics.len();
        ApproximateTime {
            age_penalty: AgePenalty::new(settings.age_penalty),
            max_interval_nanos: settings.max_interval_nanos.max(0),
            queues: settings.topics.iter().copied().map(Queue::new).collect(),
            heads: vec![0; topics],
            ready: 0,
            lossy: vec![false; topics],
            candidate: None,
            ahead: Vec::with_capacity(topics),
            set: Vec::with_capacity(topics),
            drops: Drops::of(topics),
        }
    }

    /// Takes the next message of a topic, in order of arrival, and reports the result to the listener.
    #[inline]
    pub fn push(&mut self, topic: usize, message: Message<T>, listener: &mut impl Listener<T>) {
        let Some(queue) = self.queues.get_mut(topic) else {
            self.drops.add(topic, DropReason::UnknownTopic);
            return listener.dropped(topic, message, DropReason::UnknownTopic);
        };
        let stamp = message.stamp;
        queue.messages.push_back(message);
        if queue.messages.len() == queue.passed + 1 {
            self.heads[topic] = stamp;
            self.ready += 1;
            self.search(listener);
        }
        let queue = &self.queues[topic];
        if queue.messages.len() > queue.settings.queue_size {
            self.shed(topic, listener);
        }
    }

    /// How many messages of a topic wait for a set; 0 for an unknown one.
    pub fn waiting(&self, topic: usize) -> usize {
        self.queues.get(topic).map_or(0, |queue| queue.messages.len())
    }

    /// How many messages of a topic were dropped for a reason; unknown topics are counted together.
    pub fn dropped(&self, topic: usize, reason: DropReason) -> u64 {
        self.drops.count(topic, reason)
    }

    /// Looks at interval after interval while there is a message of each topic.
    fn search(&mut self, listener: &mut impl Listener<T>) {
        while self.ready == self.queues.len() {
            let interval = Interval::of(self.heads.iter().copied());
            self.trust_all_but(interval.last);
            let candidate = match self.candidate {
                None => {
                    if let Some(reason) = self.objection(&interval) {
                        self.drop_oldest(interval.first, reason, listener);
                        continue;
                    }
                    self.adopt(&interval, interval.last, interval.end, listener)
                }
                Some(best) if self.is_better(&interval, &best) => {
                    self.adopt(&interval, best.pivot, best.pivot_stamp, listener)
                }
                Some(best) => best,
            };
            self.pass_over(interval.first);
            if interval.first == candidate.pivot
                || self.is_too_late(interval.end, &candidate)
                || self.ready < self.queues.len() && self.is_best_to_come(&candidate)
            {
                self.publish(listener);
            }
        }
    }

    /// Nothing lost from these topics could have been better than what they have now.
    fn trust_all_but(&mut self, last: usize) {
        let lossy = self.lossy[last];
        self.lossy.fill(false);
        self.lossy[last] = lossy;
    }

    /// Why no search can begin with this interval.
    fn objection(&self, interval: &Interval) -> Option<DropReason> {
        if interval.end.saturating_sub(interval.start) > self.max_interval_nanos {
            return Some(DropReason::NoPartner);
        }
        self.lossy[interval.last].then_some(DropReason::PartnerLost)
    }

    fn is_better(&self, interval: &Interval, best: &Candidate) -> bool {
        !self.costs(interval.end, best, interval.start.saturating_sub(best.start))
    }

    /// Whether no set that ends then or later can be better: it must contain the pivot.
    fn is_too_late(&self, end: i64, best: &Candidate) -> bool {
        self.costs(end, best, best.pivot_stamp.saturating_sub(best.start))
    }

    /// Whether a later start by `gain_nanos` does not make up for the end.
    fn costs(&self, end: i64, best: &Candidate, gain_nanos: i64) -> bool {
        self.age_penalty.outweighs(end.saturating_sub(best.end), gain_nanos)
    }

    /// Makes the interval the best set, and drops what was passed over on the way to it.
    fn adopt(
        &mut self,
        interval: &Interval,
        pivot: usize,
        pivot_stamp: i64,
        listener: &mut impl Listener<T>,
    ) -> Candidate {
        for (topic, queue) in self.queues.iter_mut().enumerate() {
            while queue.passed > 0
                && let Some(message) = queue.messages.pop_front()
            {
                queue.passed -= 1;
                self.drops.add(topic, DropReason::Overtaken);
                listener.dropped(topic, message, DropReason::Overtaken);
            }
        }
        let candidate = Candidate { pivot, pivot_stamp, start: interval.start, end: interval.end };
        *self.candidate.insert(candidate)
    }

    fn pass_over(&mut self, topic: usize) {
        self.queues[topic].passed += 1;
        self.refresh(topic);
    }

    /// Whether the candidate is best whatever comes, given that nothing comes before the pivot or
    /// sooner after its predecessor than the lower bound.
    fn is_best_to_come(&mut self, best: &Candidate) -> bool {
        self.ahead.clear();
        for queue in &self.queues {
            self.ahead.push(queue.ahead(queue.passed, best.pivot_stamp));
        }
        loop {
            let interval = Interval::of(self.ahead.iter().map(|ahead| ahead.stamp));
            if self.is_too_late(interval.end, best) {
                return true;
            }
            if self.is_better(&interval, best) {
                return false;
            }
            // Neither holds, so the start is before the pivot: it is a message that is here.
            let ahead = &mut self.ahead[interval.first];
            *ahead = self.queues[interval.first].ahead(ahead.place + 1, best.pivot_stamp);
        }
    }

    /// Gives the candidate out; all messages that were passed over count again.
    fn publish(&mut self, listener: &mut impl Listener<T>) {
        self.candidate = None;
        for queue in &mut self.queues {
            self.set.extend(queue.messages.pop_front());
        }
        self.rewind();
        listener.set(self.set.drain(..));
    }

    /// Drops the oldest message of a full queue; a search begins anew without it.
    fn shed(&mut self, topic: usize, listener: &mut impl Listener<T>) {
        let searching = self.candidate.take().is_some();
        if searching {
            self.rewind();
        }
        self.drop_oldest(topic, DropReason::QueueFull, listener);
        self.lossy[topic] = true;
        if searching {
            self.search(listener);
        }
    }

    /// All messages that were passed over count again.
    fn rewind(&mut self) {
        self.ready = 0;
        for (queue, head) in self.queues.iter_mut().zip(&mut self.heads) {
            queue.passed = 0;
            if let Some(oldest) = queue.messages.front() {
                *head = oldest.stamp;
                self.ready += 1;
            }
        }
    }

    /// Drops the oldest message of a topic of which none is passed over.
    fn drop_oldest(&mut self, topic: usize, reason: DropReason, listener: &mut impl Listener<T>) {
        if let Some(message) = self.queues[topic].messages.pop_front() {
            self.refresh(topic);
            self.drops.add(topic, reason);
            listener.dropped(topic, message, reason);
        }
    }

    /// The head of the topic has gone.
    fn refresh(&mut self, topic: usize) {
        let queue = &self.queues[topic];
        match queue.messages.get(queue.passed) {
            Some(message) => self.heads[topic] = message.stamp,
            None => self.ready -= 1,
        }
    }
}

impl<T> Queue<T> {
    fn new(settings: TopicSettings) -> Queue<T> {
        let settings = TopicSettings {
            queue_size: settings.queue_size.max(1),
            lower_bound_nanos: settings.lower_bound_nanos.max(0),
        };
        Queue { settings, messages: VecDeque::new(), passed: 0 }
    }

    /// The message at that place, or the earliest that can come there.
    fn ahead(&self, place: usize, pivot_stamp: i64) -> Ahead {
        let to_come = || {
            let newest = self.messages.back().map_or(pivot_stamp, |message| message.stamp);
            newest.saturating_add(self.settings.lower_bound_nanos).max(pivot_stamp)
        };
        let stamp = self.messages.get(place).map_or_else(to_come, |message| message.stamp);
        Ahead { stamp, place }
    }
}

impl Interval {
    fn of(stamps: impl Iterator<Item = i64>) -> Interval {
        let mut interval = Interval { start: i64::MAX, end: i64::MIN, first: 0, last: 0 };
        for (topic, stamp) in stamps.enumerate() {
            if stamp < interval.start {
                (interval.start, interval.first) = (stamp, topic);
            }
            if stamp >= interval.end {
                (interval.end, interval.last) = (stamp, topic);
            }
        }
        interval
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::Set;

    const SEC: i64 = 1_000_000_000;

    /// The stamps of all sets that come of messages `(topic, stamp)`.
    fn sets(settings: &ApproximateSettings, messages: &[(usize, i64)]) -> Vec<Vec<i64>> {
        let mut matching = ApproximateTime::new(settings);
        let mut sets = Vec::new();
        for &(topic, stamp) in messages {
            let mut listener = |set: Set<'_, ()>| sets.push(set.map(|m| m.stamp).collect());
            matching.push(topic, Message { stamp, payload: () }, &mut listener);
        }
        sets
    }

    #[test]
    fn a_set_waits_until_nothing_better_can_come() {
        let settings = ApproximateSettings::new(2, 10);
        assert!(sets(&settings, &[(0, 0), (1, 3)]).is_empty());
        assert_eq!(sets(&settings, &[(0, 0), (1, 3), (0, 4)]), [[4, 3]]);
        assert_eq!(sets(&settings, &[(0, 0), (1, 3), (0, 9)]), [[0, 3]]);
    }

    #[test]
    fn a_lower_bound_proves_a_set_sooner() {
        let mut settings = ApproximateSettings::new(2, 10);
        settings.topics[0].lower_bound_nanos = 10;
        assert_eq!(sets(&settings, &[(0, 0), (1, 3)]), [[0, 3]]);
    }

    #[test]
    fn equal_stamps_are_a_set_at_once() {
        let settings = ApproximateSettings::new(3, 10);
        assert_eq!(sets(&settings, &[(2, 5), (0, 5), (1, 5)]), [[5, 5, 5]]);
    }

    #[test]
    fn an_older_set_is_preferred_to_a_slightly_shorter_one() {
        let mut settings = ApproximateSettings::new(2, 10);
        let messages = [(0, 0), (1, 10 * SEC), (0, 20 * SEC - 1), (0, 30 * SEC)];
        assert_eq!(sets(&settings, &messages)[0], [0, 10 * SEC]);
        settings.age_penalty = 0.0;
        assert_eq!(sets(&settings, &messages)[0], [20 * SEC - 1, 10 * SEC]);
    }

    #[test]
    fn a_set_is_never_longer_than_the_longest_interval() {
        let mut settings = ApproximateSettings::new(2, 10);
        settings.max_interval_nanos = 5;
        let messages = [(0, 0), (1, 6), (0, 12), (1, 13), (0, 30), (1, 60)];
        assert_eq!(sets(&settings, &messages), [[12, 13]]);
    }

    #[test]
    fn a_full_queue_drops_its_oldest_and_is_not_trusted_as_pivot() {
        let mut matching = ApproximateTime::new(&ApproximateSettings::new(2, 2));
        let mut listener = |_: Set<'_, ()>| panic!("a set without a proof");
        for (topic, stamp) in [(0, 1), (0, 2), (0, 3), (1, 0)] {
            matching.push(topic, Message { stamp, payload: () }, &mut listener);
        }
        assert_eq!(matching.dropped(0, DropReason::QueueFull), 1);
        assert_eq!(matching.dropped(1, DropReason::PartnerLost), 1);
        assert_eq!((matching.waiting(0), matching.waiting(1)), (2, 0));
    }

    #[test]
    fn sixty_four_topics_make_a_set() {
        let settings = ApproximateSettings::new(64, 2);
        let messages: Vec<(usize, i64)> = (0..64).map(|topic| (topic, 7)).collect();
        assert_eq!(sets(&settings, &messages), [[7; 64]]);
    }
}
